#version 450
// Band radiance of a blackbody at many temperatures: the command `isotherm radiance`.

#include "planck.glsl"
#define BAND_BINDING 0
#include "band_table.glsl"

layout(local_size_x = 64) in;

struct Band {
    float band_exponent;
    uint count;
};

layout(set = 0, binding = 1) readonly buffer BandBlock { Band band; };
layout(set = 0, binding = 2) readonly buffer TemperatureBlock { float temperature[]; };
layout(set = 0, binding = 3) buffer RadianceBlock { float radiance[]; };

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= band.count) {
        return;
    }
    radiance[at] = band_radiance(temperature[at], band.band_exponent);
}
