// Thermal inertia along a response function of any shape, for one node (NUMERICS.md 1).
// Twin: src/thermal/transition.rs; the merge is derived in src/thermal/function/phase.rs.

struct ShapedState {
    float target; // K, or (100 K)^4 where the transition moves the fourth power
    float span;   // target - origin
    int elapsed;  // ticks of the clock
};

// The clock counts in whole ticks, powers of two of a step, of which `t_max` has between 2^30 and 2^31: finer than f32
// by 2^7, and without its rounding, which under a jitter of the target always falls the same way.
struct ShapedBranch {
    bool heating;
    float share; // of t_max, that one tick is; 0 where t_max is 0
    float t_max; // steps
    float ticks; // of a step
    int end;     // t_max in ticks
};

// Low bits of a clock that hold no time.
#ifdef RESTART
const int RESIDUE = 127;
#else
const int RESIDUE = 0;
#endif

ShapedBranch shaped_branch(float span, Material material) {
    bool heating = span >= 0.0;
    float t_max = heating ? material.heating_t_max : material.cooling_t_max;
    // 2^(31 - n) for t_max in [2^(n-1), 2^n).
    float ticks = uintBitsToFloat((284u - (floatBitsToUint(max(t_max, 1e-20)) >> 23u)) << 23u);
    int end = int(t_max * ticks) & ~RESIDUE;
    return ShapedBranch(heating, end > 0 ? 1.0 / float(end) : 0.0, t_max, ticks, end);
}

// Share of the duration gone; 1 once settled and where the response is immediate.
float time_gone(int elapsed, ShapedBranch branch) {
    return branch.end > 0 ? float(min(elapsed, branch.end)) * branch.share : 1.0;
}

// Share of the duration left, as exact near its end as the share gone is near its start.
float time_left(int elapsed, ShapedBranch branch) {
    return float(max(branch.end - elapsed, 0)) * branch.share;
}

#ifdef MERGE
// A shift over which the fall of w is summed from its rates rather than taken as a difference.
const float SHORT_SHIFT = 1e-2;

// The clock that shows a phase with so much more time left, in shares of t_max.
int shifted_clock(int elapsed, float shift, ShapedBranch branch) {
    float ticks = clamp(round(shift * float(branch.end)), -2147483520.0, 2147483520.0);
    return clamp(elapsed - int(ticks), 0, branch.end);
}

// f' times the wanted gap less w times the wanted rate (merge_turns.glsl) at a point `shift` away from one where it is known. Over a short shift it changes by
// what the rates and bends at both ends make of it (corrected trapezoidal rule), which has no cancellation; where they
// do not explain the change of the rate there is a corner in between.
float excess_at(ShapePoint near, ShapePoint here, float excess, float shift, float gap, float rate) {
    float faster = 0.5 * shift * (here.bend + near.bend);
    float more = shift * (0.5 * (here.rate + near.rate) - shift * (near.bend - here.bend) / 12.0);
    bool explained = abs(shift) < SHORT_SHIFT && abs(near.rate - here.rate - faster) < 1e-6 * (1.0 + near.rate);
    return explained ? excess + faster * gap - more * rate : near.rate * gap - near.left * rate;
}

// The state at another phase with the same temperature. `near` is the function at `beyond` less than the shift.
ShapedState shifted(
    ShapedState state, float change, ShapedBranch branch, ShapePoint here, ShapePoint near, float shift, float beyond
) {
    // The clock rounds; the span then makes up for the phase that it really shows.
    int elapsed = shifted_clock(state.elapsed, shift, branch);
    float shown = float(state.elapsed - elapsed) * branch.share;
    float further = beyond + (shown - shift);
    float there = near.left + further * (near.rate + 0.5 * further * near.bend);
    float rate_there = near.rate + further * near.bend;
    // Rise of w from here to there, by the corrected trapezoidal rule where its ends are near.
    float summed = shown * (0.5 * (here.rate + rate_there) - shown * (near.bend - here.bend) / 12.0);
    float gap = state.span * here.left + change;
    float faster = 0.5 * shown * (here.bend + near.bend);
    // Across a corner of the rate the rule is off.
    bool explained = abs(shown) < SHORT_SHIFT && abs(rate_there - here.rate - faster) < 3e-6 * (1.0 + rate_there);
    float span = explained ? state.span + (change - state.span * summed) / there : gap / there;
    bool too_flat = there < 1e-30;
    return ShapedState(state.target, too_flat ? gap / here.left : span, too_flat ? state.elapsed : elapsed);
}

// Most steps by which a change of the gap is followed (pace.glsl).
const float MOST_PARTS = 64.0;

// A stretch on which the relative rate h is monotone: shares of the time left, and h / (1 + h), at its ends.
struct Stretch {
    float low;
    float low_z;
    float high;
    float high_z;
};

// Change of the target, over the gap, from which a root on another stretch may be nearer.
const float STEP = 0.13;
// Square of a first step of Newton's method, over the distance to an end, after which none is needed.
const float EXACT_SHIFT = 1e-12;
// The same of a later step.
const float LAST_STEP = 1e-11;
// Longer than any step.
const float DISTANT = 2.0;
const int MAX_STEPS = 40;
#endif

#include "functions.glsl"

#ifdef MERGE
// Superposes the gap and the rate of the transition under way with those of the new step.
ShapedState shaped_merge(ShapedState state, float commanded, Material material) {
    float change = commanded - state.target;
    ShapedBranch branch = shaped_branch(state.span, material);
    float r = time_left(state.elapsed, branch);
    // What is over has no gap, whatever rounding leaves of the function's end.
    float left = r > 0.0 ? state.span * shape_at(branch.heating, time_gone(state.elapsed, branch), r).left : 0.0;
    float gap = left + change;
    bool goes_on = left * gap > 0.0;
    ShapedState merged = merge_on(state, change, branch);
    bool unchanged = change == 0.0;
    return ShapedState(
        commanded,
        unchanged ? state.span : (goes_on ? merged.span : gap),
        unchanged ? state.elapsed : (goes_on ? merged.elapsed : 0)
    );
}
#endif

#ifdef RESTART
// Span after a change, with what its rounding leaves (in 1/128 of its last place, from -64 to 63) in place of a clock
// at zero. A function that starts slowly changes the span by a few last places a tick, always rounded the same way.
ShapedState restarted(float commanded, float span, int residue, float change) {
    uint exponent = (floatBitsToUint(span) >> 23u) & 255u;
    float place = uintBitsToFloat((max(exponent, 24u) - 23u) << 23u);
    float places = change / place + float(residue) / 128.0;
    float whole = round(places);
    bool carried = abs(places) < 4e6;
    int rest = clamp(int(round((places - whole) * 128.0)), -64, 63);
    return ShapedState(commanded, carried ? span + whole * place : span + change, carried ? rest & RESIDUE : 0);
}

// Starts afresh from the present temperature at every change of the target.
ShapedState shaped_restart(ShapedState state, float commanded, Material material) {
    float change = commanded - state.target;
    ShapedBranch branch = shaped_branch(state.span, material);
    int clock = state.elapsed & ~RESIDUE;
    int residue = ((state.elapsed & RESIDUE) ^ 64) - 64;
    ShapePoint at = shape_at(branch.heating, time_gone(clock, branch), time_left(clock, branch));
    // In the first half the new span is a change of the old, by what was done; in the second it is what was left.
    ShapedState early = restarted(commanded, state.span, residue, change - state.span * at.done);
    ShapedState late = ShapedState(commanded, state.span * at.left + change, 0);
    bool unchanged = change == 0.0;
    return ShapedState(
        commanded,
        unchanged ? state.span : (at.done < at.left ? early.span : late.span),
        unchanged ? state.elapsed : (at.done < at.left ? early.elapsed : late.elapsed)
    );
}
#endif

// Lets time pass.
ShapedState shaped_advance(ShapedState state, float step, Material material) {
    ShapedBranch branch = shaped_branch(state.span, material);
    int ticks = min(int(min(step, branch.t_max) * branch.ticks) & ~RESIDUE, branch.end);
    return ShapedState(state.target, state.span, min(state.elapsed, branch.end - ticks) + ticks);
}

// What the present state has come to; exactly the target once settled.
float shaped_value(ShapedState state, Material material) {
    ShapedBranch branch = shaped_branch(state.span, material);
    int clock = state.elapsed & ~RESIDUE;
    ShapePoint at = shape_at(branch.heating, time_gone(clock, branch), time_left(clock, branch));
    float origin = state.target - state.span;
    return at.done < at.left ? origin + state.span * at.done : state.target - state.span * at.left;
}

// What a transition moves, of a temperature [K], and back.
#ifdef FOURTH_POWER
float of_temperature(float temperature) {
    float x = temperature * 0.01;
    return (x * x) * (x * x);
}
float to_temperature(float value) {
    return 100.0 * sqrt(sqrt(max(0.0, value)));
}
#else
float of_temperature(float temperature) {
    return temperature;
}
float to_temperature(float value) {
    return value;
}
#endif

// A node between ticks, as its buffers hold it: the target in K, the span in what the transition moves.
struct ShapedNode {
    float target;
    float span;
    int elapsed;
    float temperature; // K
};

// One tick of a node.
ShapedNode shaped_step(float target, float span, int elapsed, float commanded, float step, Material material) {
    ShapedState state = ShapedState(of_temperature(target), span, elapsed);
#ifdef MERGE
    state = shaped_merge(state, of_temperature(commanded), material);
#endif
#ifdef RESTART
    state = shaped_restart(state, of_temperature(commanded), material);
#endif
    state = shaped_advance(state, step, material);
    return ShapedNode(commanded, state.span, state.elapsed, to_temperature(shaped_value(state, material)));
}
