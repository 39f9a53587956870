#version 450
// A large network: one pass over all nodes a dispatch, ordered by the barriers of src/gpu/network/frame.rs.
// BEGIN: the rates at the start. FIRST: rebases, and the first stage. STAGE: any other stage. LONE: balances arithmetic
// nodes. LAST: the rates at the end and the error. REDUCE: the largest error of 64 nodes. SENSE: the sensors.

#include "network_types.glsl"
#include "network.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform PassBlock { NetworkPass pass; };
layout(set = 0, binding = 0) readonly buffer NodeBlock { NetworkNode nodes[]; };
layout(set = 0, binding = 1) readonly buffer LinkBlock { NetworkLink links[]; };
// Power [W] and its slope [W/s].
layout(set = 0, binding = 2) readonly buffer HeatBlock { vec2 heat[]; };
// Temperature [K]: base, and the rest of the present stage and of the next.
layout(set = 0, binding = 3) buffer BaseBlock { float base[]; };
layout(set = 0, binding = 4) buffer RestBlock { float rest[]; };
layout(set = 0, binding = 5) buffer NextBlock { float next_rest[]; };
// As in network_fused.comp; LAST leaves the error in place of the change of the stage before the last.
layout(set = 0, binding = 6) buffer WorkBlock { vec4 work[]; };
// Sensors, then arithmetic nodes without arithmetic neighbours.
layout(set = 0, binding = 7) readonly buffer ListBlock { uint lists[]; };
// Bits of the largest error of every 64 nodes.
layout(set = 0, binding = 8) buffer ErrorBlock { uint errors[]; };
// Base and rest of the sensors after every sub-step.
layout(set = 0, binding = 9) buffer SensedBlock { vec2 sensed[]; };

// Sum of the magnitudes [W] that the last call of `heat_into` added up.
float gross;

// Heat into a node [W].
float heat_into(uint node, float time) {
    float base_here = base[node];
    float rest_here = rest[node];
    float here = base_here + rest_here;
    float space = pass.space_temperature;
    vec2 power = heat[node];
    float into = power.x + power.y * time;
    float to_space = nodes[node].emission * radiated((space - base_here) - rest_here, space, here);
    gross = abs(power.x) + abs(power.y * time) + abs(to_space);
    into += to_space;
    uint end = nodes[node].links_end;
    for (uint k = nodes[node].links_begin; k < end; k++) {
        uint other = links[k].neighbour;
        float difference = temperature_difference(base[other], rest[other], base_here, rest_here);
        float flow = links[k].conductance * difference;
        into += flow;
        gross += abs(flow);
#ifdef RADIATIVE
        float radiation = links[k].exchange * radiated(difference, base[other] + rest[other], here);
        into += radiation;
        gross += abs(radiation);
#endif
    }
    return into;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= pass.count) {
        return;
    }
#ifdef BEGIN
    work[i] = vec4(0.0, 0.0, 0.0, nodes[i].inverse_capacitance * heat_into(i, pass.time));
#endif
#ifdef FIRST
    vec2 kept = rebase(base[i], rest[i]);
    float rate = work[i].w;
    float change = pass.gamma_step * rate;
    base[i] = kept.x;
    next_rest[i] = kept.y + change;
    work[i] = vec4(kept.y, change, 0.0, rate);
#endif
#ifdef LONE
    uint node = lists[pass.sensors + i];
    rest[node] += balancing_change(
        heat_into(node, pass.time), nodes[node].conductance_sum, nodes[node].emission_sum, base[node] + rest[node]);
#endif
#ifdef STAGE
    vec4 last = work[i];
    float inverse = nodes[i].inverse_capacitance;
    float rate = inverse * heat_into(i, pass.time);
    float change = pass.mu * last.y + pass.nu * last.z + (pass.mu_step * rate + pass.gamma_step * last.w);
    next_rest[i] = inverse > 0.0 ? last.x + change : rest[i];
    work[i] = vec4(last.x, change, last.y, last.w);
#endif
#ifdef LAST
    vec4 last = work[i];
    float inverse = nodes[i].inverse_capacitance;
    float rate = inverse * heat_into(i, pass.time);
    float error = pass.mu_step * rate + pass.gamma_step * last.w + pass.mu * last.y;
    float weight = (abs(pass.mu_step) + abs(pass.gamma_step)) * inverse;
    float slope = nodes[i].conductance_sum + nodes[i].emission_sum * radiative_slope(base[i] + rest[i]);
    error = beyond_rounding(error, weight * (gross + slope * abs(rest[i])));
    uint out_of_range = inverse > 0.0 ? range_bits(base[i] + rest[i]) : 0u;
    work[i] = vec4(last.x, last.y, uintBitsToFloat(max(error_bits(error), out_of_range)), rate);
#endif
#ifdef REDUCE
    uint largest = errors[i];
    uint end = min(64u * i + 64u, pass.nodes);
    for (uint k = 64u * i; k < end; k++) {
        largest = max(largest, floatBitsToUint(work[k].z));
    }
    errors[i] = largest;
#endif
#ifdef SENSE
    uint node = lists[i];
    sensed[pass.sensed_at + i] = vec2(base[node], rest[node]);
#endif
}
