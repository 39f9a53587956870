#version 450
// Culls triangles that cover no pixel centre, because setting them up costs a rasteriser time. A workgroup moves the
// kept triangles of its draw to the front and writes the draw command.

#include "types.glsl"

layout(local_size_x = 64) in;

const uint LANES = 64u;
// TRIANGLES_A_DRAW of src/gpu/effects/image/runs.rs divided by the lanes.
const uint TRIANGLES_A_LANE = 32u;

layout(push_constant) uniform CullBlock {
#ifdef GATHERED
    // The place in a pixel of the sample that is drawn, from its upper left corner.
    vec2 sample_place;
#endif
    // First triangle of the dispatch, relative to the start of the bound buffers.
    uint first_triangle;
};
layout(set = 0, binding = 0) uniform ViewBlock { View view; };
layout(set = 0, binding = 1) readonly buffer PositionXBlock { float position_x[]; };
layout(set = 0, binding = 2) readonly buffer PositionYBlock { float position_y[]; };
layout(set = 0, binding = 3) readonly buffer PositionZBlock { float position_z[]; };
layout(set = 0, binding = 4) readonly buffer TrianglesBlock { uint triangles[]; };
layout(set = 0, binding = 5) buffer VisibleTrianglesBlock { uint visible_triangles[]; };
layout(set = 0, binding = 6) buffer DrawsBlock { DrawCommand draws[]; };

#ifdef ROLLING
#define SHUTTER_BINDING 7
#include "shutter.glsl"
#endif

// Triangles that each lane keeps.
shared uint drawn_by[LANES];

// Rasterisers round corners to a grid of at least 1/16 pixel (Vulkan: subPixelPrecisionBits >= 4).
#ifdef SAMPLED
// Samples are up to half a pixel from the centre along each axis.
const float SNAP = 0.0625 + 0.7072;
#else
const float SNAP = 0.0625;
#endif

// Pixel coordinates and depth [m] of a node.
vec3 pixel_of(uint node) {
    vec4 position = vec4(position_x[node], position_y[node], position_z[node], 1.0);
    vec3 camera = vec3(
        dot(view.camera_from_body_x, position),
        dot(view.camera_from_body_y, position),
        dot(view.camera_from_body_z, position)
    );
#ifdef ROLLING
    camera = rolled(position, camera);
#endif
    vec2 ndc = view.clip_scale * camera.xy / camera.z + view.clip_offset;
    vec2 pixel = (0.5 * ndc + vec2(0.5)) * view.size;
#ifdef GATHERED
    // As the vertex shader moves them.
    pixel += vec2(0.5) - sample_place;
#endif
    return vec3(pixel, camera.z);
}

float cross_of(vec2 a, vec2 b) {
    return a.x * b.y - a.y * b.x;
}

// Whether the origin is within the margin of a triangle. Its area is positive if `turn` is 1.
bool is_near(vec2 a, vec2 b, vec2 c, vec3 slack, float turn) {
    float ab = turn * cross_of(a, b) + slack.x;
    float bc = turn * cross_of(b, c) + slack.y;
    float ca = turn * cross_of(c, a) + slack.z;
    return min(ab, min(bc, ca)) >= 0.0;
}

// Whether a triangle may cover a pixel centre of the image. Pixel centres are at half-integer coordinates.
bool covers_a_centre(vec2 a, vec2 b, vec2 c) {
    float margin = SNAP + view.margin;
    vec2 low = min(a, min(b, c));
    vec2 high = max(a, max(b, c));
    vec2 first = max(ceil(low - vec2(0.5 + margin)), vec2(0.0)) + vec2(0.5);
    vec2 last = min(floor(high - vec2(0.5 - margin)), view.size - vec2(1.0)) + vec2(0.5);
    bool any = all(lessThanEqual(first, last));
    bool few = all(lessThanEqual(last - first, vec2(1.0)));
    // Up to two by two centres are tested one by one. A single centre along an axis is tested twice.
    float turn = sign(cross_of(b - a, c - a));
    vec3 slack = margin * vec3(length(b - a), length(c - b), length(a - c));
    vec2 other = vec2(last.x, first.y);
    vec2 another = vec2(first.x, last.y);
    bool near_first = is_near(a - first, b - first, c - first, slack, turn);
    bool near_last = is_near(a - last, b - last, c - last, slack, turn);
    bool near_other = is_near(a - other, b - other, c - other, slack, turn);
    bool near_another = is_near(a - another, b - another, c - another, slack, turn);
    bool covered = near_first || near_last || near_other || near_another || !few;
    return any && covered;
}

// Whether a triangle is drawn.
bool is_drawn(uint first) {
    vec3 pa = pixel_of(triangles[first]);
    vec3 pb = pixel_of(triangles[first + 1u]);
    vec3 pc = pixel_of(triangles[first + 2u]);
    bool before_camera = min(pa.z, min(pb.z, pc.z)) > view.near;
    // The clipper handles a triangle that reaches behind the near plane.
    return covers_a_centre(pa.xy, pb.xy, pc.xy) || !before_camera;
}

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint draw = gl_WorkGroupID.x;
    uint start = draw * LANES * TRIANGLES_A_LANE;
    uint own = start + lane * TRIANGLES_A_LANE;
    // The buffers are bound up to the last triangle of the dispatch.
    uint end = uint(triangles.length()) / 3u;

    uint drawn = 0u;
    uint count = 0u;
    for (uint i = 0u; i < TRIANGLES_A_LANE; i++) {
        uint triangle = own + i;
        // On a CPU driver a branch saves no time, so an index beyond the end tests the last triangle again.
        bool kept = is_drawn(3u * min(triangle, end - 1u)) && triangle < end;
        drawn |= uint(kept) << i;
        count += uint(kept);
    }
    drawn_by[lane] = count;
    barrier();
    uint before = 0u;
    for (uint other = 0u; other < LANES; other++) {
        before += other < lane ? drawn_by[other] : 0u;
    }

    // Kept triangles stay in order, because at equal depth the first one is visible.
    uint to = 3u * (start + before);
    uint left = drawn;
    while (left != 0u) {
        uint from = 3u * (own + uint(findLSB(left)));
        visible_triangles[to] = triangles[from];
        visible_triangles[to + 1u] = triangles[from + 1u];
        visible_triangles[to + 2u] = triangles[from + 2u];
        to += 3u;
        left &= left - 1u;
    }
    if (lane == LANES - 1u) {
        draws[draw] = DrawCommand(3u * (before + count), 1u, 3u * (first_triangle + start), 0, 0u);
    }
}
