// Hash of four words to four words (pcg4d of Jarzynski and Olano 2020). Twin: src/thermal/sensor/noise.rs.

uvec4 pcg4d(uvec4 word) {
    uvec4 v = word * 1664525u + uvec4(1013904223u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v = v ^ (v >> uvec4(16u));
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}
