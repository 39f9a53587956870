// Heat between the nodes of a network, whose temperatures are a base, a multiple of 1/256 K, and a small rest.
// Twins: `radiated` and `radiative_slope` of src/thermal/network.rs, there with the Stefan-Boltzmann constant.

// Ta - Tb [K]: the bases' difference is exact, so that what flows one way flows back the other way to the last bit.
float temperature_difference(float base_a, float rest_a, float base_b, float rest_b) {
    return (base_a - base_b) + (rest_a - rest_b);
}

// Ta^4 - Tb^4 [K4] of two temperatures and their difference.
float radiated(float difference, float a, float b) {
    return difference * (a + b) * (a * a + b * b);
}

// d(T^4)/dT [K3].
float radiative_slope(float temperature) {
    return 4.0 * temperature * temperature * temperature;
}

// Moves whole 256ths of a kelvin from the rest to the base: exact, as both hold them.
vec2 rebase(float base, float rest) {
    float steps = round(rest * 256.0);
    return vec2(base + steps * (1.0 / 256.0), rest - steps * (1.0 / 256.0));
}

// What of an estimate is beyond the rounding of sums of terms of a size. The rates of fast nodes are small differences of
// large heats, whose rounding no shorter sub-step takes away.
float beyond_rounding(float error, float size) {
    float rounding = 2.4e-7 * size;
    return abs(error) <= rounding ? 0.0 : abs(error) - rounding;
}

// Bits of |error|: their order is that of the errors, and infinity and NaN come last.
uint error_bits(float error) {
    return floatBitsToUint(error) & 0x7fffffffu;
}

// Bits of infinity where the temperature is not from 0 K to below 64000 K, the range of the base.
uint range_bits(float temperature) {
    return floatBitsToUint(temperature) < 0x477a0000u ? 0u : 0x7f800000u;
}

// No lower than the temperature [K] at which conductance T + emission T^4 = heat: either term alone would need at least that
// much. `gross` is the sum of what made up the heat, whose rounding may have taken some of it.
float warmest_balance(float heat, float gross, float conductance, float emission) {
    float most = max(heat, 0.0) + 1e-6 * gross;
    float by_conduction = conductance > 0.0 ? most / conductance : 1e30;
    float by_radiation = emission > 0.0 ? sqrt(sqrt(most / emission)) : 1e30;
    return min(by_conduction, by_radiation);
}

// The change d [K] of temperature at which into - conductance d - emission ((T + d)^4 - T^4) = 0, by Newton's method, which
// from above comes down without overshooting: a start that is too cold is taken to `warmest_balance` at most. Summed as
// changes, for a temperature would round the result to 3e-5 K.
float balancing_change(float into, float conductance, float emission, float temperature) {
    float radiating = emission * temperature * temperature * temperature * temperature;
    float warm = conductance * temperature + radiating;
    float most = warmest_balance(into + warm, abs(into) + warm, conductance, emission) - temperature;
    float change = min(0.0, most);
    for (int i = 0; i < 12; i++) {
        float next = temperature + change;
        float left = into - conductance * change - emission * radiated(change, next, temperature);
        // At 0 K a node that only radiates has no slope.
        float slope = max(conductance + emission * radiative_slope(next), 1e-30);
        change = min(change + max(left / slope, -0.75 * next), most);
    }
    return change;
}
