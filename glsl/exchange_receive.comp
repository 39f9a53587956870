#version 450
// Flux from all patches that patches absorb [W/m2], and the share of each patch that sunlight can reach, one patch an invocation. Twin: `Exchange::absorbed` of src/exchange/step.rs.
// Variants: REFLECTED: sunlight that patches reflect at first. MIRRORS: beside the sunlight that others mirror. None: infrared. SUN: infrared, and sunlight that was found before.

#include "types.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { ExchangePass pass; };
layout(set = 0, binding = 0) readonly buffer ExchangePatchesBlock { ExchangePatch patches[]; };
// Rows in fours: the upper half of an exchange area [m2] as f32, and below it the patch.
layout(set = 0, binding = 1) readonly buffer ExchangeEntriesBlock { uvec4 entries[]; };
#ifdef REFLECTED
layout(set = 0, binding = 2) readonly buffer ExchangeReflectedBlock { vec4 reflected[]; };
layout(set = 0, binding = 3) buffer ExchangeSunlightBlock { float sunlight[]; };
#endif
#ifndef REFLECTED
layout(set = 0, binding = 2) readonly buffer ExchangeSentBlock { float sent[]; };
layout(set = 0, binding = 3) buffer ExchangeReceivedBlock { vec2 received[]; };
#ifdef SUN
layout(set = 0, binding = 4) readonly buffer ExchangeSunlightBlock { float sunlight[]; };
#endif
#endif
// Rows of the patches in slot 0, then in slot 1.
layout(set = 0, binding = 5) readonly buffer ExchangeRowsBlock { ExchangeRow rows[]; };

float from_patch(uint own) {
#ifdef REFLECTED
    return reflected[own].y;
#endif
#ifndef REFLECTED
    return sent[own];
#endif
}

// Light that arrives at a patch by a row [W].
float arrives_by(ExchangeRow row, uint own) {
#ifdef REFLECTED
    uint first = row.first_reflected;
    uint end = row.end_reflected;
    float itself = row.itself_reflected;
#endif
#ifndef REFLECTED
    uint first = row.first_entry;
    uint end = row.end_entry;
    float itself = row.itself;
#endif
    vec4 arrives = vec4(0.0);
    for (uint k = first; k < end; k++) {
        uvec4 at = entries[k];
        uvec4 of = at & uvec4(0xffffu);
        arrives += uintBitsToFloat(at & uvec4(0xffff0000u)) * vec4(from_patch(of.x), from_patch(of.y), from_patch(of.z), from_patch(of.w));
    }
    return itself * from_patch(own) + ((arrives.x + arrives.y) + (arrives.z + arrives.w));
}

void main() {
    uint own = pass.first + gl_GlobalInvocationID.x;
    if (own >= pass.end) {
        return;
    }
    ExchangePatch here = patches[own];
    // Joints may rest in a finding, and craft without joints have the first alone.
    float all = 0.0;
    float exposed = 0.0;
    if (pass.share < 1.0) {
        ExchangeRow row = rows[pass.slot * pass.patches + own];
        all += (1.0 - pass.share) * arrives_by(row, own);
        exposed += (1.0 - pass.share) * row.exposed;
    }
    if (pass.share > 0.0) {
        ExchangeRow row = rows[(1u - pass.slot) * pass.patches + own];
        all += pass.share * arrives_by(row, own);
        exposed += pass.share * row.exposed;
    }
#ifdef REFLECTED
    float absorbed = here.absorptivity * all * here.per_area;
#ifdef MIRRORS
    absorbed += sunlight[own];
#endif
    sunlight[own] = absorbed;
#endif
#ifndef REFLECTED
    float absorbed = here.emissivity * all * here.per_area;
#ifdef SUN
    absorbed += sunlight[own];
#endif
    received[own] = vec2(absorbed, exposed);
#endif
}
