#version 450
// A small network in one workgroup, which takes all sub-steps of an attempt with a barrier between stages. Variants:
// EXPLICIT or none: Euler and RKL2. IMPLICIT: TR-BDF2. SETTLE: balances arithmetic or all nodes. LANES_8, LANES_64,
// LANES_256: number of invocations (default 64).

#if defined(IMPLICIT) || defined(SETTLE)
#define RADIATIVE
#define ELIMINATION
#endif
#if !defined(IMPLICIT) && !defined(SETTLE) && !defined(EXPLICIT)
#define EXPLICIT
#endif
#if !defined(LANES_8) && !defined(LANES_256) && !defined(LANES_64)
#define LANES_64
#endif

#include "network_types.glsl"
#include "network.glsl"

#ifdef LANES_8
layout(local_size_x = 8) in;
const uint LANES = 8u;
#endif
#ifdef LANES_64
layout(local_size_x = 64) in;
const uint LANES = 64u;
#endif
#ifdef LANES_256
layout(local_size_x = 256) in;
const uint LANES = 256u;
#endif

layout(set = 0, binding = 0) readonly buffer AttemptBlock { NetworkAttempt attempt; };
layout(set = 0, binding = 1) readonly buffer NodeBlock { NetworkNode nodes[]; };
layout(set = 0, binding = 2) readonly buffer LinkBlock { NetworkLink links[]; };
// Heat [W] and its slope [W/s].
layout(set = 0, binding = 3) readonly buffer HeatBlock { vec2 heat[]; };
layout(set = 0, binding = 4) readonly buffer StageBlock { NetworkStage stages[]; };
// Sensors, then arithmetic nodes without an arithmetic neighbour.
layout(set = 0, binding = 5) readonly buffer ListBlock { uint lists[]; };
// Base and rest [K].
layout(set = 0, binding = 6) buffer StateBlock { vec2 state[]; };
// For each node: rest at the start of the sub-step, changes of the last two stages [K], rate at the start [K/s].
// TR-BDF2 stores the heat at the start [W] as the rate, and the change of the base as the older change.
layout(set = 0, binding = 7) buffer WorkBlock { vec4 work[]; };
// Completed sub-steps, bits of the largest error, iterations, active dispatches. Then base and rest of the sensors
// after every sub-step.
layout(set = 0, binding = 8) buffer ResultBlock { uint result[]; };
layout(set = 0, binding = 9) readonly buffer ScheduleBlock { uint schedule[]; };
layout(set = 0, binding = 10) buffer MatrixBlock { float matrix[]; };

const uint LOOPS_AT_MOST = 48000u;
const uint NODES_AT_MOST = 1024u;

shared float base[1024];
// Rests of the present stage and of the next one.
shared float rest[2048];
shared uint worst_of[LANES];

// Loop iterations and Newton iterations so far.
uint spent;
uint iterations;

// Sum of the magnitudes of the terms [W] in the last call of `heat_into`.
float gross;

// Heat into a node [W].
float heat_into(uint node, uint set, float time) {
    float base_here = base[node];
    float rest_here = rest[set + node];
    float here = base_here + rest_here;
    float space = attempt.space_temperature;
    vec2 power = heat[node];
    float into = power.x + power.y * time;
    float to_space = nodes[node].emission * radiated((space - base_here) - rest_here, space, here);
    gross = abs(power.x) + abs(power.y * time) + abs(to_space);
    into += to_space;
    uint end = nodes[node].links_end;
    for (uint k = nodes[node].links_begin; k < end; k++) {
        uint other = links[k].neighbour;
        float difference = temperature_difference(base[other], rest[set + other], base_here, rest_here);
        float flow = links[k].conductance * difference;
        into += flow;
        gross += abs(flow);
#ifdef RADIATIVE
        float radiation = links[k].exchange * radiated(difference, base[other] + rest[set + other], here);
        into += radiation;
        gross += abs(radiation);
#endif
    }
    return into;
}

// Balances the arithmetic nodes without an arithmetic neighbour. Returns the bits of the largest |change| /
// temperature.
uint balance_lone(uint lane, uint set, float time) {
    uint largest = 0u;
    for (uint i = lane; i < attempt.lone; i += LANES) {
        uint node = lists[attempt.sensors + i];
        float here = base[node] + rest[set + node];
        float change = balancing_change(
            heat_into(node, set, time), nodes[node].conductance_sum, nodes[node].emission_sum, here);
        // No other arithmetic node reads this one before the next barrier.
        vec2 moved = rebase(base[node], rest[set + node] + change);
        base[node] = moved.x;
        rest[set + node] = moved.y;
        largest = max(largest, error_bits(change / max(here + change, 0.01)));
    }
    return largest;
}

#ifdef ELIMINATION
#include "network_elimination.glsl"
#endif

void write_state(uint lane, uint set) {
    for (uint i = lane; i < attempt.nodes; i += LANES) {
        state[i] = rebase(base[i], rest[set + i]);
    }
}

void write_sensors(uint lane, uint set, uint done) {
    for (uint i = lane; i < attempt.sensors; i += LANES) {
        uint node = lists[i];
        uint at = 4u + 2u * (done * attempt.sensors + i);
        result[at] = floatBitsToUint(base[node]);
        result[at + 1u] = floatBitsToUint(rest[set + node]);
    }
}

void write_result(uint lane, uint done, uint worst) {
    worst_of[lane] = worst;
    barrier();
    if (lane == 0u) {
        uint largest = result[1];
        for (uint i = 0u; i < LANES; i++) {
            largest = max(largest, worst_of[i]);
        }
        result[0] = done;
        result[1] = largest;
        result[2] = result[2] + iterations;
        result[3] = result[3] + 1u;
    }
}

#ifdef EXPLICIT
void main() {
    uint lane = gl_LocalInvocationID.x;
    uint done = result[0];
    uint current = 0u;
    uint worst = 0u;
    iterations = 0u;
    for (uint i = lane; i < attempt.nodes; i += LANES) {
        vec2 kept = state[i];
        base[i] = kept.x;
        rest[i] = kept.y;
    }
    barrier();
    spent = attempt.loops_sub_step;
    if (done < attempt.count) {
        float start = attempt.time + float(done) * attempt.step;
        for (uint i = lane; i < attempt.nodes; i += LANES) {
            work[i] = vec4(0.0, 0.0, 0.0, nodes[i].inverse_capacitance * heat_into(i, 0u, start));
        }
    }
    barrier();
    for (; done < attempt.count; done++) {
        spent += attempt.loops_sub_step;
        if (spent > LOOPS_AT_MOST) {
            break;
        }
        float start = attempt.time + float(done) * attempt.step;
        uint next = NODES_AT_MOST - current;
        // The first stage reads no neighbour, so this loop also rebases the result of the last sub-step.
        for (uint i = lane; i < attempt.nodes; i += LANES) {
            vec2 kept = rebase(base[i], rest[current + i]);
            float rate = work[i].w;
            float change = stages[0].gamma_step * rate;
            base[i] = kept.x;
            rest[next + i] = kept.y + change;
            work[i] = vec4(kept.y, change, 0.0, rate);
        }
        barrier();
        current = next;
        for (uint s = 1u; s <= attempt.stages; s++) {
            // Balances the arithmetic nodes of the previous stage, with the heat at its time.
            float now = start + stages[s - 1u].time;
            if (attempt.lone > 0u) {
                balance_lone(lane, current, now);
                barrier();
                // The last stage balances twice, because a change of hundreds of kelvin leaves a rounding error of 3 K
                // at 3 K.
                if (s == attempt.stages) {
                    balance_lone(lane, current, now);
                    barrier();
                }
            }
#ifdef ELIMINATION
            if (!newton(lane, current, now, vec4(1.0, 0.0, 0.0, 0.0), 0.0, 12u)) {
                worst = 0x7f800000u;
            }
#endif
            if (s < attempt.stages) {
                next = NODES_AT_MOST - current;
                for (uint i = lane; i < attempt.nodes; i += LANES) {
                    vec4 last = work[i];
                    float inverse = nodes[i].inverse_capacitance;
                    float rate = inverse * heat_into(i, current, now);
                    float change = stages[s].mu * last.y + stages[s].nu * last.z
                        + (stages[s].mu_step * rate + stages[s].gamma_step * last.w);
                    rest[next + i] = inverse > 0.0 ? last.x + change : rest[current + i];
                    work[i] = vec4(last.x, change, last.y, last.w);
                }
                barrier();
                current = next;
            }
        }
        // Computes the end rate, which is also the start rate of the next sub-step, and the error from both rates.
        float end = attempt.time + float(done + 1u) * attempt.step;
        for (uint i = lane; i < attempt.nodes; i += LANES) {
            vec4 last = work[i];
            float inverse = nodes[i].inverse_capacitance;
            float rate = inverse * heat_into(i, current, end);
            float error =
                attempt.error_end * rate + attempt.error_start * last.w + attempt.error_change * last.y;
            float weight = (abs(attempt.error_end) + abs(attempt.error_start)) * inverse;
            float slope = radiative_slope(base[i] + rest[current + i]);
            float moved = (nodes[i].conductance_sum + nodes[i].emission_sum * slope) * abs(rest[current + i]);
            worst = max(worst, error_bits(beyond_rounding(error, weight * (gross + moved))));
            worst = max(worst, range_bits(base[i] + rest[current + i]));
            work[i] = vec4(last.x, last.y, last.z, rate);
        }
        write_sensors(lane, current, done);
        barrier();
    }
    write_state(lane, current);
    write_result(lane, done, worst);
}
#endif

#ifdef IMPLICIT
// gamma = 2 - sqrt(2). Both stages have the same matrix because alpha = gamma / 2 = (1 - gamma) / (2 - gamma).
const float GAMMA = 0.585786437626905;
const float ALPHA = 0.292893218813452;
// Weight of the first stage in the second one: 1 / (gamma (2 - gamma)).
const float FIRST = 1.20710678118655;
// 2 k / alpha of the embedded estimate, with k = (-3 gamma^2 + 4 gamma - 2) / (12 (2 - gamma)) (Hosea & Shampine 1996).
const float ESTIMATE = -0.276142374915397;

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint done = result[0];
    uint worst = 0u;
    iterations = 0u;
    for (uint i = lane; i < attempt.nodes; i += LANES) {
        vec2 kept = state[i];
        base[i] = kept.x;
        rest[i] = kept.y;
    }
    barrier();
    spent = attempt.loops_sub_step;
    float inverse_step = 1.0 / (ALPHA * attempt.step);
    for (; done < attempt.count; done++) {
        spent += attempt.loops_sub_step;
        if (spent + 8u * attempt.loops_iteration > LOOPS_AT_MOST) {
            break;
        }
        float start = attempt.time + float(done) * attempt.step;
        for (uint i = lane; i < attempt.nodes; i += LANES) {
            float into = nodes[i].inverse_capacitance > 0.0 ? heat_into(i, 0u, start) : 0.0;
            work[i] = vec4(0.0, 0.0, 0.0, into);
        }
        barrier();
        for (uint i = lane; i < attempt.nodes; i += LANES) {
            vec2 kept = rebase(base[i], rest[i]);
            base[i] = kept.x;
            rest[i] = kept.y;
            work[i] = vec4(kept.y, 0.0, 0.0, work[i].w);
        }
        barrier();
        bool first = newton(lane, 0u, start + GAMMA * attempt.step, vec4(1.0, 1.0, -1.0, 0.0), inverse_step, 12u);
        for (uint i = lane; i < attempt.nodes; i += LANES) {
            vec4 kept = work[i];
            float change = kept.z + (rest[i] - kept.x);
            work[i] = vec4(kept.x, change, kept.z, kept.w);
        }
        barrier();
        float end = attempt.time + float(done + 1u) * attempt.step;
        bool second = newton(lane, 0u, end, vec4(1.0, 0.0, -1.0, FIRST), inverse_step, 12u);
        vec4 weights = ESTIMATE * vec4(0.0, 1.0 / GAMMA + 1.0 / (GAMMA * (1.0 - GAMMA)), 1.0 / (1.0 - GAMMA),
            -1.0 / (GAMMA * (1.0 - GAMMA)) - FIRST / (1.0 - GAMMA));
        assemble(lane, 0u, end, weights, inverse_step);
        eliminate(lane);
        spent += attempt.loops_iteration;
        if (!first) {
            worst = 0x7f800000u;
        }
        if (!second) {
            worst = 0x7f800000u;
        }
        for (uint m = lane; m < attempt.unknowns; m += LANES) {
            uint node = schedule[attempt.nodes_at + m];
            // Rounding error of the start heat, the end heat and the change, as weighted by the estimate and divided by
            // the pivot.
            float into = heat_into(node, 0u, end);
            float change = work[node].z + (rest[node] - work[node].x);
            float stored = nodes[node].capacitance * inverse_step;
            float size = (abs(weights.y) * gross + abs(weights.w) * stored * abs(change)) / matrix[m];
            worst = max(worst, error_bits(beyond_rounding(matrix[attempt.right_at + m], size)));
            worst = max(worst, range_bits(base[node] + rest[node]));
        }
        write_sensors(lane, 0u, done);
        barrier();
    }
    write_state(lane, 0u);
    write_result(lane, done, worst);
}
#endif

#ifdef SETTLE
void main() {
    uint lane = gl_LocalInvocationID.x;
    uint worst = 0u;
    iterations = 0u;
    spent = 0u;
    for (uint i = lane; i < attempt.nodes; i += LANES) {
        vec2 kept = state[i];
        base[i] = kept.x;
        rest[i] = kept.y;
        work[i] = vec4(0.0);
    }
    barrier();
    // Each iteration evaluates the exact balance, so the last one corrects the rounding of a large change.
    uint moved = 0u;
    for (uint pass = 0u; pass < 6u; pass++) {
        moved = balance_lone(lane, 0u, attempt.time);
        barrier();
    }
    if (moved > floatBitsToUint(1e-4)) {
        worst = 0x7f800000u;
    }
    bool settled = attempt.unknowns == 0u;
    if (attempt.unknowns > 0u) {
        settled = newton(lane, 0u, attempt.time, vec4(1.0, 0.0, 0.0, 0.0), 0.0, attempt.count);
    }
    for (uint m = lane; m < attempt.unknowns; m += LANES) {
        uint node = schedule[attempt.nodes_at + m];
        worst = max(worst, range_bits(base[node] + rest[node]));
    }
    write_state(lane, 0u);
    write_result(lane, settled ? 1u : 0u, worst);
}
#endif
