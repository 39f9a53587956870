// Blackbody radiance in a band from a table of ln(L e^x / T) over v = T / (T + 400), x = c2 / (longest wavelength x T)
// (NUMERICS.md 5). Twin: src/thermal/radiance.rs.

// Intervals of the table; one guard value before the first and one after the last.
const float BAND_INTERVALS = 1024.0;
const float BAND_SCALE = 400.0; // K

// Lagrange weights of the values at -1, 0, 1, 2 for a position t in [0, 1].
vec4 cubic_weights(float t) {
    float a = t + 1.0;
    float b = t - 1.0;
    float c = t - 2.0;
    return vec4(-t * b * c / 6.0, a * b * c / 2.0, -a * t * c / 2.0, a * t * b / 6.0);
}

// The upper half of the significand; products of two such halves are exact.
float upper_half(float x) {
    return uintBitsToFloat(floatBitsToUint(x) & 0xfffff000u);
}

// What the rounded quotient q of n / d leaves, as a correction of q: n / d = q + quotient_residual(n, d, q).
// The masks keep a compiler from simplifying the differences away.
float quotient_residual(float n, float d, float q) {
    float d_upper = upper_half(d);
    float d_lower = upper_half(d - d_upper);
    float q_upper = upper_half(q);
    float q_lower = upper_half(q - q_upper);
    float rest = n - q_upper * d_upper;
    rest -= q_upper * d_lower;
    rest -= q_lower * d_upper;
    rest -= q_lower * d_lower;
    return rest / d;
}

// e^(a + b) where a + b may be far below the exponent range of its factors; |b| is small.
float exponential(float a, float b) {
    float n = floor((a + b) * 1.44269504 + 0.5);
    // ln 2 in two parts, the first with trailing zeros so that n times it is exact.
    float r = (a - n * 0.693359375) + n * 2.12194440e-4 + b;
    float p = 1.0 + r * (1.0 + r * (0.5 + r * (1.6666667e-1 + r * (4.1666667e-2 + r * (8.3333333e-3 + r * 1.3888889e-3)))));
    // Two factors, as 2^n alone may be below the smallest normal number.
    int half_n = int(n) / 2;
    float first = uintBitsToFloat(uint(half_n + 127) << 23u);
    float second = uintBitsToFloat(uint(int(n) - half_n + 127) << 23u);
    return p * first * second;
}

// Natural logarithm with a small relative error everywhere (a device's log may be off by 13 % near 1).
float logarithm(float x) {
    uint bits = floatBitsToUint(x);
    // Significand in [0.707, 1.414).
    int e = int((bits - 0x3f3504f3u) >> 23u);
    if (bits < 0x3f3504f3u) {
        e = -int((0x3f3504f3u - bits + 0x7fffffu) >> 23u);
    }
    float m = uintBitsToFloat(bits - uint(e << 23));
    float s = (m - 1.0) / (m + 1.0);
    float s2 = s * s;
    float series = 2.0 * s * (1.0 + s2 * (3.3333333e-1 + s2 * (0.2 + s2 * (1.4285714e-1 + s2 * 1.1111111e-1))));
    return float(e) * 0.693359375 + (series - float(e) * 2.12194440e-4);
}
