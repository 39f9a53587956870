#version 450
// Keeps the triangles that can cover the centre of a pixel. Of a mesh finer than the image most cannot, and a rasteriser
// sets each of them up to find that out; here they become empty triangles, which it drops at once.

#include "types.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform ViewBlock { View view; };
layout(set = 0, binding = 1) readonly buffer PositionXBlock { float position_x[]; };
layout(set = 0, binding = 2) readonly buffer PositionYBlock { float position_y[]; };
layout(set = 0, binding = 3) readonly buffer PositionZBlock { float position_z[]; };
layout(set = 0, binding = 4) readonly buffer TriangleBlock { uint triangles[]; };
layout(set = 0, binding = 5) buffer VisibleTriangleBlock { uint visible_triangles[]; };

// Rasterisers snap corners to a grid of at least 1/16 pixel (Vulkan: subPixelPrecisionBits >= 4).
const float MARGIN = 0.0625;

// Pixel coordinates and depth [m] of a node.
vec3 pixel_of(uint node) {
    vec4 position = vec4(position_x[node], position_y[node], position_z[node], 1.0);
    vec3 camera = vec3(
        dot(view.camera_from_body_x, position),
        dot(view.camera_from_body_y, position),
        dot(view.camera_from_body_z, position)
    );
    vec2 ndc = view.clip_scale * camera.xy / camera.z + view.clip_offset;
    return vec3((0.5 * ndc + vec2(0.5)) * view.size, camera.z);
}

float cross_of(vec2 a, vec2 b) {
    return a.x * b.y - a.y * b.x;
}

// Whether a point is within the margin of a triangle; corners relative to the point, area positive if `turn` is 1.
bool is_near(vec2 a, vec2 b, vec2 c, float turn) {
    float ab = turn * cross_of(a, b) + MARGIN * length(b - a);
    float bc = turn * cross_of(b, c) + MARGIN * length(c - b);
    float ca = turn * cross_of(c, a) + MARGIN * length(a - c);
    return min(ab, min(bc, ca)) >= 0.0;
}

// Whether a triangle may cover the centre of a pixel, which lies at half-integer coordinates within the image.
bool covers_a_centre(vec2 a, vec2 b, vec2 c) {
    vec2 low = min(a, min(b, c));
    vec2 high = max(a, max(b, c));
    vec2 first = max(ceil(low - vec2(0.5 + MARGIN)), vec2(0.0)) + vec2(0.5);
    vec2 last = min(floor(high - vec2(0.5 - MARGIN)), view.size - vec2(1.0)) + vec2(0.5);
    bool any = all(lessThanEqual(first, last));
    bool few = all(lessThanEqual(last - first, vec2(1.0)));
    // Up to two by two centres are tried one by one; where there is but one in an axis it is tried twice.
    float turn = sign(cross_of(b - a, c - a));
    vec2 other = vec2(last.x, first.y);
    vec2 another = vec2(first.x, last.y);
    bool near_first = is_near(a - first, b - first, c - first, turn);
    bool near_last = is_near(a - last, b - last, c - last, turn);
    bool near_other = is_near(a - other, b - other, c - other, turn);
    bool near_another = is_near(a - another, b - another, c - another, turn);
    bool covered = near_first || near_last || near_other || near_another || !few;
    return any && covered;
}

void main() {
    uint first = 3u * gl_GlobalInvocationID.x;
    // The buffers are bound from the first triangle of the dispatch to its last.
    if (first >= uint(triangles.length())) {
        return;
    }
    uint a = triangles[first];
    uint b = triangles[first + 1u];
    uint c = triangles[first + 2u];
    vec3 pa = pixel_of(a);
    vec3 pb = pixel_of(b);
    vec3 pc = pixel_of(c);
    bool before_camera = min(pa.z, min(pb.z, pc.z)) > view.near;
    bool covers = covers_a_centre(pa.xy, pb.xy, pc.xy);
    // A triangle that reaches behind the near plane is left to the clipper.
    bool kept = covers;
    if (!before_camera) {
        kept = true;
    }
    uint keep = uint(kept);
    visible_triangles[first] = a * keep;
    visible_triangles[first + 1u] = b * keep;
    visible_triangles[first + 2u] = c * keep;
}
