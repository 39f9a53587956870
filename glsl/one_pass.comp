#version 450
// The step of a thermal network in one pass, four nodes an invocation. The barriers are in src/gpu/one_pass/frame.rs, the
// f64 twin is src/thermal/network/one_pass.rs. Variants: ADVANCE or none: nodes outside blocks take the whole step.
// ALONE: so do nodes without conductors, four of a group of drawn nodes. DRIVE: what the nodes of blocks receive.
// CONDUCT: conduction inside the blocks. TRIAL: the step is taken to learn its change, and the temperatures stay. SHOWN:
// the drawn nodes take the temperatures. RADIATIVE: nodes radiate to each other. FAST: the local step takes the closed form.
// MASKED: some sources are no drawn nodes. BALANCE: nodes without capacity take the temperatures of their balance.
// The host reads the estimated errors.

#include "network_types.glsl"
#include "network.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { NetworkStep pass; };
// For each group: base and rest [K] of the mean temperatures of the step, T plus half of the last change. T has the same
// base. A second view of this memory has one node an element.
#ifdef BALANCE
layout(set = 0, binding = 4) buffer MeanBlock { vec4 means[]; };
#endif
#ifndef BALANCE
layout(set = 0, binding = 4) readonly buffer MeanBlock { vec4 means[]; };
#endif
#ifndef CONDUCT
// For each group: 1 / C, then the emission [W/K4].
layout(set = 0, binding = 0) readonly buffer NodeBlock { vec4 nodes[]; };
#ifndef ALONE
// Links: the neighbours of four nodes, then the bits of their conductances [W/K], then with RADIATIVE those of the
// radiative conductances [W/K4].
layout(set = 0, binding = 2) readonly buffer LinkBlock { uvec4 links[]; };
layout(set = 0, binding = 5) readonly buffer GatheredBlock { vec2 gathered[]; };
#endif
#endif
#ifdef CONDUCT
#define DIVIDED
#endif
#ifdef DRIVE
#define DIVIDED
#endif
#ifdef ADVANCE
#define WHOLE
#endif
#ifndef TRIAL
#ifdef DIVIDED
#define ESTIMATED
// For each group: the error before it spreads inside its block [K], and the error of this step [K].
#ifdef DRIVE
layout(set = 0, binding = 14) buffer ErrorBlock { vec4 errors[]; };
#endif
#ifdef CONDUCT
layout(set = 0, binding = 14) readonly buffer ErrorBlock { vec4 errors[]; };
#endif
#endif
#ifdef WHOLE
#define ESTIMATED
#endif
#endif
#ifdef ESTIMATED
// For each group: heat by weak conductors in the last step [W], its change in that step, estimated error [K], and change of
// the coupling in that step [K].
layout(set = 0, binding = 13) buffer MemoryBlock { vec4 memory[]; };
#ifndef DRIVE
// For each group: sum of the squares of all estimated errors [K2], the largest [K], and its place.
layout(set = 0, binding = 15) buffer ToldBlock { vec4 told[]; };
#endif
#endif
// Rests of the temperatures [K].
#ifdef DRIVE
layout(set = 0, binding = 7) readonly buffer RestBlock { vec4 rests[]; };
// Change that a node of a block receives [K], and its rest at the start of the step.
layout(set = 0, binding = 8) buffer DriveBlock { vec4 drives[]; };
// Change by conduction inside the block in the last step [K].
layout(set = 0, binding = 9) readonly buffer CouplingBlock { vec4 couplings[]; };
#endif
#ifdef CONDUCT
layout(set = 0, binding = 8) readonly buffer DriveBlock { vec4 drives[]; };
layout(set = 0, binding = 9) buffer CouplingBlock { vec4 couplings[]; };
// Weights of four columns for four nodes: those of the drives, then those of the temperatures.
layout(set = 0, binding = 11) readonly buffer WeightBlock { vec4 weights[]; };
// For each group: first group of its unit of blocks, group after the last, and first weight; then the bits of the factors
// of the four nodes.
layout(set = 0, binding = 12) readonly buffer UnitBlock { uvec4 units[]; };
#endif
#ifndef DRIVE
layout(set = 0, binding = 6) buffer NextBlock { vec4 next[]; };
#ifdef CONDUCT
#ifndef TRIAL
layout(set = 0, binding = 7) buffer RestBlock { vec4 rests[]; };
#endif
#endif
#ifndef CONDUCT
#ifdef TRIAL
layout(set = 0, binding = 7) readonly buffer RestBlock { vec4 rests[]; };
#endif
#ifndef TRIAL
layout(set = 0, binding = 7) buffer RestBlock { vec4 rests[]; };
#endif
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
layout(set = 0, binding = 1) readonly buffer RowBlock { uvec4 rows[]; };
// Sources: the drawn nodes of four nodes, then the bits of the areas [m2] over which they heat them. MASKED: UNDRAWN is
// set where nothing is drawn, as for heaters, whose power [W] stands behind the drawn nodes. Otherwise a place without a
// source has area 0, and a drawn node that nobody sees.
layout(set = 0, binding = 3) readonly buffer SourceBlock { uvec4 sources[]; };
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

vec4 first_of(vec4 a, vec4 b) {
    return vec4(a.x, a.z, b.x, b.z);
}

vec4 second_of(vec4 a, vec4 b) {
    return vec4(a.y, a.w, b.y, b.w);
}

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
#ifdef MASKED
        at &= uvec4(UNDRAWN - 1u);
#endif
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
vec4 weak_heat(uint group, vec4 base, vec4 mean_rest) {
    vec4 into = vec4(0.0);
    uvec4 row = rows[group];
#ifdef RADIATIVE
    vec4 mean = base + mean_rest;
#endif
    for (uint k = row.x; k < row.y; k += WORDS) {
        uvec4 other = links[k];
        vec2 a = gathered[other.x];
        vec2 b = gathered[other.y];
        vec2 c = gathered[other.z];
        vec2 d = gathered[other.w];
        vec4 base_there = vec4(a.x, b.x, c.x, d.x);
        vec4 rest_there = vec4(a.y, b.y, c.y, d.y);
        vec4 difference = (base_there - base) + (rest_there - mean_rest);
        into += uintBitsToFloat(links[k + 1u]) * difference;
#ifdef RADIATIVE
        vec4 there = base_there + rest_there;
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

#ifdef ESTIMATED
#ifndef CONDUCT
// Error of a step [K]. `left` is the share of earlier errors that radiation leaves. Weak conduction took the last change for
// the present one, which shows in how its heat bends. Radiation took the last coupling for the present one.
vec4 estimate(uint group, vec4 weak, vec4 share, vec4 left) {
    vec4 trend = weak - memory[4u * group];
    vec4 bend = trend - memory[4u * group + 1u];
    memory[4u * group] = weak;
    memory[4u * group + 1u] = trend;
    vec4 error = pass.age < 2u ? vec4(0.0) : 0.5 * share * bend;
#ifdef DRIVE
    error -= 0.5 * (1.0 - left) * memory[4u * group + 3u];
#endif
    return error;
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
    told[group] = vec4(before.x + dot(error, error), largest, 0.0);
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
#ifndef MASKED
        temperature[at.x] = reached.x;
        temperature[at.y] = reached.y;
        temperature[at.z] = reached.z;
        temperature[at.w] = reached.w;
#endif
#ifdef MASKED
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
#endif
    }
#endif
}
#endif

#ifndef DRIVE
#ifndef BALANCE
// Ends the step of a group.
void finish(uint group, vec4 base, vec4 rest, vec4 change) {
#ifdef TRIAL
    vec4 mean = rest + 0.5 * change;
    next[2u * group] = vec4(base.x, mean.x, base.y, mean.y);
    next[2u * group + 1u] = vec4(base.z, mean.z, base.w, mean.w);
#endif
#ifndef TRIAL
    vec4 moved = rest + change;
    vec2 x = rebase(base.x, moved.x);
    vec2 y = rebase(base.y, moved.y);
    vec2 z = rebase(base.z, moved.z);
    vec2 w = rebase(base.w, moved.w);
    rests[group] = vec4(x.y, y.y, z.y, w.y);
    next[2u * group] = vec4(x.x, x.y + 0.5 * change.x, y.x, y.y + 0.5 * change.y);
    next[2u * group + 1u] = vec4(z.x, z.y + 0.5 * change.z, w.x, w.y + 0.5 * change.w);
#ifdef SHOWN
    show(group, vec4(x.x + x.y, y.x + y.y, z.x + z.y, w.x + w.y));
#endif
#endif
}
#endif
#endif

void main() {
    uint group = pass.first + gl_GlobalInvocationID.x;
    if (group >= pass.end) {
        return;
    }
    vec4 a = means[2u * group];
    vec4 b = means[2u * group + 1u];
    vec4 base = first_of(a, b);
#ifdef CONDUCT
    vec4 drive = drives[2u * group];
    vec4 rest = drives[2u * group + 1u];
    uvec4 unit = units[2u * group];
    vec4 factor = uintBitsToFloat(units[2u * group + 1u]);
    vec4 sum = vec4(0.0);
#ifdef ESTIMATED
    vec4 error = errors[2u * group];
    vec4 fresh = errors[2u * group + 1u];
    vec4 spread = vec4(0.0);
#endif
    uint at = unit.z;
    for (uint other = unit.x; other < unit.y; other++) {
        vec4 driven = drives[2u * other];
        vec4 e = means[2u * other];
        vec4 f = means[2u * other + 1u];
        vec4 base_there = first_of(e, f);
        vec4 rest_there = drives[2u * other + 1u];
        vec4 w = weights[at];
        vec4 x = weights[at + 1u];
        vec4 y = weights[at + 2u];
        vec4 z = weights[at + 3u];
        sum += w * (vec4(driven.x) - drive) + x * (vec4(driven.y) - drive) + y * (vec4(driven.z) - drive)
            + z * (vec4(driven.w) - drive);
#ifdef ESTIMATED
        vec4 fresh_there = errors[2u * other + 1u];
        spread += w * (vec4(fresh_there.x) - fresh) + x * (vec4(fresh_there.y) - fresh)
            + y * (vec4(fresh_there.z) - fresh) + z * (vec4(fresh_there.w) - fresh);
#endif
        w = weights[at + 4u];
        x = weights[at + 5u];
        y = weights[at + 6u];
        z = weights[at + 7u];
        sum += w * ((vec4(base_there.x) - base) + (vec4(rest_there.x) - rest))
            + x * ((vec4(base_there.y) - base) + (vec4(rest_there.y) - rest))
            + y * ((vec4(base_there.z) - base) + (vec4(rest_there.z) - rest))
            + z * ((vec4(base_there.w) - base) + (vec4(rest_there.w) - rest));
#ifdef ESTIMATED
        vec4 error_there = errors[2u * other];
        spread += w * (vec4(error_there.x) - error) + x * (vec4(error_there.y) - error)
            + y * (vec4(error_there.z) - error) + z * (vec4(error_there.w) - error);
#endif
        at += 8u;
    }
    vec4 coupling = factor * sum;
#ifdef ESTIMATED
    memory[4u * group + 3u] = coupling - couplings[group];
    tell(group, error + fresh + factor * spread);
#endif
    couplings[group] = coupling;
    finish(group, base, rest, drive + coupling);
#endif
#ifndef CONDUCT
    vec4 rest = rests[group];
    vec4 here = base + rest;
    vec4 emission = nodes[2u * group + 1u];
    vec4 squared = here * here;
    vec4 into = source_heat(group);
#ifndef ALONE
    vec4 weak = weak_heat(group, base, second_of(a, b));
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
    vec4 moved = rest + balancing_change(into, conductance, all_emission, here);
    vec2 x = rebase(base.x, moved.x);
    vec2 y = rebase(base.y, moved.y);
    vec2 z = rebase(base.z, moved.z);
    vec2 w = rebase(base.w, moved.w);
    rests[group] = vec4(x.y, y.y, z.y, w.y);
    means[2u * group] = vec4(x, y);
    means[2u * group + 1u] = vec4(z, w);
    next[2u * group] = vec4(x, y);
    next[2u * group + 1u] = vec4(z, w);
#ifdef SHOWN
    show(group, vec4(x.x + x.y, y.x + y.y, z.x + z.y, w.x + w.y));
#endif
#endif
#ifndef BALANCE
    vec4 share = pass.step * nodes[2u * group];
    vec4 start = share * into;
#ifdef ESTIMATED
    vec4 left = exp(-4.0 * share * emission * here * squared);
    vec4 error = estimate(group, weak, share, left);
#endif
#ifdef DRIVE
    vec4 coupling = couplings[group];
    drives[2u * group] = local_change(here, start + coupling, share * emission) - coupling;
    drives[2u * group + 1u] = rest;
#ifdef ESTIMATED
    errors[2u * group] = left * memory[4u * group + 2u];
    errors[2u * group + 1u] = error;
#endif
#endif
#ifndef DRIVE
#ifdef ESTIMATED
    tell(group, left * memory[4u * group + 2u] + error);
#endif
    finish(group, base, rest, local_change(here, start, share * emission));
#endif
#endif
#endif
}
