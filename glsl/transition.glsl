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
    vec4 share = max(vec4(0.0), vec4(1.0) - elapsed / t_max);
    return mix(vec4(0.0), share, greaterThan(t_max, vec4(0.0)));
}

// r^p for p = 1 or 2.
vec4 remaining_span(vec4 r, vec4 power) {
    return r * mix(vec4(1.0), r, equal(power, vec4(2.0)));
}

// r^(p-1), 0 once settled: the rate of a transition over its rate at the start.
vec4 remaining_rate(vec4 r, vec4 power) {
    vec4 rate = mix(vec4(1.0), r, equal(power, vec4(2.0)));
    return mix(vec4(0.0), rate, greaterThan(r, vec4(0.0)));
}

// Superposes the gap and the rate of the transition under way with those of the new step.
TransitionState retarget_merge(TransitionState state, vec4 commanded, Material material) {
    vec4 change = commanded - state.target;
    Branch branch = branch_of(state.span, material);
    vec4 r = remaining_time(state.elapsed, branch.t_max);
    vec4 gap = state.span * remaining_span(r, branch.power) + change;
    vec4 rate = state.span * remaining_rate(r, branch.power) + change;

    // Where the gap and its rate disagree in sign, or the gap outruns its rate, no point of the curve has both.
    bvec4 opposed = lessThanEqual(gap * rate, vec4(0.0));
    bvec4 outrun = lessThan(abs(rate), abs(gap));
    vec4 merged_r = mix(mix(gap / rate, vec4(1.0), outrun), vec4(1.0), opposed);

    Branch next = branch_of(gap, material);
    vec4 span = gap / remaining_span(merged_r, next.power);
    vec4 elapsed = next.t_max * (vec4(1.0) - merged_r);

    bvec4 unchanged = equal(change, vec4(0.0));
    return TransitionState(
        commanded,
        mix(span, state.span, unchanged),
        mix(elapsed, state.elapsed, unchanged)
    );
}

// Starts afresh from the present temperature at every change of the target.
TransitionState retarget_restart(TransitionState state, vec4 commanded, Material material) {
    vec4 change = commanded - state.target;
    Branch branch = branch_of(state.span, material);
    vec4 r = remaining_time(state.elapsed, branch.t_max);
    vec4 gap = state.span * remaining_span(r, branch.power) + change;
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
