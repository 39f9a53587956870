#version 450
// The step of a thermal network in one pass, four nodes an invocation. The barriers are in src/gpu/one_pass/frame.rs, the
// f64 twin is src/thermal/network/one_pass.rs. Variants: ADVANCE or none: nodes outside blocks take the whole step.
// ALONE: so do nodes without conductors, four of a group of drawn nodes. DRIVE: what the nodes of blocks receive.
// CONDUCT: conduction inside the blocks. TRIAL: the step is taken to learn its change, and the temperatures stay. SHOWN:
// the drawn nodes take the temperatures. RADIATIVE: nodes radiate to each other. FINE: a local step has more than two
// Runge-Kutta steps. MASKED: some sources are no drawn nodes.

#include "network_types.glsl"
#include "network.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { NetworkStep pass; };
// For each group: base and rest [K] of the mean temperatures of the step, T plus half of the last change. T has the same
// base. A second view of this memory has one node an element.
layout(set = 0, binding = 4) readonly buffer MeanBlock { vec4 means[]; };
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
// Change at a rate that radiation has changed [K].
vec4 local_rate(vec4 start, vec4 emission, vec4 here, vec4 change) {
    vec4 reached = here + change;
    return start - emission * change * (reached + here) * (reached * reached + here * here);
}

// One Runge-Kutta step over a share of the local step.
vec4 local_part(float share, vec4 start, vec4 emission, vec4 here, vec4 change) {
    vec4 a = share * local_rate(start, emission, here, change);
    vec4 b = share * local_rate(start, emission, here, change + 0.5 * a);
    vec4 c = share * local_rate(start, emission, here, change + 0.5 * b);
    vec4 d = share * local_rate(start, emission, here, change + c);
    return change + (a + 2.0 * (b + c) + d) * (1.0 / 6.0);
}

// Twin: `local_change` of src/thermal/network/one_pass/local.rs.
vec4 local_change(vec4 here, vec4 start, vec4 emission) {
#ifdef FINE
    vec4 change = vec4(0.0);
    float share = 1.0 / float(pass.count);
    for (uint i = 0u; i < pass.count; i++) {
        change = local_part(share, start, emission, here, change);
    }
    return change;
#endif
#ifndef FINE
    return local_part(0.5, start, emission, here, local_part(0.5, start, emission, here, vec4(0.0)));
#endif
}

// Heat into a group by loads and weak conductors [W].
vec4 heat_into(uint group, vec4 base, vec4 mean_rest) {
    vec4 into = vec4(0.0);
    uvec4 row = rows[group];
#ifdef ALONE
    return into + uintBitsToFloat(sources[row.z]) * drawn[row.w];
#endif
#ifndef ALONE
    for (uint k = row.z; k < row.w; k += 2u) {
        uvec4 at = sources[k];
        vec4 area = uintBitsToFloat(sources[k + 1u]);
#ifdef MASKED
        at &= uvec4(UNDRAWN - 1u);
#endif
        into += area * vec4(temperature[at.x], temperature[at.y], temperature[at.z], temperature[at.w]);
    }
#ifdef RADIATIVE
    vec4 mean = base + mean_rest;
    const uint WORDS = 3u;
#endif
#ifndef RADIATIVE
    const uint WORDS = 2u;
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
#endif
}
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
    uint at = unit.z;
    for (uint other = unit.x; other < unit.y; other++) {
        vec4 driven = drives[2u * other];
        vec4 e = means[2u * other];
        vec4 f = means[2u * other + 1u];
        vec4 base_there = first_of(e, f);
        vec4 rest_there = drives[2u * other + 1u];
        sum += weights[at] * (vec4(driven.x) - drive) + weights[at + 1u] * (vec4(driven.y) - drive)
            + weights[at + 2u] * (vec4(driven.z) - drive) + weights[at + 3u] * (vec4(driven.w) - drive);
        sum += weights[at + 4u] * ((vec4(base_there.x) - base) + (vec4(rest_there.x) - rest))
            + weights[at + 5u] * ((vec4(base_there.y) - base) + (vec4(rest_there.y) - rest))
            + weights[at + 6u] * ((vec4(base_there.z) - base) + (vec4(rest_there.z) - rest))
            + weights[at + 7u] * ((vec4(base_there.w) - base) + (vec4(rest_there.w) - rest));
        at += 8u;
    }
    vec4 coupling = factor * sum;
    couplings[group] = coupling;
    finish(group, base, rest, drive + coupling);
#endif
#ifndef CONDUCT
    vec4 rest = rests[group];
    vec4 here = base + rest;
    vec4 share = pass.step * nodes[2u * group];
    vec4 emission = nodes[2u * group + 1u];
    vec4 squared = here * here;
    vec4 into = heat_into(group, base, second_of(a, b));
    vec4 start = share * (into + emission * (vec4(pass.space_temperature_4) - squared * squared));
#ifdef DRIVE
    vec4 coupling = couplings[group];
    drives[2u * group] = local_change(here, start + coupling, share * emission) - coupling;
    drives[2u * group + 1u] = rest;
#endif
#ifndef DRIVE
    finish(group, base, rest, local_change(here, start, share * emission));
#endif
#endif
}
