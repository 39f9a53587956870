#version 450
// The step of a thermal network in one pass, four nodes an invocation. The barriers are in src/gpu/effects/network.rs, the
// f64 twin is src/thermal/network/one_pass.rs. Variants: ADVANCE or none: nodes outside blocks take the whole step.
// ALONE: so do nodes without conductors, four of a group of drawn nodes. DRIVE: what the nodes of blocks receive.
// CONDUCT: conduction inside the blocks. LARGE: these take it from stages (one_pass_stage.comp). TRIAL: the step is taken to learn its change, and the temperatures stay. SHOWN:
// the drawn nodes take the temperatures. RADIATIVE: nodes radiate to each other. FAST: the local step takes the closed form.
// BALANCE: nodes without capacity take the temperatures of their balance.
// Steps of a sample estimate the error. NOTE: the first of two such steps. ESTIMATE: the second. The host reads the errors.

#include "network_types.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { NetworkStep pass; };
#ifndef CONDUCT
// For each group: 1 / C, then the emission [W/K4].
layout(set = 0, binding = 0) readonly buffer OnePassNodesBlock { vec4 nodes[]; };
#ifndef ALONE
// Mean temperatures of the step, T plus half of the last change [K]. A second view of this memory has one node an element.
#ifdef BALANCE
layout(set = 0, binding = 4) buffer MeansBlock { vec4 means[]; };
#endif
#ifndef BALANCE
layout(set = 0, binding = 4) readonly buffer MeansBlock { vec4 means[]; };
#endif
// Links: the neighbours of four nodes, then the bits of their conductances [W/K], then with RADIATIVE those of the
// radiative conductances [W/K4].
layout(set = 0, binding = 2) readonly buffer OnePassLinksBlock { uvec4 links[]; };
layout(set = 0, binding = 5) readonly buffer GatheredBlock { float gathered[]; };
#endif
#endif
#ifdef ESTIMATE
#define SAMPLED
// For each group: the error before it spreads inside its block [K], and the error of the steps since the last estimate [K].
#ifdef DRIVE
layout(set = 0, binding = 14) buffer OnePassErrorsBlock { vec4 errors[]; };
#endif
#ifdef CONDUCT
layout(set = 0, binding = 14) readonly buffer OnePassErrorsBlock { vec4 errors[]; };
#endif
#endif
#ifdef NOTE
#define SAMPLED
#endif
#ifdef SAMPLED
// For each group: heat by weak conductors that was noted [W], its change in a step at the last estimate, estimated error
// [K], and the coupling at the last estimate [K].
layout(set = 0, binding = 13) buffer OnePassMemoryBlock { vec4 memory[]; };
#endif
#ifdef ESTIMATE
#ifndef DRIVE
// For each group: sum of the squares of all estimated errors [K2], the largest [K], and its place.
layout(set = 0, binding = 15) buffer OnePassToldBlock { vec4 told[]; };
#endif
#endif
// For each group: bases and rests of the temperatures [K].
#ifdef DRIVE
layout(set = 0, binding = 7) readonly buffer OnePassStatesBlock { vec4 states[]; };
// Change that a node of a block receives, and its temperature at the start of the step [K].
layout(set = 0, binding = 8) buffer OnePassDrivesBlock { vec4 drives[]; };
// Change by conduction inside the block in the last step [K].
layout(set = 0, binding = 9) readonly buffer OnePassCouplingsBlock { vec4 couplings[]; };
#endif
#ifdef CONDUCT
layout(set = 0, binding = 8) readonly buffer OnePassDrivesBlock { vec4 drives[]; };
layout(set = 0, binding = 9) buffer OnePassCouplingsBlock { vec4 couplings[]; };
#ifdef LARGE
// For each group: the change of the nodes by what they received and by conduction [K], then their spread error [K].
layout(set = 0, binding = 11) readonly buffer OnePassSumsBlock { vec4 sums[]; };
#endif
#ifndef LARGE
// Weights of four columns for four nodes: those of the drives, then those of the temperatures.
layout(set = 0, binding = 11) readonly buffer OnePassWeightsBlock { vec4 weights[]; };
// For each group: first group of its unit of blocks, group after the last, and first weight; then the bits of the factors
// of the four nodes.
layout(set = 0, binding = 12) readonly buffer OnePassUnitsBlock { uvec4 units[]; };
#endif
#endif
#ifndef DRIVE
// Mean temperatures of the next step [K].
layout(set = 0, binding = 6) buffer NextBlock { vec4 next[]; };
#ifdef TRIAL
layout(set = 0, binding = 7) readonly buffer OnePassStatesBlock { vec4 states[]; };
#endif
#ifndef TRIAL
layout(set = 0, binding = 7) buffer OnePassStatesBlock { vec4 states[]; };
#endif
#endif
#ifdef SHOWN
#define DRAWN
#endif
#ifndef CONDUCT
#define DRAWN
#endif
#ifdef DRAWN
// For each group: first word of its links and the one after the last, first word of its sources and the one after the
// last. ALONE: the third is its word of areas, and the fourth its group of drawn nodes.
layout(set = 0, binding = 1) readonly buffer OnePassRowsBlock { uvec4 rows[]; };
// Sources: the drawn nodes of four nodes, then the bits of the areas [m2] over which they heat them. UNDRAWN is set where
// nothing is drawn: at heaters, whose power [W] stands behind the drawn nodes, and at places without a source, whose area
// is 0. Each drawn node is written by one node alone.
layout(set = 0, binding = 3) readonly buffer OnePassSourcesBlock { uvec4 sources[]; };
// Flux that the drawn nodes absorb [W/m2]. SHOWN: then their temperatures [K].
#ifdef ALONE
#ifdef SHOWN
layout(set = 0, binding = 10) buffer TemperatureBlock { vec4 drawn[]; };
#endif
#ifndef SHOWN
layout(set = 0, binding = 10) readonly buffer TemperatureBlock { vec4 drawn[]; };
#endif
#endif
#ifndef ALONE
#ifdef SHOWN
layout(set = 0, binding = 10) buffer TemperatureBlock { float temperature[]; };
#endif
#ifndef SHOWN
layout(set = 0, binding = 10) readonly buffer TemperatureBlock { float temperature[]; };
#endif
#endif
#endif

const uint UNDRAWN = 0x80000000u;

#ifndef CONDUCT
#include "local_step.glsl"

// Twins: `local_change` and, with FAST, `fast_change` of src/thermal/local_step.rs.
vec4 local_change(vec4 here, vec4 start, vec4 emission) {
#ifdef FAST
    vec4 squared = here * here;
    vec4 emitted = emission * squared * squared;
    vec4 power = start + emitted;
    bvec4 radiates = greaterThan(emission, vec4(0.0));
    bvec4 lasts = greaterThan(power, max(emitted * (1.0 / 1296.0), vec4(0.0)));
    bvec4 closed = bvec4(radiates.x && lasts.x, radiates.y && lasts.y, radiates.z && lasts.z, radiates.w && lasts.w);
    // Another value where the form does not hold, so that nothing overflows.
    power = mix(emitted + 1.0, power, closed);
    vec4 moved = closed_change(here, start, power, emission);
    vec4 change = vec4(0.0);
    uint count = all(closed) ? 0u : pass.count;
    float share = 1.0 / float(pass.count);
    for (uint i = 0u; i < count; i++) {
        change = local_part(share, start, emission, here, change);
    }
    return mix(change, moved, closed);
#endif
#ifndef FAST
    return local_part(0.5, start, emission, here, local_part(0.5, start, emission, here, vec4(0.0)));
#endif
}

// Heat into a group by its sources [W].
vec4 source_heat(uint group) {
    uvec4 row = rows[group];
#ifdef ALONE
    return uintBitsToFloat(sources[row.z]) * drawn[row.w];
#endif
#ifndef ALONE
    vec4 into = vec4(0.0);
    for (uint k = row.z; k < row.w; k += 2u) {
        uvec4 at = sources[k];
        vec4 area = uintBitsToFloat(sources[k + 1u]);
        at &= uvec4(UNDRAWN - 1u);
        into += area * vec4(temperature[at.x], temperature[at.y], temperature[at.z], temperature[at.w]);
    }
    return into;
#endif
}

#ifndef ALONE
#ifdef RADIATIVE
const uint WORDS = 3u;
#endif
#ifndef RADIATIVE
const uint WORDS = 2u;
#endif

// Heat into a group by weak exchange [W].
vec4 weak_heat(uint group) {
    vec4 into = vec4(0.0);
    uvec4 row = rows[group];
    vec4 mean = means[group];
    for (uint k = row.x; k < row.y; k += WORDS) {
        uvec4 other = links[k];
        vec4 there = vec4(gathered[other.x], gathered[other.y], gathered[other.z], gathered[other.w]);
        vec4 difference = there - mean;
        into += uintBitsToFloat(links[k + 1u]) * difference;
#ifdef RADIATIVE
        vec4 slope = (there + mean) * (there * there + mean * mean);
        into += uintBitsToFloat(links[k + 2u]) * difference * slope;
#endif
    }
    return into;
}
#endif
#endif

#ifdef BALANCE
// Twin: `balancing_change` of src/thermal/network/one_pass/balance.rs.
vec4 balancing_change(vec4 into, vec4 conductance, vec4 emission, vec4 here) {
    vec4 squared = here * here;
    vec4 most = max(into + conductance * here + emission * squared * squared, vec4(0.0));
    vec4 by_conduction = mix(vec4(1e30), most / max(conductance, vec4(1e-30)), greaterThan(conductance, vec4(0.0)));
    vec4 by_radiation = mix(vec4(1e30), sqrt(sqrt(most / max(emission, vec4(1e-30)))), greaterThan(emission, vec4(0.0)));
    vec4 first = min(by_conduction, by_radiation);
    // Places without a node exchange nothing.
    vec4 change = mix(first - here, vec4(0.0), greaterThan(first, vec4(1e29)));
    for (uint i = 0u; i < 12u; i++) {
        vec4 next = here + change;
        vec4 radiated = change * (next + here) * (next * next + squared);
        vec4 slope = max(conductance + 4.0 * emission * next * next * next, vec4(1e-30));
        change += max((into - conductance * change - emission * radiated) / slope, -0.75 * next);
    }
    return change;
}
#endif

#ifdef ESTIMATE
#ifndef CONDUCT
// Share that radiation leaves of equal errors of the steps since the last estimate, in the mean. It lets a share of exp(-fading)
// pass in a step. Twin: `left_in_the_mean` of src/thermal/network/one_pass/sample.rs.
vec4 left_in_the_mean(vec4 fading) {
    float steps = float(max(pass.since, 1u));
    vec4 slow = 1.0 - 0.5 * (steps - 1.0) * fading;
    vec4 lost = max(1.0 - exp(-fading), vec4(1e-4));
    return mix((1.0 - exp(-steps * fading)) / (steps * lost), slow, lessThan(fading, vec4(1e-3)));
}

// Error of the steps since the last estimate [K]. Weak conduction took the last change for the present one, which shows in how
// its heat bends. Radiation took the last coupling for the present one. Sums of both over steps need their ends only.
vec4 estimate(uint group, vec4 weak, vec4 share, vec4 fading, vec4 coupling) {
    vec4 trend = weak - memory[4u * group];
    vec4 error = 0.5 * share * (trend - memory[4u * group + 1u]);
    memory[4u * group + 1u] = trend;
#ifdef DRIVE
    error -= 0.5 * (1.0 - exp(-fading)) * (coupling - memory[4u * group + 3u]);
    memory[4u * group + 3u] = coupling;
#endif
    return float(min(pass.since, 1u)) * left_in_the_mean(fading) * error;
}
#endif
#ifndef DRIVE
// Keeps the errors of a group.
void tell(uint group, vec4 error) {
    memory[4u * group + 2u] = error;
    vec4 size = abs(error);
    float most = max(max(size.x, size.y), max(size.z, size.w));
    float place = size.x == most ? 0.0 : (size.y == most ? 1.0 : (size.z == most ? 2.0 : 3.0));
    vec4 before = told[group];
    vec2 largest = most > before.y ? vec2(most, place) : before.yz;
    told[group] = vec4(before.x + float(min(pass.since, 1u)) * dot(error, error), largest, 0.0);
}
#endif
#endif

#ifdef SHOWN
// Gives the drawn nodes of a group its temperatures.
void show(uint group, vec4 reached) {
    uvec4 row = rows[group];
#ifdef ALONE
    drawn[row.w] = reached;
#endif
#ifndef ALONE
    for (uint k = row.z; k < row.w; k += 2u) {
        uvec4 at = sources[k];
        if (at.x < UNDRAWN) {
            temperature[at.x] = reached.x;
        }
        if (at.y < UNDRAWN) {
            temperature[at.y] = reached.y;
        }
        if (at.z < UNDRAWN) {
            temperature[at.z] = reached.z;
        }
        if (at.w < UNDRAWN) {
            temperature[at.w] = reached.w;
        }
    }
#endif
}
#endif

#ifndef DRIVE
// Ends the step of a group. `ahead` is half of the last change in the mean temperature of the next step.
void finish(uint group, vec4 base, vec4 rest, vec4 change, vec4 ahead) {
#ifdef TRIAL
    next[group] = base + (rest + ahead);
#endif
#ifndef TRIAL
    vec4 moved = rest + change;
    vec4 whole = round(moved * 256.0) * (1.0 / 256.0);
    vec4 new_base = base + whole;
    vec4 new_rest = moved - whole;
    states[2u * group] = new_base;
    states[2u * group + 1u] = new_rest;
    next[group] = new_base + (new_rest + ahead);
#ifdef BALANCE
    means[group] = new_base + new_rest;
#endif
#ifdef SHOWN
    show(group, new_base + new_rest);
#endif
#endif
}
#endif

void main() {
    uint group = pass.first + gl_GlobalInvocationID.x;
    if (group >= pass.end) {
        return;
    }
    vec4 base = states[2u * group];
    vec4 rest = states[2u * group + 1u];
#ifdef CONDUCT
    vec4 drive = drives[2u * group];
#ifdef LARGE
    vec4 coupling = sums[2u * group] - drive;
#ifdef ESTIMATE
    tell(group, errors[2u * group] + sums[2u * group + 1u]);
#endif
#endif
#ifndef LARGE
    vec4 here = drives[2u * group + 1u];
    uvec4 unit = units[2u * group];
    vec4 factor = uintBitsToFloat(units[2u * group + 1u]);
    vec4 sum = vec4(0.0);
#ifdef ESTIMATE
    vec4 error = errors[2u * group];
    vec4 fresh = errors[2u * group + 1u];
    vec4 spread = vec4(0.0);
#endif
    uint at = unit.z;
    for (uint other = unit.x; other < unit.y; other++) {
        vec4 driven = drives[2u * other];
        vec4 there = drives[2u * other + 1u];
        vec4 w = weights[at];
        vec4 x = weights[at + 1u];
        vec4 y = weights[at + 2u];
        vec4 z = weights[at + 3u];
        sum += w * (vec4(driven.x) - drive) + x * (vec4(driven.y) - drive) + y * (vec4(driven.z) - drive)
            + z * (vec4(driven.w) - drive);
#ifdef ESTIMATE
        vec4 fresh_there = errors[2u * other + 1u];
        spread += w * (vec4(fresh_there.x) - fresh) + x * (vec4(fresh_there.y) - fresh)
            + y * (vec4(fresh_there.z) - fresh) + z * (vec4(fresh_there.w) - fresh);
#endif
        w = weights[at + 4u];
        x = weights[at + 5u];
        y = weights[at + 6u];
        z = weights[at + 7u];
        sum += w * (vec4(there.x) - here) + x * (vec4(there.y) - here) + y * (vec4(there.z) - here)
            + z * (vec4(there.w) - here);
#ifdef ESTIMATE
        vec4 error_there = errors[2u * other];
        spread += w * (vec4(error_there.x) - error) + x * (vec4(error_there.y) - error)
            + y * (vec4(error_there.z) - error) + z * (vec4(error_there.w) - error);
#endif
        at += 8u;
    }
    vec4 coupling = factor * sum;
#ifdef ESTIMATE
    tell(group, error + fresh + factor * spread);
#endif
#endif
    couplings[group] = coupling;
    finish(group, base, rest, drive + coupling, 0.5 * (drive + coupling));
#endif
#ifndef CONDUCT
    vec4 here = base + rest;
    vec4 emission = nodes[2u * group + 1u];
    vec4 squared = here * here;
    vec4 into = source_heat(group);
#ifndef ALONE
    vec4 weak = weak_heat(group);
    into += weak;
#endif
    into += emission * (vec4(pass.space_temperature_4) - squared * squared);
#ifdef BALANCE
    vec4 conductance = vec4(0.0);
    vec4 all_emission = emission;
    uvec4 row = rows[group];
    for (uint k = row.x; k < row.y; k += WORDS) {
        conductance += uintBitsToFloat(links[k + 1u]);
        all_emission += uintBitsToFloat(links[k + 2u]);
    }
    finish(group, base, rest, balancing_change(into, conductance, all_emission, here), vec4(0.0));
#endif
#ifndef BALANCE
    vec4 share = pass.step * nodes[2u * group];
    vec4 start = share * into;
#ifdef NOTE
    memory[4u * group] = weak;
#endif
#ifdef DRIVE
    vec4 coupling = couplings[group];
    drives[2u * group] = local_change(here, start + coupling, share * emission) - coupling;
    drives[2u * group + 1u] = here;
#endif
#ifdef ESTIMATE
    vec4 fading = 4.0 * share * emission * here * squared;
    vec4 error = exp(-float(pass.since) * fading) * memory[4u * group + 2u];
#ifdef DRIVE
    errors[2u * group] = error;
    errors[2u * group + 1u] = estimate(group, weak, share, fading, coupling);
#endif
#ifndef DRIVE
    tell(group, error + estimate(group, weak, share, fading, vec4(0.0)));
#endif
#endif
#ifndef DRIVE
    vec4 change = local_change(here, start, share * emission);
    finish(group, base, rest, change, 0.5 * change);
#endif
#endif
#endif
}
