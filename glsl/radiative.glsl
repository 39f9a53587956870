// A plate by itself: it radiates and stores heat, for four nodes at a time. With OVER a structure lies below it. FAST: the
// outside may have any time constant. Twin: src/thermal/radiative.rs.

#include "local_step.glsl"

// A temperature and what f32 does not hold of it. Slow heating adds up in the rest.
struct Carried {
    vec4 value; // K
    vec4 rest;  // K
};

// Adds a change. What the sum loses is found from whole kelvins and their remainders, which are exact. A compiler may
// replace (a + b) - a by b, so that this form would lose the rest.
Carried carried(Carried before, vec4 change) {
    vec4 added = before.rest + change;
    vec4 value = before.value + added;
    vec4 whole = round(before.value);
    vec4 next = round(value);
    vec4 moved = (next - whole) + ((value - next) - (before.value - whole));
    return Carried(value, added - moved);
}

#ifdef OVER
// The structure below the outside, and its last change for a whole step [K].
struct Structure {
    Carried temperature;
    vec4 trend;
};

// Last place of a temperature, of which the rest has 2^18 parts [K].
vec4 rest_unit(vec4 value) {
    return uintBitsToFloat(floatBitsToUint(value) & uvec4(0x7f800000u)) * (1.0 / 2199023255552.0);
}

// Upper bits of the smallest trend that is kept, 2^-25 K: its exponent, and 6 bits of its mantissa.
const int LEAST_TREND = 6528;
// Sign of a trend, above 5 bits of its exponent and 6 of its mantissa.
const int NEGATIVE = 0x800;

// The rest is in the upper 20 bits of a word, the trend in the others.
Structure structure_of(vec4 value, ivec4 word) {
    vec4 rest = vec4(word >> uvec4(12u)) * rest_unit(value);
    ivec4 size = word & ivec4(NEGATIVE - 1);
    vec4 held = intBitsToFloat((size + ivec4(LEAST_TREND)) << uvec4(17u));
    vec4 trend = mix(vec4(0.0), held, greaterThan(size, ivec4(0)));
    bvec4 falls = notEqual(word & ivec4(NEGATIVE), ivec4(0));
    return Structure(Carried(value, rest), mix(trend, -trend, falls));
}

// The word of a structure. A trend of 128 K and more is a guess that is never needed.
ivec4 word_of(Structure structure) {
    vec4 parts = structure.temperature.rest / max(rest_unit(structure.temperature.value), vec4(1e-37));
    ivec4 rest = ivec4(round(clamp(parts, vec4(-524288.0), vec4(524287.0))));
    ivec4 bits = (floatBitsToInt(abs(structure.trend)) + ivec4(0x10000)) >> uvec4(17u);
    ivec4 size = clamp(bits - ivec4(LEAST_TREND), ivec4(0), ivec4(NEGATIVE - 1));
    ivec4 negative = mix(ivec4(0), ivec4(NEGATIVE), lessThan(structure.trend, vec4(0.0)));
    return (rest << uvec4(12u)) | negative | size;
}
#endif

#ifdef FAST
// Twin: `whole_change` of src/thermal/local_step.rs.
vec4 whole_change(vec4 here, vec4 start, vec4 power, vec4 emission) {
    vec4 squared = here * here;
    vec4 emitted = emission * squared * squared;
    bvec4 strong = greaterThan(power, emitted * (1.0 / 1296.0));

    // Free cooling, until a node is five times as hot as its balance. Where its power is strong, this is not used.
    vec4 hot = max(here, vec4(1e-3));
    vec4 steep = max(emission * hot * hot * hot, vec4(1e-30));
    vec4 near = min(hot / max(5.0 * sqrt(sqrt(power / emission)), vec4(1e-6)), vec4(1e6));
    vec4 taken = min(steep, (near * near * near - 1.0) / 3.0);
    vec4 cooled = 1.0 + 3.0 * taken;
    vec4 share = pow(cooled, vec4(-1.0 / 3.0));
    vec4 square = share * share;
    vec4 first = power / (7.0 * steep) * (cooled - square * square)
        - hot * 3.0 * taken / (cooled * (square + share + 1.0));
    vec4 left = max(1.0 - taken / steep, vec4(0.0));
    first = mix(first, vec4(0.0), strong);
    left = mix(left, vec4(1.0), strong);

    // Without power a node cools freely to the end.
    bvec4 closes = greaterThan(power * left, vec4(0.0));
    vec4 from = here + first;
    vec4 from_squared = from * from;
    vec4 from_start = mix(left * (power - emission * from_squared * from_squared), start, strong);
    vec4 rest = mix(vec4(1.0), left, closes);
    vec4 closed = closed_change(from, from_start, mix(vec4(1.0), rest * power, closes), rest * emission);
    return first + mix(vec4(0.0), closed, closes);
}
#endif

// Change of the outside [K] at a rate that begins with `start` [K]. `power` is what it receives in the step [K].
vec4 outside_change(vec4 here, vec4 start, vec4 power, vec4 emission) {
#ifdef FAST
    return whole_change(here, start, power, emission);
#endif
#ifndef FAST
    return local_part(0.5, start, emission, here, local_part(0.5, start, emission, here, vec4(0.0)));
#endif
}
