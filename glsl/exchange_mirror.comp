#version 450
// Sunlight that others mirror onto patches: what they absorb of it [W/m2], and what they reflect beside their own. One patch an invocation.
// Twin: `Exchange::light_ahead` of src/exchange/step.rs.

#include "types.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { ExchangePass pass; };
layout(set = 0, binding = 0) readonly buffer ExchangePatchesBlock { ExchangePatch patches[]; };
// The first pair of each patch and the one after its last, then the pairs: a patch, and the bits of the share of its light over an area.
layout(set = 0, binding = 1) readonly buffer ExchangeMirrorsBlock { uvec2 mirrors[]; };
layout(set = 0, binding = 2) readonly buffer ExchangeMirroredBlock { float mirrored[]; };
layout(set = 0, binding = 3) buffer ExchangeReflectedBlock { vec4 reflected[]; };
layout(set = 0, binding = 4) buffer ExchangeSunlightBlock { float sunlight[]; };

void main() {
    uint own = pass.first + gl_GlobalInvocationID.x;
    if (own >= pass.end) {
        return;
    }
    uvec2 run = mirrors[own];
    float arrives = 0.0;
    for (uint k = run.x; k < run.y; k++) {
        uvec2 pair = mirrors[k];
        arrives += uintBitsToFloat(pair.y) * mirrored[pair.x];
    }
    float takes = patches[own].absorptivity;
    vec4 own_light = reflected[own];
    own_light.y += (1.0 - takes) * arrives;
    reflected[own] = own_light;
    sunlight[own] = takes * arrives;
}
