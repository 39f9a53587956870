#version 450
// Transforms a triangle corner to the shadow map of the Sun, which has depth only.

#include "types.glsl"
#include "solar_visibility.glsl"

layout(set = 0, binding = 0) uniform SunViewBlock { SunView sun_view; };
layout(set = 0, binding = 1) readonly buffer PositionXBlock { float position_x[]; };
layout(set = 0, binding = 2) readonly buffer PositionYBlock { float position_y[]; };
layout(set = 0, binding = 3) readonly buffer PositionZBlock { float position_z[]; };

void main() {
    uint node = uint(gl_VertexIndex);
    vec3 texel = texel_from_body(sun_view, vec3(position_x[node], position_y[node], position_z[node]));
    gl_Position = vec4(texel.xy * (2.0 / sun_view.down.w) - vec2(1.0), texel.z, 1.0);
}
