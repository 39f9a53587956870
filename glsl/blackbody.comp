#version 450
// Band radiance of a blackbody, for a list of temperatures.

#include "types.glsl"
#include "planck.glsl"
#define BAND_BINDING 0
#include "band_table.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 1) readonly buffer RadiationInputBlock { float temperature[]; };
layout(set = 0, binding = 2) buffer RadiationOutputBlock { float radiance[]; };

void main() {
    uint at = gl_GlobalInvocationID.x;
    radiance[at] = band_radiance(temperature[at]);
}
