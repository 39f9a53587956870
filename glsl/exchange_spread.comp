#version 450
// Flux from other surfaces that the faces of nodes absorb [W/m2]: a plane through the flux of each patch and of the patches around it. One patch an invocation.
// Twins: `Slopes::used` and `Slopes::differences` of src/exchange/slopes.rs, which says why.

#include "types.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { ExchangePass pass; };
layout(set = 0, binding = 0) readonly buffer ExchangePatchesBlock { ExchangePatch patches[]; };
layout(set = 0, binding = 1) readonly buffer ExchangeReceivedBlock { vec2 received[]; };
// Neighbours of each patch, as in exchange_gradient.comp. One that is missing counts for nothing.
layout(set = 0, binding = 2) readonly buffer ExchangeNeighboursBlock { uvec4 neighbours[]; };
layout(set = 0, binding = 3) readonly buffer ExchangeGradientsBlock { vec4 gradients[]; };
// Nodes of the patches: the bits of the way of each from the centre of its patch [m], and its number.
layout(set = 0, binding = 4) readonly buffer ExchangeWaysBlock { uvec4 ways[]; };
// Fronts of four nodes, then their backs.
layout(set = 0, binding = 5) buffer ExchangeOnNodesBlock { float on_nodes[]; };

const uint NEIGHBOURS = uint(EXCHANGE_NEIGHBOURS);

void main() {
    uint own = pass.first + gl_GlobalInvocationID.x;
    if (own >= pass.end) {
        return;
    }
    ExchangePatch here = patches[own];
    float mean = received[own].x;
    vec3 gradient = gradients[own].xyz;
    float square = dot(gradient, gradient);
    if (square > 0.0) {
        vec2 sums = vec2(0.0);
        for (uint k = 0u; k < NEIGHBOURS; k++) {
            uvec4 other = neighbours[NEIGHBOURS * own + k];
            float counts = length(uintBitsToFloat(other.yzw));
            sums += counts * vec2(1.0, clamp(dot(gradients[other.x].xyz, gradient) / square, 0.0, 1.0));
        }
        gradient *= max(2.0 * sums.y / sums.x - 1.0, 0.0);
    }
    // No flux changes its sign.
    float most = length(gradient) * here.radius;
    if (most > abs(mean)) {
        gradient *= abs(mean) / most;
    }
    for (uint k = here.first_node; k < here.end_node; k++) {
        uvec4 way = ways[k];
        on_nodes[8u * (way.w / 4u) + 4u * here.back + way.w % 4u] = mean + dot(gradient, uintBitsToFloat(way.xyz));
    }
}
