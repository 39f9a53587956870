#version 450
// Band radiance of a pixel: emissivity of the visible face times blackbody radiance at the interpolated temperature.

#include "types.glsl"
#include "planck.glsl"
#define BAND_BINDING 8
#include "band_table.glsl"

layout(set = 0, binding = 7) readonly buffer MaterialBlock { Material materials[]; };

#ifdef MULTIPLE
// At every sample, because the centre of the texel may lie outside the triangle. naga ignores `sample` without `smooth`.
layout(location = 0) smooth sample in vec2 temperature_depth;
#else
layout(location = 0) in vec2 temperature_depth;
#endif
layout(location = 1) flat in uvec3 first_corner;

#ifdef MEAN
// Averaged over the samples.
layout(location = 0) out vec2 radiance_coverage;
#else
layout(location = 0) out vec4 radiance_temperature_depth;
layout(location = 1) out uvec2 identity;
#endif

// Perspective interpolation has an error of up to 1.3e-6 of the temperature (lavapipe), which is 3e-5 of the radiance
// at 40 K. A temperature within this error of that of the triangle's first node is replaced by it.
const float INTERPOLATION_ERROR = 2e-6;

void main() {
    uint part = first_corner.x;
    uint material = first_corner.y;
    float corner_temperature = uintBitsToFloat(first_corner.z);
    float emissivity = materials[material].emissivity;
    if (!gl_FrontFacing) {
        emissivity = materials[material].back_emissivity;
    }
    float temperature = temperature_depth.x;
    if (abs(temperature - corner_temperature) <= INTERPOLATION_ERROR * corner_temperature) {
        temperature = corner_temperature;
    }
    float radiance = emissivity * band_radiance(temperature);
#ifdef MEAN
    radiance_coverage = vec2(radiance, 1.0);
#else
    radiance_temperature_depth = vec4(radiance, temperature, temperature_depth.y, 1.0);
    // 0 is the background.
    identity = uvec2(part + 1u, material + 1u);
#endif
}
