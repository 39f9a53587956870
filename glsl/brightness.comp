#version 450
// Brightness temperature, for a list of band radiances.

#include "types.glsl"
#include "planck.glsl"
#define BAND_BINDING 0
#include "band_table.glsl"
#define GUESS_BINDING 3
#include "brightness.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 1) readonly buffer RadiationInputBlock { float radiance[]; };
layout(set = 0, binding = 2) buffer RadiationOutputBlock { float temperature[]; };

void main() {
    uint at = gl_GlobalInvocationID.x;
    // The host checks that the table covers the radiance.
    temperature[at] = brightness_temperature(radiance[at]);
}
