#version 450
// Gradient of the flux over each patch, as its neighbours tell it [W/m3]. One patch an invocation. Twin: `Slopes::gradients` of src/exchange/slopes.rs, which says why.

#include "types.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { ExchangePass pass; };
layout(set = 0, binding = 0) readonly buffer ExchangeReceivedBlock { vec2 received[]; };
// Neighbours of each patch: the place of one, and the bits of the vector by which its difference in flux counts for the gradient [1/m].
layout(set = 0, binding = 1) readonly buffer ExchangeNeighboursBlock { uvec4 neighbours[]; };
layout(set = 0, binding = 2) buffer ExchangeGradientsBlock { vec4 gradients[]; };

const uint NEIGHBOURS = uint(EXCHANGE_NEIGHBOURS);

void main() {
    uint own = pass.first + gl_GlobalInvocationID.x;
    if (own >= pass.end) {
        return;
    }
    float mean = received[own].x;
    vec3 gradient = vec3(0.0);
    for (uint k = 0u; k < NEIGHBOURS; k++) {
        uvec4 other = neighbours[NEIGHBOURS * own + k];
        gradient += uintBitsToFloat(other.yzw) * (received[other.x].x - mean);
    }
    gradients[own] = vec4(gradient, 0.0);
}
