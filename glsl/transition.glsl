// Transition with thermal inertia and a moving target, for four nodes at a time (docs/numerics.md, section 1). Twin:
// src/thermal/transition.rs.

struct TransitionState {
    vec4 target;   // K
    vec4 span;     // target - old, K
    ivec4 elapsed; // clock units
};

// Power and clock of each node's branch, which is heating if the span is not negative. The clock is an integer. Its
// unit is a power of two of a step, chosen so that `t_max` has 2^30 to 2^31 units. It is finer than f32 and has no
// rounding error, which would decide when a linear transition ends.
struct Branch {
    vec4 power;
    vec4 t_max; // steps
    vec4 ticks; // clock units per step
    ivec4 end;  // t_max in clock units
};

// A transition is over if at most 2^-22 of its duration remains.
const int OVER_SHIFT = 22;
// Low bits of the clock that do not hold time.
#ifdef RESTART
const int RESIDUE = 127;
#else
const int RESIDUE = 0;
#endif

Branch branch_of(vec4 span, Material material) {
    bvec4 heating = greaterThanEqual(span, vec4(0.0));
    vec4 t_max = mix(vec4(material.cooling_t_max), vec4(material.heating_t_max), heating);
    // 2^(31 - n) for t_max in [2^(n-1), 2^n).
    uvec4 exponent = floatBitsToUint(max(t_max, vec4(1e-20))) >> uvec4(23u);
    vec4 ticks = uintBitsToFloat((uvec4(284u) - exponent) << uvec4(23u));
    return Branch(
        mix(vec4(material.cooling_function), vec4(material.heating_function), heating),
        t_max,
        ticks,
        ivec4(t_max * ticks) & ivec4(~RESIDUE)
    );
}

// Shares of the duration that are over and that remain. The smaller one is exact.
struct Time {
    vec4 gone;
    vec4 left; // 1 at the start, 0 at the end and for an immediate response
};

Time time_of(ivec4 elapsed, Branch branch) {
    vec4 scale = vec4(max(branch.end, ivec4(1)));
    return Time(vec4(elapsed) / scale, vec4(branch.end - elapsed) / scale);
}

// r^p for p = 1 or 2.
vec4 remaining_span(vec4 r, vec4 power) {
    return r * mix(vec4(1.0), r, equal(power, vec4(2.0)));
}

#if defined(MERGE) || defined(RESTART)
// Change of a span, in whole units in the last place of the larger span.
struct Places {
    vec4 place;
    vec4 number;
};

Places places_of(vec4 change, vec4 span) {
    uvec4 exponent = (floatBitsToUint(max(abs(span), abs(change))) >> uvec4(23u)) & uvec4(255u);
    uvec4 place = max(exponent, uvec4(24u)) - uvec4(23u);
    vec4 inverse = uintBitsToFloat((uvec4(254u) - place) << uvec4(23u));
    return Places(uintBitsToFloat(place << uvec4(23u)), change * inverse);
}
#endif

#ifdef MERGE
// Phase shifts up to this size update the remaining share by its change instead of computing it again.
const float SHORT_SHIFT_OF_POWER = 1e-2;

// Merge rule: adds the gap and the rate of the present transition to those of the new step. It finds the new phase u/q
// as a shift of the old phase, and the new span as a change of the old span. Both are exact for small moves of the
// target. The clock, which is finer, takes the rounding error of the span, because over a thousand changes the error
// would grow to several last places.
TransitionState retarget_merge(TransitionState state, vec4 commanded, Material material) {
    vec4 change = commanded - state.target;
    Branch branch = branch_of(state.span, material);
    Time time = time_of(state.elapsed, branch);
    vec4 r = time.left;
    vec4 share = remaining_span(r, branch.power);
    vec4 left = state.span * share;
    vec4 gap = left + change;

    // u/q - r, and its rounding to clock units.
    vec4 shift = r * change * time.gone / (left + change * r);
    ivec4 moved = clamp(ivec4(round(shift * vec4(branch.end))), state.elapsed - branch.end, state.elapsed);
    shift = vec4(moved) / vec4(max(branch.end, ivec4(1)));
    vec4 rise = shift * mix(vec4(1.0), r + r + shift, equal(branch.power, vec4(2.0)));
    vec4 there = share + rise;
    bvec4 short_shift = lessThan(abs(shift), vec4(SHORT_SHIFT_OF_POWER));
    Places places = places_of((change - state.span * rise) / there, state.span);
    vec4 whole = round(places.number);
    vec4 changed = state.span + whole * places.place;
    vec4 span = mix(gap / there, changed, short_shift);
    vec4 rest = (places.number - whole) * places.place * (r + shift) / (changed * branch.power);
    ivec4 extra = ivec4(round(clamp(rest * vec4(branch.end), vec4(-256.0), vec4(256.0))));
    moved += mix(ivec4(0), extra, short_shift);

    // The transition starts afresh if the direction changes, the old gap is closed or the clock is at its end.
    bvec4 goes_on = greaterThan(left * gap, vec4(0.0));
    bvec4 over = lessThanEqual(there, vec4(0.0));
    span = mix(gap, mix(span, vec4(0.0), over), goes_on);
    ivec4 elapsed = mix(ivec4(0), clamp(state.elapsed - moved, ivec4(0), branch.end), goes_on);

    bvec4 unchanged = equal(change, vec4(0.0));
    return TransitionState(
        commanded,
        mix(span, state.span, unchanged),
        mix(elapsed, state.elapsed, unchanged)
    );
}
#endif

#ifdef RESTART
// Restart rule: starts a new transition from the present temperature whenever the target is more than MOVED [K] away
// from the stored one, which src/thermal/transition.rs defines. In the first half of
// a transition the new span is the old one plus the completed part; in the second half it is the remaining part. The
// rounding of the change, -64 to 63 of 1/128 of the span's last place, is stored in the unused bits of the clock.
// Without it a thousand changes would add up to several last places.
TransitionState retarget_restart(TransitionState state, vec4 commanded, Material material) {
    commanded = mix(commanded, state.target, lessThanEqual(abs(commanded - state.target), vec4(MOVED)));
    vec4 change = commanded - state.target;
    Branch branch = branch_of(state.span, material);
    Time time = time_of(state.elapsed & ivec4(~RESIDUE), branch);
    vec4 residue = vec4(((state.elapsed & ivec4(RESIDUE)) ^ ivec4(64)) - ivec4(64));
    vec4 done = time.gone * mix(vec4(1.0), vec4(1.0) + time.left, equal(branch.power, vec4(2.0)));

    Places places = places_of(change - state.span * done, state.span);
    vec4 number = places.number + residue / vec4(128.0);
    vec4 whole = round(number);
    ivec4 rest = clamp(ivec4(round((number - whole) * vec4(128.0))), ivec4(-64), ivec4(63)) & ivec4(RESIDUE);
    // By the share that remains, which is 0 for an immediate response. Nothing of such a branch counts as done either.
    vec4 share = remaining_span(time.left, branch.power);
    bvec4 early = greaterThan(share, vec4(0.5));

    vec4 late = state.span * share + change;
    bvec4 unchanged = equal(change, vec4(0.0));
    return TransitionState(
        commanded,
        mix(mix(late, state.span + whole * places.place, early), state.span, unchanged),
        mix(mix(ivec4(0), rest, early), state.elapsed, unchanged)
    );
}
#endif

// Advances the clock by `step` steps.
TransitionState advance(TransitionState state, float step, Material material) {
    Branch branch = branch_of(state.span, material);
    ivec4 ticks = min(ivec4(min(vec4(step), branch.t_max) * branch.ticks) & ivec4(~RESIDUE), branch.end);
    ivec4 elapsed = min(state.elapsed, branch.end - ticks) + ticks;
    bvec4 over = lessThanEqual(branch.end - elapsed, branch.end >> uvec4(OVER_SHIFT));
    return TransitionState(state.target, state.span, mix(elapsed, branch.end, over));
}

// Temperature of the present state [K]; exactly the target once settled.
vec4 transition_temperature(TransitionState state, Material material) {
    Branch branch = branch_of(state.span, material);
    vec4 r = time_of(state.elapsed & ivec4(~RESIDUE), branch).left;
    return state.target - state.span * remaining_span(r, branch.power);
}
