#version 450
// Passes over a network by an explicit method. Each dispatch is one pass, with four nodes an invocation. The
// barriers are in src/gpu/network/frame.rs. Variants: BEGIN: rates at the start. FIRST or none: rebases, and computes
// the first stage. STAGE: a later stage. LONE: balances arithmetic nodes. LAST: end rates and error. SENSE: sensors.

#if defined(LONE)
#define MOVES
#define LISTED
#endif
#if defined(LONE) || defined(LAST)
#define SUMS
#endif
#if defined(BEGIN) || defined(STAGE) || defined(LONE) || defined(LAST) || defined(SENSE)
#define GATHERS
#endif
#if !defined(GATHERS) && !defined(FIRST)
#define FIRST
#endif

#include "network_types.glsl"
#include "network.glsl"
#include "network_rows.glsl"

layout(local_size_x = 64) in;

// Base and rest of the next stage. Before the pass they are those of the stage before the present one.
layout(set = 0, binding = 10) buffer NextBlock { vec4 next[]; };
// Rests [K] and rates [K/s] at the start of the sub-step.
layout(set = 0, binding = 11) buffer StartBlock { vec4 start_rest[]; };
layout(set = 0, binding = 12) buffer RateBlock { vec4 rates[]; };
// LONE: groups with arithmetic nodes, and a bit for each of these nodes (see `mask_of`). SENSE: sensors.
layout(set = 0, binding = 13) readonly buffer ListBlock { uint lists[]; };
// Bits of the largest error of each workgroup.
layout(set = 0, binding = 15) buffer ErrorBlock { uint errors[]; };
// Base and rest of the sensors after every sub-step.
layout(set = 0, binding = 16) buffer SensedBlock { vec2 sensed[]; };

#ifdef LONE
// `balancing_change` for four nodes.
vec4 balancing_change_4(vec4 into, vec4 conductance, vec4 emission, vec4 temperature) {
    vec4 warm = conductance * temperature + emission * temperature * temperature * temperature * temperature;
    vec4 heat_here = into + warm;
    vec4 gross_here = abs(into) + warm;
    vec4 most = vec4(
        warmest_balance(heat_here.x, gross_here.x, conductance.x, emission.x),
        warmest_balance(heat_here.y, gross_here.y, conductance.y, emission.y),
        warmest_balance(heat_here.z, gross_here.z, conductance.z, emission.z),
        warmest_balance(heat_here.w, gross_here.w, conductance.w, emission.w)
    ) - temperature;
    vec4 change = min(vec4(0.0), most);
    for (int i = 0; i < 12; i++) {
        vec4 reached = temperature + change;
        vec4 left = into - conductance * change - emission * radiated_4(change, reached, temperature);
        vec4 slope = max(conductance + emission * radiative_slope_4(reached), vec4(1e-30));
        change = min(change + max(left / slope, -0.75 * reached), most);
    }
    return change;
}
#endif

#ifdef LAST
shared uint worst_of[64];

uint worse(uint worst, float error, float size, float temperature) {
    return max(max(worst, error_bits(beyond_rounding(error, size))), range_bits(temperature));
}
#endif

void main() {
    uint i = gl_GlobalInvocationID.x;
#ifdef LAST
    uint worst = 0u;
    if (i < pass.count) {
        vec4 a = present[2u * i];
        vec4 b = present[2u * i + 1u];
        vec4 base = base_of(a, b);
        vec4 rest = rest_of(a, b);
        vec4 inverse = rows[2u * i];
        vec4 rate = inverse * heat_into(i, base, rest, pass.time);
        vec4 error = pass.mu_step * rate + pass.gamma_step * rates[i] + pass.mu * (rest - start_rest[i]);
        vec4 here = base + rest;
        vec4 slope = conductance_sum + emission_sum * radiative_slope_4(here);
        vec4 size = (abs(pass.mu_step) + abs(pass.gamma_step)) * inverse * (gross + slope * abs(rest));
        error *= sign(inverse);
        worst = worse(worst, error.x, size.x, here.x);
        worst = worse(worst, error.y, size.y, here.y);
        worst = worse(worst, error.z, size.z, here.z);
        worst = worse(worst, error.w, size.w, here.w);
        rates[i] = rate;
    }
    uint lane = gl_LocalInvocationID.x;
    worst_of[lane] = worst;
    barrier();
    if (lane == 0u) {
        uint largest = errors[gl_WorkGroupID.x];
        for (uint k = 0u; k < 64u; k++) {
            largest = max(largest, worst_of[k]);
        }
        errors[gl_WorkGroupID.x] = largest;
    }
#endif
#ifndef LAST
    if (i >= pass.count) {
        return;
    }
#endif
#ifdef BEGIN
    vec4 a = present[2u * i];
    vec4 b = present[2u * i + 1u];
    rates[i] = rows[2u * i] * heat_into(i, base_of(a, b), rest_of(a, b), pass.time);
#endif
#ifdef FIRST
    vec4 a = present[2u * i];
    vec4 b = present[2u * i + 1u];
    vec4 kept_a = rebased_pair(a.xz, a.yw);
    vec4 kept_b = rebased_pair(b.xz, b.yw);
    vec4 kept = rest_of(kept_a, kept_b);
    vec4 moved = kept + pass.gamma_step * rates[i];
    start_rest[i] = kept;
    next[2u * i] = vec4(kept_a.x, moved.x, kept_a.z, moved.y);
    next[2u * i + 1u] = vec4(kept_b.x, moved.z, kept_b.z, moved.w);
#endif
#ifdef LONE
    uint entry = lists[i];
    uint group = entry >> 4u;
    vec4 a = present[2u * group];
    vec4 b = present[2u * group + 1u];
    vec4 base = base_of(a, b);
    vec4 rest = rest_of(a, b);
    vec4 into = heat_into(group, base, rest, pass.time);
    // Masks the other nodes, because the divisor of a boundary node may be 0.
    vec4 mask = mask_of(entry);
    vec4 others = vec4(1.0) - mask;
    vec4 conductance = mask * conductance_sum + others;
    vec4 moved = rest + mask * balancing_change_4(mask * into, conductance, mask * emission_sum, base + rest);
    // No other arithmetic node reads these nodes before the next barrier. The other nodes stay as they are.
    vec4 moved_a = rebased_pair(base.xy, moved.xy);
    vec4 moved_b = rebased_pair(base.zw, moved.zw);
    present[2u * group] = vec4(mask.x > 0.0 ? moved_a.xy : a.xy, mask.y > 0.0 ? moved_a.zw : a.zw);
    present[2u * group + 1u] = vec4(mask.z > 0.0 ? moved_b.xy : b.xy, mask.w > 0.0 ? moved_b.zw : b.zw);
#endif
#ifdef STAGE
    vec4 a = present[2u * i];
    vec4 b = present[2u * i + 1u];
    vec4 base = base_of(a, b);
    vec4 rest = rest_of(a, b);
    vec4 inverse = rows[2u * i];
    vec4 rate = inverse * heat_into(i, base, rest, pass.time);
    vec4 kept = start_rest[i];
    vec4 c = next[2u * i];
    vec4 d = next[2u * i + 1u];
    // The start of the sub-step may have other bases than the present stage. Both differences are exact.
    vec4 change_before = (base_of(c, d) - base) + (rest_of(c, d) - kept);
    vec4 change = pass.mu * (rest - kept) + pass.nu * change_before + (pass.mu_step * rate + pass.gamma_step * rates[i]);
    vec4 stores = sign(inverse);
    vec4 moved = stores * (kept + change) + (1.0 - stores) * rest;
    next[2u * i] = vec4(base.x, moved.x, base.y, moved.y);
    next[2u * i + 1u] = vec4(base.z, moved.z, base.w, moved.w);
#endif
#ifdef SENSE
    sensed[pass.sensed_at + i] = gathered[lists[i]];
#endif
}
