#version 450
// Passes of Newton's method for a network, with Jacobi-preconditioned conjugate gradients and one reduction for
// each iteration (Chronopoulos & Gear, J. Comput. Appl. Math. 25, 1989, 153). Each dispatch is one pass, with four
// nodes an invocation. The barriers are in src/gpu/network/solve_frame.rs. Variants: START: starts a sub-step of
// TR-BDF2. BALANCE, RESIDUAL: right-hand side and diagonal, of a balance and of a stage. PRODUCT: matrix times z.
// SCALARS: sums and decisions. UPDATE or none: vectors. MOVE: temperatures. MIDDLE: change of the first stage.
// ESTIMATE: error.
//
// Converged values no longer change, so extra iterations do not affect the result. If nodes radiate to each other, the
// matrix is not symmetric. The solver then uses the geometric mean of each pair of entries, which is positive definite.
// Newton's method still uses the exact balances.

#if defined(START) || defined(BALANCE) || defined(RESIDUAL) || defined(ESTIMATE)
#define GATHERS
#endif
#if defined(GATHERS) || defined(MOVE) || defined(MIDDLE)
#define HERE
#endif
#if defined(BALANCE) || defined(RESIDUAL)
#define SUMS
#define RIGHT_SIDE
#endif
#if defined(RESIDUAL) || defined(MIDDLE) || defined(ESTIMATE)
#define STEPS
#endif
#if defined(PRODUCT) || defined(SCALARS) || defined(MOVE)
#define REDUCES
#endif
#if !defined(HERE) && !defined(REDUCES) && !defined(UPDATE)
#define UPDATE
#endif
#ifdef MOVE
#define MOVES
#endif
#if !defined(START) && !defined(SCALARS)
#define LISTED
#endif

#include "network_types.glsl"
#include "network.glsl"
#include "network_rows.glsl"

#ifndef SCALARS
layout(local_size_x = 64) in;
const uint LANES = 64u;
#endif
#ifdef SCALARS
layout(local_size_x = 256) in;
const uint LANES = 256u;
#endif

// Temperatures at the start of the sub-step.
layout(set = 0, binding = 10) buffer NextBlock { vec4 next[]; };
// Change of the first stage [K], and heat at the start [W].
layout(set = 0, binding = 11) buffer StartBlock { vec4 first_change[]; };
layout(set = 0, binding = 12) buffer RateBlock { vec4 heat_at_start[]; };
// Groups with unknowns, and a bit for each of these nodes (see `mask_of`).
layout(set = 0, binding = 13) readonly buffer ListBlock { uint lists[]; };
layout(set = 0, binding = 15) buffer ErrorBlock { uint errors[]; };
// Preconditioned residual z [K], 0 for other nodes than unknowns. Then two directions, the solution [K], the product
// [W] and the diagonal [W/K], 1 for other nodes than unknowns. The residual is the diagonal times z.
layout(set = 0, binding = 18) buffer ConditionedBlock { vec4 conditioned[]; };
#ifdef PRODUCT
layout(set = 0, binding = 19) readonly buffer ConditionedOneBlock { float conditioned_of[]; };
#ifdef RADIATIVE
layout(set = 0, binding = 9) readonly buffer GatheredBlock { vec2 gathered[]; };
#endif
#endif
layout(set = 0, binding = 21) buffer DirectionBlock { vec4 direction[]; };
layout(set = 0, binding = 22) buffer ProductDirectionBlock { vec4 product_direction[]; };
layout(set = 0, binding = 23) buffer SolutionBlock { vec4 solution[]; };
layout(set = 0, binding = 24) buffer ProductBlock { vec4 product[]; };
layout(set = 0, binding = 25) buffer DiagonalBlock { vec4 diagonals[]; };
// For each workgroup: two partial sums, or the largest relative change.
layout(set = 0, binding = 27) buffer PartialBlock { vec2 partials[]; };
layout(set = 0, binding = 28) buffer ScalarBlock { NetworkSolver solver; };

#ifdef REDUCES
shared vec2 lane_values[LANES];
#endif

#ifdef SCALARS
const uint GRADIENTS = 0u;
const uint NEWTON = 1u;
const uint NEWTON_LAST = 2u;
const uint LINEAR_LAST = 3u;

void gradients(vec2 sums) {
    float gamma = sums.x;
    bool first = solver.gradients == 0.0;
    if (first) {
        solver.gamma_start = gamma;
        if (solver.newtons == 0.0) {
            solver.gamma_first = gamma;
        }
    }
    float beta = first ? 0.0 : gamma / solver.gamma;
    float curvature = first ? sums.y : sums.y - beta * gamma / solver.alpha;
    // The second limit is the rounding error of a stage's first residual.
    float enough = max(pass.accuracy * solver.gamma_start, 1e-14 * solver.gamma_first);
    bool going = solver.gradients_done == 0.0;
    if (gamma <= enough) {
        going = false;
    }
    // Rounding can make the curvature zero or negative. This also stops at a NaN.
    if (!(curvature > 0.0)) {
        going = false;
    }
    if (solver.newtons_done > 0.0) {
        going = false;
    }
    if (going) {
        solver.alpha = gamma / curvature;
        solver.beta = beta;
        solver.gamma = gamma;
        solver.gradients += 1.0;
        solver.step = solver.alpha;
    } else {
        solver.gradients_done = 1.0;
        solver.beta = 0.0;
        solver.step = 0.0;
    }
}

void end_of_gradients() {
    solver.most_gradients = max(solver.most_gradients, solver.gradients);
    if (solver.newtons_done == 0.0) {
        solver.iterations += solver.gradients;
        if (solver.gradients_done == 0.0) {
            solver.short_gradients = 1.0;
        }
    }
    solver.gradients = 0.0;
    solver.gradients_done = 0.0;
}

void newton(float moved, bool last) {
    end_of_gradients();
    if (solver.newtons_done == 0.0) {
        solver.newtons += 1.0;
        if (!(moved < 1e30)) {
            solver.lost = 1.0;
            solver.newtons_done = 1.0;
        }
        if (moved <= pass.accuracy) {
            solver.newtons_done = 1.0;
        }
        // After these iterations, small moves are the rounding of large heats at small conductance.
        if (solver.newtons > pass.mu) {
            if (moved <= 4.0 * pass.accuracy) {
                solver.newtons_done = 1.0;
            }
        }
        solver.largest_move = moved;
    }
    if (last) {
        solver.most_newtons = max(solver.most_newtons, solver.newtons);
        if (solver.newtons_done == 0.0) {
            solver.short_newtons = 1.0;
        }
        solver.newtons = 0.0;
        solver.newtons_done = 0.0;
    }
}
#endif

#ifdef STEPS
// Change since the start of the sub-step [K]. The difference of the bases is exact.
vec4 change_since(uint group, vec4 base, vec4 rest) {
    vec4 a = next[2u * group];
    vec4 b = next[2u * group + 1u];
    return (base - base_of(a, b)) + (rest - rest_of(a, b));
}

// C / (alpha h) [W/K]; 0 for nodes that store no heat.
vec4 stored_heat(uint group) {
    vec4 inverse = rows[2u * group];
    vec4 stores = sign(inverse);
    return pass.inverse_step * stores / (inverse + (1.0 - stores));
}
#endif

#ifdef PRODUCT
#ifdef RADIATIVE
// 2 T^(3/2). The product of two of these is the geometric mean of the slopes of T^4.
vec4 root_4(vec4 temperature) {
    vec4 warm = max(temperature, vec4(0.0));
    return 2.0 * warm * sqrt(warm);
}

float root(float temperature) {
    float warm = max(temperature, 0.0);
    return 2.0 * warm * sqrt(warm);
}
#endif

// Heat [W] into a group from its neighbours, for their part of the vector.
vec4 from_neighbours(uint group) {
    vec4 sum = vec4(0.0);
    uint slice = group / GROUPS_OF_SLICE;
    uint place = group % GROUPS_OF_SLICE;
    uvec2 begin = slices[slice];
    uvec2 end = slices[slice + 1u];
    for (uint k = begin.x + place; k < end.x; k += GROUPS_OF_SLICE) {
        uvec4 other = neighbours[k];
        sum += conductances[k] * vec4(
            conditioned_of[other.x], conditioned_of[other.y], conditioned_of[other.z], conditioned_of[other.w]);
    }
#ifdef RADIATIVE
    if (begin.y < end.y) {
        vec4 a = present[2u * group];
        vec4 b = present[2u * group + 1u];
        vec4 root_here = root_4(base_of(a, b) + rest_of(a, b));
        for (uint k = begin.y + place; k < end.y; k += GROUPS_OF_SLICE) {
            uvec4 other = radiators[2u * k];
            vec2 c = gathered[other.x];
            vec2 d = gathered[other.y];
            vec2 e = gathered[other.z];
            vec2 f = gathered[other.w];
            vec4 root_there = root_4(vec4(c.x + c.y, d.x + d.y, e.x + e.y, f.x + f.y));
            sum += uintBitsToFloat(radiators[2u * k + 1u]) * root_here * root_there * vec4(
                conditioned_of[other.x], conditioned_of[other.y], conditioned_of[other.z], conditioned_of[other.w]);
        }
    }
#endif
    return sum;
}

#ifdef TAILS
float from_tail(uint node) {
    float sum = 0.0;
    uint end = tails[node + 1u];
#ifdef RADIATIVE
    vec2 here = gathered[node];
#endif
    for (uint k = tails[node]; k < end; k++) {
        uint other = links[k].neighbour;
        float slope = links[k].conductance;
#ifdef RADIATIVE
        vec2 there = gathered[other];
        slope += links[k].exchange * root(here.x + here.y) * root(there.x + there.y);
#endif
        sum += slope * conditioned_of[other];
    }
    return sum;
}
#endif
#endif

#ifdef MOVE
// New base and rest of an unknown, and the largest relative change so far.
vec3 moved_by(float base, float rest, float change, float mask, float largest) {
    float here = base + rest;
    vec2 at = rebase(base, rest + clamp(change, -0.75 * here, max(3.0 * here, 1000.0)));
    float relative = abs(change) / here;
    // A NaN counts as infinite.
    float worst = relative <= largest ? largest : (relative > largest ? relative : 1e38);
    return mask > 0.0 ? vec3(at, worst) : vec3(base, rest, largest);
}
#endif

#ifdef ESTIMATE
uint worse(uint worst, float error, float size, float mask, float temperature) {
    uint found = max(max(worst, error_bits(beyond_rounding(error, size))), range_bits(temperature));
    return mask > 0.0 ? found : worst;
}
#endif

void main() {
    uint i = gl_GlobalInvocationID.x;
    uint lane = gl_LocalInvocationID.x;
#ifdef REDUCES
    vec2 own = vec2(0.0);
#endif
#ifdef SCALARS
    // Sums or maximum of the workgroups' results.
    for (uint k = lane; k < pass.count; k += LANES) {
        own = pass.mode == GRADIENTS ? own + partials[k] : max(own, partials[k]);
    }
    lane_values[lane] = own;
    barrier();
    if (lane == 0u) {
        vec2 all = vec2(0.0);
        for (uint k = 0u; k < LANES; k++) {
            all = pass.mode == GRADIENTS ? all + lane_values[k] : max(all, lane_values[k]);
        }
        if (pass.mode == GRADIENTS) {
            gradients(all);
        } else {
            if (pass.mode == LINEAR_LAST) {
                end_of_gradients();
            } else {
                newton(all.x, pass.mode == NEWTON_LAST);
            }
        }
    }
#endif
#ifndef SCALARS
    if (i < pass.count) {
#ifdef START
        uint group = i;
#endif
#ifndef START
        uint entry = lists[i];
        uint group = entry >> 4u;
        vec4 mask = mask_of(entry);
#endif
#ifdef HERE
        vec4 a = present[2u * group];
        vec4 b = present[2u * group + 1u];
        vec4 base = base_of(a, b);
        vec4 rest = rest_of(a, b);
        vec4 here = base + rest;
#endif
#ifdef START
        heat_at_start[group] = sign(rows[2u * group]) * heat_into(group, base, rest, pass.time);
        // The value has weight 0 in the first stage, but must be finite.
        first_change[group] = vec4(0.0);
        next[2u * group] = rebased_pair(a.xz, a.yw);
        next[2u * group + 1u] = rebased_pair(b.xz, b.yw);
#endif
#ifdef BALANCE
        vec4 right = heat_into(group, base, rest, pass.time);
        vec4 diagonal = conductance_sum + emission_sum * radiative_slope_4(max(here, vec4(1.0)));
#endif
#ifdef RESIDUAL
        vec4 stored = stored_heat(group);
        vec4 right = pass.mu * heat_into(group, base, rest, pass.time) + pass.nu * heat_at_start[group]
            + stored * (pass.mu_step * change_since(group, base, rest) + pass.gamma_step * first_change[group]);
        vec4 diagonal = stored + conductance_sum + emission_sum * radiative_slope_4(max(here, vec4(1.0)));
#endif
#ifdef RIGHT_SIDE
        diagonal = mask * diagonal + (1.0 - mask);
        diagonals[group] = diagonal;
        conditioned[group] = mask * right / diagonal;
#endif
#ifdef PRODUCT
        vec4 z = conditioned[group];
        vec4 left = diagonals[group] * z;
        vec4 passed = from_neighbours(group);
#ifdef TAILS
        uint node = 4u * group;
        passed += vec4(from_tail(node), from_tail(node + 1u), from_tail(node + 2u), from_tail(node + 3u));
#endif
        vec4 found = mask * (left - passed);
        product[group] = found;
        own = vec2(dot(left, z), dot(z, found));
#endif
#ifdef UPDATE
        float beta = solver.beta;
        float alpha = solver.step;
        vec4 along = conditioned[group];
        vec4 product_along = product[group];
        vec4 z = along;
        vec4 before = vec4(0.0);
        if (pass.mode == 0u) {
            along += beta * direction[group];
            product_along += beta * product_direction[group];
            before = solution[group];
        }
        direction[group] = along;
        product_direction[group] = product_along;
        solution[group] = before + alpha * along;
        conditioned[group] = z - alpha * product_along / diagonals[group];
#endif
#ifdef MOVE
        vec4 change = solution[group] * (solver.newtons_done > 0.0 ? 0.0 : 1.0);
        vec3 x = moved_by(base.x, rest.x, change.x, mask.x, 0.0);
        vec3 y = moved_by(base.y, rest.y, change.y, mask.y, x.z);
        vec3 z = moved_by(base.z, rest.z, change.z, mask.z, y.z);
        vec3 w = moved_by(base.w, rest.w, change.w, mask.w, z.z);
        present[2u * group] = vec4(x.xy, y.xy);
        present[2u * group + 1u] = vec4(z.xy, w.xy);
        own = vec2(w.z, 0.0);
#endif
#ifdef MIDDLE
        first_change[group] = change_since(group, base, rest);
#endif
#ifdef ESTIMATE
        // Rounding error of the start heat, the end heat and the change, as weighted by the estimate and divided by the
        // pivot.
        heat_into(group, base, rest, pass.time);
        vec4 size = abs(pass.nu) * gross
            + abs(pass.gamma_step) * stored_heat(group) * abs(change_since(group, base, rest));
        size /= diagonals[group];
        vec4 error = solution[group];
        uint worst = worse(errors[i], error.x, size.x, mask.x, here.x);
        worst = worse(worst, error.y, size.y, mask.y, here.y);
        worst = worse(worst, error.z, size.z, mask.z, here.z);
        errors[i] = worse(worst, error.w, size.w, mask.w, here.w);
#endif
    }
#ifdef REDUCES
    lane_values[lane] = own;
    barrier();
    if (lane == 0u) {
        vec2 all = vec2(0.0);
        for (uint k = 0u; k < LANES; k++) {
#ifdef PRODUCT
            all += lane_values[k];
#endif
#ifdef MOVE
            all = max(all, lane_values[k]);
#endif
        }
        partials[gl_WorkGroupID.x] = all;
    }
#endif
#endif
}
