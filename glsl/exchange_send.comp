#version 450
// Infrared that leaves patches at first: emission above that of space, and reflection of what comes from the planet. One patch an
// invocation. Twin: `Exchange::sent` of src/exchange/step.rs. Variant PLANET_IR: infrared of the planet.

#include "types.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { ExchangePass pass; };
layout(set = 0, binding = 0) uniform StepBlock { Step steps[1]; };
layout(set = 0, binding = 1) readonly buffer ExchangePatchesBlock { ExchangePatch patches[]; };
// Nodes of the patches, each with the bits of its share of the patch.
layout(set = 0, binding = 2) readonly buffer ExchangeMembersBlock { uvec2 members[]; };
layout(set = 0, binding = 3) readonly buffer TemperatureBlock { float temperature[]; };
#ifdef PLANET_IR
layout(set = 0, binding = 4) readonly buffer ExchangeReflectedBlock { vec2 reflected[]; };
#endif
layout(set = 0, binding = 5) buffer ExchangeSentBlock { float sent[]; };

const float STEFAN_BOLTZMANN = 5.670374419e-8;

void main() {
    uint own = pass.first + gl_GlobalInvocationID.x;
    if (own >= pass.end) {
        return;
    }
    ExchangePatch here = patches[own];
    float fourth = 0.0;
    for (uint k = here.first_node; k < here.end_node; k++) {
        uvec2 member = members[k];
        float squared = temperature[member.x] * temperature[member.x];
        fourth += uintBitsToFloat(member.y) * (squared * squared);
    }
    float infrared = here.emissivity * STEFAN_BOLTZMANN * (fourth - steps[0].background_temperature_4);
#ifdef PLANET_IR
    infrared += reflected[own].x;
#endif
    sent[own] = infrared;
}
