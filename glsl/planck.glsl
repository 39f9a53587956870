// Arithmetic of the band radiance from + - * / and bit masks only. A device's exp and log, or a division with an error
// of 2.5 ulp, would each cost 2e-5 of the radiance. Twin: src/thermal/radiance.rs.

const float LN2_HIGH = 0.693359375; // 355/512, so that its product with a small integer is exact
const float LN2_LOW = -2.1219444e-4;
const float LOG2_E = 1.44269504;
// Largest exponent of two factors 2^-126. Beyond it the radiance is 0 in f32.
const float MAX_EXPONENT = 252.0;

// The upper 12 bits of a number. The product of two such numbers is exact.
float high_part(float x) {
    return uintBitsToFloat(floatBitsToUint(x) & 0xfffff000u);
}

// Lagrange's cubic through values at -1, 0, 1, 2 (x) and its derivative (y), at t in [0, 1].
vec2 cubic(vec4 f, float t) {
    float c3 = (f.w - f.x) * (1.0 / 6.0) + 0.5 * (f.y - f.z);
    float c2 = 0.5 * ((f.x - f.y) + (f.z - f.y));
    float c1 = (f.z - f.y) - c2 - c3;
    return vec2(f.y + t * (c1 + t * (c2 + t * c3)), c1 + t * (2.0 * c2 + 3.0 * t * c3));
}

// e^f for |f| <= ln 2 / 2 (polynomial of Cephes expf).
float exp_reduced(float f) {
    float p = 1.9875691e-4;
    p = p * f + 1.3982e-3;
    p = p * f + 8.333452e-3;
    p = p * f + 4.1665796e-2;
    p = p * f + 1.6666665e-1;
    p = p * f + 0.5;
    return 1.0 + (f + f * f * p);
}

// ln(a / b) for a near b, from the series of 2 artanh((a - b) / (a + b)).
float ln_ratio(float a, float b) {
    float z = (a - b) / (a + b);
    float z2 = z * z;
    return 2.0 * z * (1.0 + z2 * (1.0 / 3.0 + z2 * (0.2 + z2 * (1.0 / 7.0))));
}

// 2^n for an integer n from -126 to 127.
float power_of_two(float n) {
    return uintBitsToFloat(uint(int(n) + 127) << 23u);
}

// value x 2^exponent for an integer |exponent| <= MAX_EXPONENT. Both of its two factors are normal numbers.
float scale_by_power(float value, float exponent) {
    float lower = floor(exponent * 0.5);
    return value * power_of_two(lower) * power_of_two(exponent - lower);
}
