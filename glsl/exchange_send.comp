#version 450
// Infrared that leaves patches at first while it is held: emission above that of space in the middle of this time, and reflection of what comes from the planet. One
// patch an invocation. Twin: `Lead::sent` of src/exchange/lead.rs, which says why. Variant PLANET_IR: infrared of the planet.

#include "types.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { ExchangePass pass; };
layout(set = 0, binding = 0) uniform StepBlock { Step steps[1]; };
layout(set = 0, binding = 1) readonly buffer ExchangePatchesBlock { ExchangePatch patches[]; };
// Nodes of the patches, each with the bits of its share of the patch.
layout(set = 0, binding = 2) readonly buffer ExchangeMembersBlock { uvec2 members[]; };
layout(set = 0, binding = 3) readonly buffer TemperatureBlock { float temperature[]; };
#ifdef PLANET_IR
layout(set = 0, binding = 4) readonly buffer ExchangeReflectedBlock { vec4 reflected[]; };
#endif
layout(set = 0, binding = 5) buffer ExchangeSentBlock { float sent[]; };
// Emission of the last finding.
layout(set = 0, binding = 6) buffer ExchangeEmittedBlock { float emitted[]; };

const float STEFAN_BOLTZMANN = 5.670374419e-8;
// Times over a time constant beyond which nothing of a change goes on.
const float FORGOTTEN = 80.0;

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
    float now = here.emissivity * STEFAN_BOLTZMANN * (fourth - steps[0].background_temperature_4);
    float infrared = now;
    if (pass.held > 0.0) {
        float squared = sqrt(fourth);
        float times = min(pass.held * here.cooling * (squared * sqrt(squared)), FORGOTTEN);
        infrared += 0.5 * min(1.0 / (exp(times) - 1.0), 1.0) * (now - emitted[own]);
    }
    emitted[own] = now;
#ifdef PLANET_IR
    infrared += reflected[own].x;
#endif
    sent[own] = infrared;
}
