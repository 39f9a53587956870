// Brightness temperature of a band radiance. The including shader defines the binding of its table as GUESS_BINDING, and includes band_table.glsl
// before. Twin: src/thermal/brightness.rs.

// The table of first guesses has 1/T at every 2^20th bit pattern of the radiance, eight for each factor of two.
const uint GUESS_SHIFT = 20u;
const uint NEWTON_STEPS = 2u;

layout(set = 0, binding = GUESS_BINDING) readonly buffer SensorGuessesBlock { float inverse_temperature[]; };

// Brightness temperature [K]. The table must cover the radiance.
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
