#version 450
// Share of the Sun that each node sees, from the shadow map. Four nodes an invocation.

#include "types.glsl"
#include "solar_visibility.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform SunViewBlock { SunView sun_view; };
layout(set = 0, binding = 1) readonly buffer PositionXBlock { vec4 position_x[]; };
layout(set = 0, binding = 2) readonly buffer PositionYBlock { vec4 position_y[]; };
layout(set = 0, binding = 3) readonly buffer PositionZBlock { vec4 position_z[]; };
layout(set = 0, binding = 4) readonly buffer NormalXBlock { vec4 normal_x[]; };
layout(set = 0, binding = 5) readonly buffer NormalYBlock { vec4 normal_y[]; };
layout(set = 0, binding = 6) readonly buffer NormalZBlock { vec4 normal_z[]; };
layout(set = 0, binding = 7) readonly buffer SunDepthBlock { float sun_depth[]; };
layout(set = 0, binding = 8) buffer VisibilityBlock { vec4 visibility[]; };

// 1 if nothing covers the plane of the node's surface at one of the four by four texels around it.
float is_lit(SeenNode node, ivec2 first, int column, int row) {
    ivec2 at = first + ivec2(column, row);
    vec2 off = vec2(at) + vec2(0.5) - node.texel.xy;
    // Beside the craft, that plane can pass the far end of the map, which is empty.
    float own = min(node.texel.z + dot(node.slope, off), 1.0);
    int side = int(sun_view.down.w);
    // The map has an empty margin, and nothing is outside the map.
    ivec2 inside = clamp(at, ivec2(0), ivec2(side - 1));
    return sun_depth[uint(inside.y * side + inside.x)] >= own ? 1.0 : 0.0;
}

float row_of(SeenNode node, ivec2 first, float f, int row) {
    return (1.0 - f) * is_lit(node, first, -1, row) + is_lit(node, first, 0, row)
        + is_lit(node, first, 1, row) + f * is_lit(node, first, 2, row);
}

float solar_visibility(vec3 position, vec3 normal) {
    SeenNode node = seen_node(sun_view, position, normal);
    vec2 low = floor(node.texel.xy - vec2(0.5));
    vec2 f = node.texel.xy - vec2(0.5) - low;
    ivec2 first = ivec2(low);
    float sum = (1.0 - f.y) * row_of(node, first, f.x, -1) + row_of(node, first, f.x, 0)
        + row_of(node, first, f.x, 1) + f.y * row_of(node, first, f.x, 2);
    return sum / 9.0;
}

void main() {
    uint group = gl_GlobalInvocationID.x;
    vec4 px = position_x[group];
    vec4 py = position_y[group];
    vec4 pz = position_z[group];
    vec4 nx = normal_x[group];
    vec4 ny = normal_y[group];
    vec4 nz = normal_z[group];
    visibility[group] = vec4(
        solar_visibility(vec3(px.x, py.x, pz.x), vec3(nx.x, ny.x, nz.x)),
        solar_visibility(vec3(px.y, py.y, pz.y), vec3(nx.y, ny.y, nz.y)),
        solar_visibility(vec3(px.z, py.z, pz.z), vec3(nx.z, ny.z, nz.z)),
        solar_visibility(vec3(px.w, py.w, pz.w), vec3(nx.w, ny.w, nz.w))
    );
}
