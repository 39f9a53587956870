#version 450
// Radiance of planet, deep space and Sun behind the craft.

#include "types.glsl"
#include "sky.glsl"

layout(set = 0, binding = 0) uniform ViewBlock { View view; };
layout(set = 0, binding = 12) uniform SurroundingsBlock { Surroundings around; };

layout(location = 0) out vec4 radiance_temperature_depth;
layout(location = 1) out uvec2 identity;

void main() {
    vec2 ndc = 2.0 * gl_FragCoord.xy / view.size - vec2(1.0);
    vec3 ray = normalize(vec3((ndc - view.clip_offset) / view.clip_scale, 1.0));
    radiance_temperature_depth = vec4(sky_radiance(around, ray), 0.0, 0.0, 0.0);
    identity = uvec2(0u, 0u);
}
