// Noise by counting: each number follows from seed, counter, stream and place alone. Twin: src/thermal/sensor/noise.rs.

#include "pcg.glsl"

const uint STREAM_TIME = 0u;
const uint STREAM_OFFSET = 1u;
const uint STREAM_GAIN = 2u;
const uint STREAM_DRIFT = 3u;
const uint STREAM_BAD = 4u;

// Four random words for a group of four pixels.
uvec4 random_words(uint seed, uint low, uint high, uint stream, uint group) {
    return pcg4d(uvec4(group, low, high * 16u + stream, seed));
}

// Words as numbers between -1 and 1. Their 23 upper bits decide, so each number is exact.
vec4 symmetric(uvec4 word) {
    return (vec4(word >> uvec4(9u)) + 0.5) * (1.0 / 4194304.0) - 1.0;
}

// Natural logarithm of normal numbers, from + - * / and bits only, because a device's own may err by 2^-21.
vec4 ln_of(vec4 x) {
    uvec4 bits = floatBitsToUint(x) + uvec4(0x3f800000u - 0x3f3504f3u);
    vec4 exponent = vec4(bits >> uvec4(23u)) - 127.0;
    vec4 m = uintBitsToFloat((bits & uvec4(0x007fffffu)) + uvec4(0x3f3504f3u));
    vec4 z = (m - 1.0) / (m + 1.0);
    vec4 z2 = z * z;
    return exponent * 0.69314718 + 2.0 * z * (1.0 + z2 * (1.0 / 3.0 + z2 * (0.2 + z2 * (1.0 / 7.0 + z2 * (1.0 / 9.0)))));
}

// Words as numbers of the normal distribution (Giles 2011).
vec4 normal(uvec4 word) {
    vec4 x = symmetric(word);
    vec4 w = -ln_of((1.0 - x) * (1.0 + x));
    vec4 a = w - 2.5;
    vec4 central = vec4(2.81022636e-8);
    central = central * a + 3.43273939e-7;
    central = central * a - 3.5233877e-6;
    central = central * a - 4.39150654e-6;
    central = central * a + 0.00021858087;
    central = central * a - 0.00125372503;
    central = central * a - 0.00417768164;
    central = central * a + 0.246640727;
    central = central * a + 1.50140941;
    vec4 b = sqrt(w) - 3.0;
    vec4 tail = vec4(-0.000200214257);
    tail = tail * b + 0.000100950558;
    tail = tail * b + 0.00134934322;
    tail = tail * b - 0.00367342844;
    tail = tail * b + 0.00573950773;
    tail = tail * b - 0.0076224613;
    tail = tail * b + 0.00943887047;
    tail = tail * b + 1.00167406;
    tail = tail * b + 2.83297682;
    return 1.41421356 * x * mix(central, tail, step(vec4(5.0), w));
}
