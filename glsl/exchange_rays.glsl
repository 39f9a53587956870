// Places on a patch and directions from it. Twin: src/exchange/directions.rs.

#include "cosine.glsl"
#include "pcg.glsl"

// The four numbers of a ray, each in (0, 1).
vec4 fractions(uint own, uint ray) {
    uvec4 word = pcg4d(uvec4(own, 0x5eedu, 0u, 0u)) + ray * uvec4(3679390609u, 3152041523u, 2700274806u, 2313257605u);
    return (vec4(word >> uvec4(8u)) + vec4(0.5)) * (1.0 / 16777216.0);
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
