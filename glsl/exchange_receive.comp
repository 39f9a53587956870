#version 450
// Flux from all patches that patches absorb [W/m2], one patch an invocation. Twin: `Exchange::absorbed` of src/exchange/step.rs.
// Variant SUN: sunlight beside infrared.

#include "types.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { ExchangePass pass; };
layout(set = 0, binding = 0) readonly buffer ExchangePatchBlock { ExchangePatch patches[]; };
// Rows in fours: patches, then the bits of the exchange areas of infrared, then those of sunlight [m2].
layout(set = 0, binding = 1) readonly buffer ExchangeEntryBlock { uvec4 entries[]; };
layout(set = 0, binding = 2) readonly buffer ExchangeSentBlock { vec2 sent[]; };
layout(set = 0, binding = 3) buffer ExchangeReceivedBlock { float received[]; };

void main() {
    uint own = pass.first + gl_GlobalInvocationID.x;
    if (own >= pass.end) {
        return;
    }
    ExchangePatch here = patches[own];
    vec4 infrared = vec4(0.0);
#ifdef SUN
    vec4 sunlight = vec4(0.0);
#endif
    for (uint k = here.first_entry; k < here.end_entry; k++) {
        uvec4 at = entries[3u * k];
#ifdef SUN
        vec2 x = sent[at.x];
        vec2 y = sent[at.y];
        vec2 z = sent[at.z];
        vec2 w = sent[at.w];
        infrared += uintBitsToFloat(entries[3u * k + 1u]) * vec4(x.x, y.x, z.x, w.x);
        sunlight += uintBitsToFloat(entries[3u * k + 2u]) * vec4(x.y, y.y, z.y, w.y);
#endif
#ifndef SUN
        infrared += uintBitsToFloat(entries[3u * k + 1u]) * vec4(sent[at.x].x, sent[at.y].x, sent[at.z].x, sent[at.w].x);
#endif
    }
    float absorbed = here.emissivity * ((infrared.x + infrared.y) + (infrared.z + infrared.w));
#ifdef SUN
    absorbed += here.absorptivity * ((sunlight.x + sunlight.y) + (sunlight.z + sunlight.w));
#endif
    received[own] = absorbed * here.per_area;
}
