// Bundles of rays of a patch to the planet. Twin: src/exchange/sky.rs.

// Unit direction of a word: a place on an octahedron.
vec3 ray_direction(uint word) {
    float x = float((word >> 14u) & 0x3fffu) * (2.0 / 16383.0) - 1.0;
    float y = float(word & 0x3fffu) * (2.0 / 16383.0) - 1.0;
    float z = 1.0 - abs(x) - abs(y);
    float below = max(-z, 0.0);
    x = x < 0.0 ? x + below : x - below;
    y = y < 0.0 ? y + below : y - below;
    return normalize(vec3(x, y, z));
}

// Cosine of the zenith angle of the Sun where a direction meets the planet, at least 0; -1 where it meets none. `ratio` is the
// distance to the planet's centre over its radius, and `sun` the direction of the Sun.
float light_on_ground(vec3 direction, vec3 nadir, vec3 sun, float ratio) {
    float cosine = dot(direction, nadir);
    float inner = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    float way = ratio * cosine - sqrt(max(inner, 0.0));
    float lit = max(dot(way * direction - ratio * nadir, sun), 0.0);
    return min(cosine, inner) > 0.0 ? lit : -1.0;
}
