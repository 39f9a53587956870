// Thermal inertia of the paper with a target that may move, for four nodes at a time (NUMERICS.md 1).
// Twin: src/thermal/transition.rs.

struct TransitionState {
    vec4 target;  // K
    vec4 span;    // target - old, K
    vec4 elapsed; // steps
};

// Power and duration of the branch that each node is on: heating where the span is not negative.
struct Branch {
    vec4 power;
    vec4 t_max;
};

Branch branch_of(vec4 span, Material material) {
    bvec4 heating = greaterThanEqual(span, vec4(0.0));
    return Branch(
        mix(vec4(material.cooling_function), vec4(material.heating_function), heating),
        mix(vec4(material.cooling_t_max), vec4(material.heating_t_max), heating)
    );
}

// Share of the duration that is left, 1 at the start; 0 once settled and where the response is immediate.
vec4 remaining_time(vec4 elapsed, vec4 t_max) {
    return mix(vec4(0.0), vec4(1.0) - elapsed / t_max, lessThan(elapsed, t_max));
}

// r^p for p = 1 or 2.
vec4 remaining_span(vec4 r, vec4 power) {
    return r * mix(vec4(1.0), r, equal(power, vec4(2.0)));
}

// A phase shift over which what is left is summed from its change rather than computed anew.
const float SHORT_SHIFT_OF_POWER = 1e-2;

// Superposes the gap and the rate of the transition under way with those of the new step. The new phase u/q of
// NUMERICS.md 1 is found as a shift of the old one, and the new span as a change of the old: both are exact where the
// target moves little, however often it does.
TransitionState retarget_merge(TransitionState state, vec4 commanded, Material material) {
    vec4 change = commanded - state.target;
    Branch branch = branch_of(state.span, material);
    vec4 r = remaining_time(state.elapsed, branch.t_max);
    vec4 share = remaining_span(r, branch.power);
    vec4 left = state.span * share;
    vec4 gap = left + change;

    // u/q - r, and what the rounded clock makes of it.
    vec4 shift = r * change * (vec4(1.0) - r) / (left + change * r);
    vec4 elapsed = min(branch.t_max, max(vec4(0.0), state.elapsed - branch.t_max * shift));
    shift = (state.elapsed - elapsed) / branch.t_max;
    vec4 rise = shift * mix(vec4(1.0), r + r + shift, equal(branch.power, vec4(2.0)));
    vec4 there = share + rise;
    bvec4 short_shift = lessThan(abs(shift), vec4(SHORT_SHIFT_OF_POWER));
    vec4 span = mix(gap / there, state.span + (change - state.span * rise) / there, short_shift);

    // A change of direction, or nothing left of the old gap: a fresh transition. A clock at its end: nothing left.
    bvec4 goes_on = greaterThan(left * gap, vec4(0.0));
    bvec4 over = lessThanEqual(there, vec4(0.0));
    span = mix(gap, mix(span, vec4(0.0), over), goes_on);
    elapsed = mix(vec4(0.0), elapsed, goes_on);

    bvec4 unchanged = equal(change, vec4(0.0));
    return TransitionState(
        commanded,
        mix(span, state.span, unchanged),
        mix(elapsed, state.elapsed, unchanged)
    );
}

// Starts afresh from the present temperature at every change of the target. In the first half of a transition the new
// span is a change of the old, by what was done; in the second it is what was left.
TransitionState retarget_restart(TransitionState state, vec4 commanded, Material material) {
    vec4 change = commanded - state.target;
    Branch branch = branch_of(state.span, material);
    vec4 r = remaining_time(state.elapsed, branch.t_max);
    // Of the clock, not of r: near the start, 1 - r has lost it.
    vec4 s = mix(vec4(1.0), min(vec4(1.0), state.elapsed / branch.t_max), greaterThan(branch.t_max, vec4(0.0)));
    vec4 done = s * mix(vec4(1.0), vec4(1.0) + r, equal(branch.power, vec4(2.0)));
    vec4 left = state.span * remaining_span(r, branch.power);
    vec4 gap = mix(left + change, state.span + (change - state.span * done), lessThan(done, vec4(0.5)));
    bvec4 unchanged = equal(change, vec4(0.0));
    return TransitionState(
        commanded,
        mix(gap, state.span, unchanged),
        mix(vec4(0.0), state.elapsed, unchanged)
    );
}

// Lets time pass.
TransitionState advance(TransitionState state, float step, Material material) {
    vec4 t_max = branch_of(state.span, material).t_max;
    return TransitionState(state.target, state.span, min(state.elapsed + vec4(step), t_max));
}

// Temperature of the present state [K]; exactly the target once settled.
vec4 transition_temperature(TransitionState state, Material material) {
    Branch branch = branch_of(state.span, material);
    vec4 r = remaining_time(state.elapsed, branch.t_max);
    return state.target - state.span * remaining_span(r, branch.power);
}
