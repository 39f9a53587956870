#version 450
// Finds the temperatures of an image between two steps.

#include "between.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) readonly buffer EarlierTemperatureBlock { vec4 earlier[]; };
layout(set = 0, binding = 1) readonly buffer TemperatureBlock { vec4 temperature[]; };
layout(set = 0, binding = 2) buffer BetweenTemperatureBlock { vec4 interpolated[]; };

// Share of the step that has passed at the image's time.
layout(push_constant) uniform ShareBlock { float share; };

void main() {
    uint group = gl_GlobalInvocationID.x;
    interpolated[group] = between(earlier[group], temperature[group], share);
}
