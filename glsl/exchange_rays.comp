#version 450
// Casts the rays of patches, one an invocation, and tells where each ends. Twin: src/exchange/cast.rs.

#include "types.glsl"
#include "exchange_rays.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { ExchangePass pass; };
// First corner of a patch and the one after the last, its joint, and whether it is a back.
layout(set = 0, binding = 0) readonly buffer RayPatchesBlock { uvec4 patches[]; };
// Corners of triangles, and the bits of the share of rays that start there or before.
layout(set = 0, binding = 1) readonly buffer RayCornersBlock { uvec2 corners[]; };
// Triangles in the file's pose.
layout(set = 0, binding = 2) readonly buffer RayTrianglesBlock { ShadowTriangle triangles[]; };
// Rows of the poses of the body and of the joints.
layout(set = 0, binding = 3) readonly buffer RayPosesBlock { vec4 poses[]; };
layout(set = 0, binding = 4) readonly buffer RayBoxesBlock { ShadowBox boxes[]; };
layout(set = 0, binding = 5) readonly buffer RayPlacedBlock { ShadowTriangle placed_triangles[]; };
// Patches of the fronts of the corners of each triangle of the tree, and of their backs.
layout(set = 0, binding = 6) readonly buffer RayLeavesBlock { uvec4 leaves[]; };
layout(set = 0, binding = 7) buffer RayEndsBlock { uint ends[]; };

#include "walk.glsl"

uint end_of(vec3 from, vec3 direction) {
    Nearest found = nearest_of(from, direction, pass.boxes);
    if (found.place == SPACE) {
        return SPACE;
    }
    ShadowTriangle triangle = placed_triangles[found.place];
    bool outside = dot(cross(triangle.first.xyz, triangle.second.xyz), direction) < 0.0;
    uvec4 of = leaves[2u * found.place + (outside ? 0u : 1u)];
    float own = 1.0 - found.u - found.v;
    uint later = found.u >= found.v ? of.y : of.z;
    return own >= max(found.u, found.v) ? of.x : later;
}

void main() {
    uint number = gl_GlobalInvocationID.x;
    uint own = pass.first + number / pass.rays;
    if (own >= pass.end) {
        return;
    }
    uvec4 here = patches[own];
    vec4 at = fractions(own, number % pass.rays);
    // The first corner up to whose share the rays reach.
    uint low = here.x;
    uint high = here.y - 1u;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (uintBitsToFloat(corners[middle].y) < at.x) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    float before = low == here.x ? 0.0 : uintBitsToFloat(corners[max(low, 1u) - 1u].y);
    float share = uintBitsToFloat(corners[low].y) - before;
    float within = clamp((at.x - before) / max(share, 1e-30), 0.0, 1.0);
    uint corner = corners[low].x;
    ShadowTriangle triangle = triangles[corner / 3u];
    vec2 weights = point_near_corner(vec2(within, at.y), corner % 3u);
    vec3 outward = normalize(cross(triangle.first.xyz, triangle.second.xyz));
    vec3 normal = here.w == 1u ? -outward : outward;
    vec3 from = triangle.corner.xyz + weights.x * triangle.first.xyz + weights.y * triangle.second.xyz + pass.start * normal;
    vec3 direction = cosine_direction(normal, at.zw);
    vec4 x = poses[3u * here.z];
    vec4 y = poses[3u * here.z + 1u];
    vec4 z = poses[3u * here.z + 2u];
    vec4 place = vec4(from, 1.0);
    vec3 start = vec3(dot(x, place), dot(y, place), dot(z, place));
    vec3 turned = vec3(dot(x.xyz, direction), dot(y.xyz, direction), dot(z.xyz, direction));
    ends[number] = end_of(start, turned);
}
