// Heat exchange between network nodes. A temperature is a base, a multiple of 1/256 K, plus a small rest. Twins, with
// the Stefan-Boltzmann constant: `radiated` and `radiative_slope` of src/thermal/network.rs.

// Ta - Tb [K]. The difference of the bases is exact, so opposite heat flows cancel to the last bit.
float temperature_difference(float base_a, float rest_a, float base_b, float rest_b) {
    return (base_a - base_b) + (rest_a - rest_b);
}

// Ta^4 - Tb^4 [K4] from two temperatures and their difference.
float radiated(float difference, float a, float b) {
    return difference * (a + b) * (a * a + b * b);
}

// d(T^4)/dT [K3].
float radiative_slope(float temperature) {
    return 4.0 * temperature * temperature * temperature;
}

// Moves whole multiples of 1/256 K from the rest to the base, without rounding.
vec2 rebase(float base, float rest) {
    float steps = round(rest * 256.0);
    return vec2(base + steps * (1.0 / 256.0), rest - steps * (1.0 / 256.0));
}

// Error estimate minus the rounding error of sums with terms of a given size. The rate of a fast node is a small
// difference of large heats, and shorter sub-steps do not reduce its rounding.
float beyond_rounding(float error, float size) {
    float rounding = 2.4e-7 * size;
    return abs(error) <= rounding ? 0.0 : abs(error) - rounding;
}

// Bits of |error|. They have the same order as the errors, with infinity and NaN last.
uint error_bits(float error) {
    return floatBitsToUint(error) & 0x7fffffffu;
}

// Bits of infinity if the temperature is outside the range of the base, 0 K to 64000 K.
uint range_bits(float temperature) {
    return floatBitsToUint(temperature) < 0x477a0000u ? 0u : 0x7f800000u;
}

// Upper bound of the temperature [K] with conductance T + emission T^4 = heat, because each term alone reaches the heat
// there. `gross` is the sum of the heat's terms without sign, for the rounding of the heat.
float warmest_balance(float heat, float gross, float conductance, float emission) {
    float most = max(heat, 0.0) + 1e-6 * gross;
    float by_conduction = conductance > 0.0 ? most / conductance : 1e30;
    float by_radiation = emission > 0.0 ? sqrt(sqrt(most / emission)) : 1e30;
    return min(by_conduction, by_radiation);
}
