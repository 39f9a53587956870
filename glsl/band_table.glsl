// Reads the band's table, which the including entry point binds at BAND_BINDING. Twin: src/thermal/radiance.rs.

layout(set = 0, binding = BAND_BINDING) readonly buffer BandTableBlock { float band_table[]; };

// Blackbody radiance in the band [W m-2 sr-1] at a temperature [K]; band_exponent is c2 / longest wavelength [K].
float band_radiance(float temperature, float band_exponent) {
    if (temperature <= 0.0) {
        return 0.0;
    }
    float x = band_exponent / temperature;
    // Below this the radiance is far from any normal number, and 2^n would leave the range of an exponent.
    if (x > 160.0) {
        return 0.0;
    }
    float v = temperature / (temperature + BAND_SCALE) * BAND_INTERVALS;
    float cell = min(floor(v), BAND_INTERVALS - 1.0);
    uint at = uint(cell);
    vec4 near = vec4(band_table[at], band_table[at + 1u], band_table[at + 2u], band_table[at + 3u]);
    float logarithm_over_t = dot(cubic_weights(v - cell), near);
    return temperature * exponential(-x, logarithm_over_t - quotient_residual(band_exponent, temperature, x));
}
