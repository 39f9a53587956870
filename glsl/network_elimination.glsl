// Newton's method for a small network with elimination in the order of src/gpu/network/schedule.rs. It uses the blocks
// and shared arrays of network_fused.comp.

// Flags of the last iteration: some node moved too far to stop, and too far for a rounding error.
shared uint moving;
shared uint rushing;
// Iterations after which small moves are the rounding of large heats at small conductance.
const uint ROUNDED_AFTER = 6u;

// Marks a neighbour that is not an unknown.
const uint NONE = 0xffffffffu;

// Writes the matrix and the right-hand side r = a F + b F_start + C/(alpha h) (c d + e d1) of every unknown. F is the
// heat [W] at `time`, d the change since the start of the sub-step, d1 the change of the first stage, and
// `inverse_step` is 1 / (alpha h). `work` has the rest at the start, d1, the change of the base since then, and
// F_start.
void assemble(uint lane, uint set, float time, vec4 weights, float inverse_step) {
    for (uint i = attempt.fill_begin + lane; i < attempt.fill_end; i += LANES) {
        matrix[i] = 0.0;
    }
    for (uint m = lane; m < attempt.unknowns; m += LANES) {
        uint node = schedule[attempt.nodes_at + m];
        float base_here = base[node];
        float rest_here = rest[set + node];
        float here = base_here + rest_here;
        vec2 power = heat[node];
        float space = attempt.space_temperature;
        float into = power.x + power.y * time;
        into += nodes[node].emission * radiated((space - base_here) - rest_here, space, here);
        uint end = nodes[node].links_end;
        for (uint k = nodes[node].links_begin; k < end; k++) {
            uint other = links[k].neighbour;
            float there = base[other] + rest[set + other];
            float difference = temperature_difference(base[other], rest[set + other], base_here, rest_here);
            into += links[k].conductance * difference + links[k].exchange * radiated(difference, there, here);
            uint entry = schedule[attempt.entries_at + k];
            if (entry != NONE) {
                matrix[entry] = -(links[k].conductance + links[k].exchange * radiative_slope(there));
            }
        }
        float stored = nodes[node].capacitance * inverse_step;
        matrix[m] = stored + nodes[node].conductance_sum + nodes[node].emission_sum * radiative_slope(max(here, 1.0));
        vec4 kept = work[node];
        float change = kept.z + (rest_here - kept.x);
        matrix[attempt.right_at + m] =
            weights.x * into + weights.y * kept.w + stored * (weights.z * change + weights.w * kept.y);
    }
    barrier();
}

// Solves the system in place. The solution replaces the right-hand side.
void eliminate(uint lane) {
    for (uint level = 0u; level < attempt.levels; level++) {
        uint at = attempt.levels_at + 2u * level;
        uint end = schedule[at + 2u];
        for (uint target = schedule[at] + lane; target < end; target += LANES) {
            uint where = attempt.targets_at + 2u * target;
            uint entry = schedule[where];
            uint terms_end = schedule[where + 3u];
            float value = matrix[entry];
            for (uint term = schedule[where + 1u]; term < terms_end; term++) {
                uint factors = attempt.terms_at + 3u * term;
                float share = matrix[schedule[factors]] / matrix[schedule[factors + 1u]];
                value -= share * matrix[schedule[factors + 2u]];
            }
            matrix[entry] = value;
        }
        barrier();
    }
    for (uint back = 0u; back < attempt.levels; back++) {
        uint at = attempt.levels_at + 2u * (attempt.levels - 1u - back);
        uint end = schedule[at + 3u];
        for (uint pivot = schedule[at + 1u] + lane; pivot < end; pivot += LANES) {
            uint where = attempt.pivots_at + 2u * pivot;
            uint unknown = schedule[where];
            uint uppers_end = schedule[where + 3u];
            float value = matrix[attempt.right_at + unknown];
            for (uint upper = schedule[where + 1u]; upper < uppers_end; upper++) {
                uint pair = attempt.uppers_at + 2u * upper;
                value -= matrix[schedule[pair]] * matrix[attempt.right_at + schedule[pair + 1u]];
            }
            matrix[attempt.right_at + unknown] = value / matrix[unknown];
        }
        barrier();
    }
}

// Moves the unknowns until they converge. Returns whether they do within `limit` iterations.
bool newton(uint lane, uint set, float time, vec4 weights, float inverse_step, uint limit) {
    bool settled = false;
    for (uint i = 0u; i < limit; i++) {
        if (settled) {
            break;
        }
        if (spent > LOOPS_AT_MOST) {
            break;
        }
        assemble(lane, set, time, weights, inverse_step);
        eliminate(lane);
        if (lane == 0u) {
            moving = 0u;
            rushing = 0u;
        }
        barrier();
        for (uint m = lane; m < attempt.unknowns; m += LANES) {
            uint node = schedule[attempt.nodes_at + m];
            float here = base[node] + rest[set + node];
            float change = matrix[attempt.right_at + m];
            // After a change of this size, quadratic convergence leaves 1e-10 of the temperature.
            if (!(abs(change) <= 5e-6 * abs(here))) {
                moving = 1u;
            }
            if (!(abs(change) <= 2e-5 * abs(here))) {
                rushing = 1u;
            }
            change = clamp(change, -0.75 * here, max(3.0 * here, 1000.0));
            // The rest stays small, so that the next iteration has exact temperature differences.
            vec2 moved = rebase(base[node], rest[set + node] + change);
#ifdef IMPLICIT
            work[node].z += moved.x - base[node];
#endif
            base[node] = moved.x;
            rest[set + node] = moved.y;
        }
        barrier();
        settled = moving == 0u;
        if (i >= ROUNDED_AFTER) {
            if (rushing == 0u) {
                settled = true;
            }
        }
        spent += attempt.loops_iteration;
        iterations += 1u;
    }
    return settled;
}
