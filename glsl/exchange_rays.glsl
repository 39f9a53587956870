// Places on a patch and directions from it. Twin: src/exchange/directions.rs.

const float TWO_PI = 6.28318530717959;

// Hash of four words to four words (pcg4d of Jarzynski and Olano 2020).
uvec4 patch_hash(uint own) {
    uvec4 v = uvec4(own, 0x5eedu, 0u, 0u) * 1664525u + uvec4(1013904223u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> uvec4(16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// The four numbers of a ray, each in (0, 1).
vec4 fractions(uint own, uint ray) {
    uvec4 word = patch_hash(own) + ray * uvec4(3679390609u, 3152041523u, 2700274806u, 2313257605u);
    return (vec4(word >> uvec4(8u)) + vec4(0.5)) * (1.0 / 16777216.0);
}

// Direction about a unit normal for two numbers in (0, 1), with a probability proportional to the cosine.
vec3 cosine_direction(vec3 normal, vec2 at) {
    float side = normal.z < 0.0 ? -1.0 : 1.0;
    float a = -1.0 / (side + normal.z);
    float b = normal.x * normal.y * a;
    vec3 x = vec3(1.0 + side * normal.x * normal.x * a, side * b, -side * normal.x);
    vec3 y = vec3(b, side + normal.y * normal.y * a, -normal.y);
    float angle = TWO_PI * (at.y - 0.5);
    float radius = sqrt(at.x);
    return sqrt(max(1.0 - at.x, 0.0)) * normal - radius * (cos(angle) * x + sin(angle) * y);
}

// Barycentric weights of the second and third corner of a point in the part of a triangle that is nearest to corner number `corner`.
vec2 point_near_corner(vec2 at, uint corner) {
    float root = sqrt(at.x);
    vec3 weights = vec3(1.0 - root, root * (1.0 - at.y), root * at.y);
    uint most = weights.y > weights.x ? 1u : 0u;
    most = weights.z > max(weights.x, weights.y) ? 2u : most;
    uint shift = 3u + most - corner;
    return vec2(weights[(1u + shift) % 3u], weights[(2u + shift) % 3u]);
}
