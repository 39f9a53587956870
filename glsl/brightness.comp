#version 450
// Brightness temperature, for a list of band radiances.

#include "types.glsl"
#include "planck.glsl"
#define BAND_BINDING 0
#include "band_table.glsl"

layout(local_size_x = 64) in;

// The table of first guesses has 1/T at every 2^20th bit pattern of the radiance, eight for each factor of two.
const uint GUESS_SHIFT = 20u;
const uint NEWTON_STEPS = 2u;

layout(set = 0, binding = 1) readonly buffer InputBlock { float radiance[]; };
layout(set = 0, binding = 2) buffer OutputBlock { float temperature[]; };
layout(set = 0, binding = 3) readonly buffer GuessBlock { float inverse_temperature[]; };

// Brightness temperature [K]. The host checks that the table covers the radiance.
float brightness_temperature(float radiance) {
    uint bits = floatBitsToUint(radiance);
    // Entry 0 is the smallest normal number, with the bit pattern 8 << GUESS_SHIFT.
    uint cell = (bits >> GUESS_SHIFT) - 8u;
    float within = float(bits & ((1u << GUESS_SHIFT) - 1u)) / float(1u << GUESS_SHIFT);
    float low = inverse_temperature[cell];
    float high = inverse_temperature[cell + 1u];
    float t = 1.0 / (low + (high - low) * within);
    for (uint i = 0u; i < NEWTON_STEPS; i++) {
        ScaledRadiance found = scaled_radiance(t);
        float excess = ln_ratio(scale_by_power(radiance, found.exponent), found.significand);
        float v = t / (t + MIDDLE_TEMPERATURE);
        float steepness = t + band.edge_high + MIDDLE_TEMPERATURE * v * v * found.slope;
        t = t / (1.0 - t * excess / steepness);
    }
    return t;
}

void main() {
    uint at = gl_GlobalInvocationID.x;
    temperature[at] = brightness_temperature(radiance[at]);
}
