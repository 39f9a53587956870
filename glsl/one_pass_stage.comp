#version 450
// Conduction inside the large blocks of a thermal network, four nodes an invocation. What nodes change in a step is a polynomial of the rates of their
// conductors, P(X) (D - X T). Each stage takes one more power of X, from the neighbours of a node. The barriers are in
// src/gpu/effects/network.rs, the f64 twin is src/thermal/network/one_pass/series.rs. Variants: BEGIN: the first vector, D - X T.
// ESTIMATE: the estimated errors spread as temperatures do.

#include "network_types.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { NetworkStage pass; };
// For each group: 1 / C, then the emission [W/K4].
layout(set = 0, binding = 0) readonly buffer OnePassNodesBlock { vec4 nodes[]; };
// Links: the neighbours of four nodes, then the bits of their conductances [W/K].
layout(set = 0, binding = 2) readonly buffer OnePassLinksBlock { uvec4 links[]; };
// For each group: first word of its links inside the block, and the one after the last; then four words that are not read.
layout(set = 0, binding = 12) readonly buffer OnePassUnitsBlock { uvec4 units[]; };
// Sum of the vectors by their parts: for each group the change [K], then the spread error [K].
layout(set = 0, binding = 3) buffer OnePassSumsBlock { vec4 sums[]; };
#ifdef BEGIN
// For each group: D, then T [K]. A second view of this memory has one node an element.
layout(set = 0, binding = 8) readonly buffer OnePassDrivesBlock { vec4 drives[]; };
layout(set = 0, binding = 5) readonly buffer StartBlock { float starts[]; };
#ifdef ESTIMATE
// For each group: the error before it spreads, and the error of the steps since the last estimate [K]. Two views.
layout(set = 0, binding = 14) readonly buffer OnePassErrorsBlock { vec4 errors[]; };
layout(set = 0, binding = 6) readonly buffer SpreadBlock { float spreads[]; };
#endif
#endif
#ifndef BEGIN
// The vectors before, in two views.
layout(set = 0, binding = 8) readonly buffer BeforeBlock { vec4 before[]; };
layout(set = 0, binding = 5) readonly buffer GatheredBlock { float gathered[]; };
#endif
// The vectors of this stage, in the order of the sums. They replace the second ones before.
layout(set = 0, binding = 4) buffer VectorBlock { vec4 vectors[]; };

// Place of a node's first of two numbers, where each group has two vectors.
uint place(uint node) {
    return 2u * node - (node & 3u);
}

void main() {
    uint group = gl_GlobalInvocationID.x;
    if (group >= pass.end) {
        return;
    }
    uvec4 unit = units[2u * group];
    vec4 share = pass.rate * nodes[2u * group];
    vec4 lost = vec4(0.0);
#ifdef BEGIN
    vec4 here = drives[2u * group + 1u];
#endif
#ifndef BEGIN
    vec4 here = before[2u * group];
#endif
#ifdef ESTIMATE
    vec4 lost_error = vec4(0.0);
#ifdef BEGIN
    vec4 error = errors[2u * group];
#endif
#ifndef BEGIN
    vec4 error = before[2u * group + 1u];
#endif
#endif
    for (uint k = unit.x; k < unit.y; k += 2u) {
        uvec4 other = links[k];
        vec4 conductance = uintBitsToFloat(links[k + 1u]);
        uvec4 at = uvec4(place(other.x), place(other.y), place(other.z), place(other.w));
#ifdef BEGIN
        vec4 there = vec4(starts[at.x + 4u], starts[at.y + 4u], starts[at.z + 4u], starts[at.w + 4u]);
#endif
#ifndef BEGIN
        vec4 there = vec4(gathered[at.x], gathered[at.y], gathered[at.z], gathered[at.w]);
#endif
        lost += conductance * (here - there);
#ifdef ESTIMATE
#ifdef BEGIN
        vec4 error_there = vec4(spreads[at.x], spreads[at.y], spreads[at.z], spreads[at.w]);
#endif
#ifndef BEGIN
        vec4 error_there = vec4(gathered[at.x + 4u], gathered[at.y + 4u], gathered[at.z + 4u], gathered[at.w + 4u]);
#endif
        lost_error += conductance * (error - error_there);
#endif
    }
#ifdef BEGIN
    vec4 vector = drives[2u * group] - share * lost;
    vectors[2u * group] = vector;
    sums[2u * group] = pass.part * vector;
#ifdef ESTIMATE
    vector = errors[2u * group + 1u] - share * lost_error;
    vectors[2u * group + 1u] = vector;
    sums[2u * group + 1u] = pass.part * vector;
#endif
#endif
#ifndef BEGIN
    // Nothing was written yet where the factor of the second vector before is 0.
    bvec4 has = bvec4(pass.older != 0.0);
    vec4 older = mix(vec4(0.0), vectors[2u * group], has);
    vec4 vector = share * lost + pass.here * here + pass.older * older;
    vectors[2u * group] = vector;
    sums[2u * group] += pass.part * vector;
#ifdef ESTIMATE
    older = mix(vec4(0.0), vectors[2u * group + 1u], has);
    vector = share * lost_error + pass.here * error + pass.older * older;
    vectors[2u * group + 1u] = vector;
    sums[2u * group + 1u] += pass.part * vector;
#endif
#endif
}
