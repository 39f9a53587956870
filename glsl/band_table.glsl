// Blackbody radiance in a band from a table (docs/numerics.md, section 5). The table has ln(L e^x / T) over v = T / (T
// + 400 K), with x = c2 / (longest wavelength x T). The including shader defines its binding as BAND_BINDING. Twin:
// src/thermal/radiance.rs and src/thermal/brightness.rs.

const float BAND_INTERVALS = 1024.0;
const float MIDDLE_TEMPERATURE = 400.0; // K, at v = 1/2
// Below this temperature [K] the radiance of every band up to 50 um is 0 in f32.
const float MIN_TEMPERATURE = 1.0;

layout(set = 0, binding = BAND_BINDING) readonly buffer BandTableBlock {
    Band band;
    float band_table[];
};

// Radiance as significand x 2^-exponent, with d ln G / dv for the inverse.
struct ScaledRadiance {
    float significand;
    float exponent;
    float slope;
};

ScaledRadiance scaled_radiance(float t) {
    float v = t / (t + MIDDLE_TEMPERATURE);
    float place = v * BAND_INTERVALS;
    float cell = min(floor(place), BAND_INTERVALS - 1.0);
    uint i = uint(cell);
    vec4 around = vec4(band_table[i], band_table[i + 1u], band_table[i + 2u], band_table[i + 3u]);
    vec2 ln_g = cubic(around, place - cell);

    // x is split as x_high + x_low. The remainder of the division by its high part is exact up to its last operation.
    float x = band.edge_high / t;
    float x_high = high_part(x);
    float t_high = high_part(t);
    float t_low = t - t_high;
    float remainder = (band.edge_high - x_high * t_high) - x_high * t_low + band.edge_low;
    float x_low = remainder / t;

    // e^(ln G - x) = e^f 2^-m with |f| <= ln 2 / 2.
    float m = min(floor((x - ln_g.x) * LOG2_E + 0.5), MAX_EXPONENT);
    float f = (m * LN2_HIGH - x_high) + ((ln_g.x - x_low) + m * LN2_LOW);
    return ScaledRadiance(t * exp_reduced(f), m, ln_g.y * BAND_INTERVALS);
}

// Radiance [W m-2 sr-1] of a blackbody at a temperature [K].
float band_radiance(float temperature) {
    ScaledRadiance scaled = scaled_radiance(max(temperature, MIN_TEMPERATURE));
    return scale_by_power(scaled.significand, -scaled.exponent);
}
