// Thermal inertia along a response function of any shape, for one node. Twin: src/thermal/transition.rs, which evaluates
// the function itself; here it is pieces that src/thermal/function/pieces.rs makes when the scene loads, from `shapes`.

struct ShapedState {
    float target; // K, or (100 K)^4 where the transition moves the fourth power
    float span;   // target - origin
    int elapsed;  // ticks of the clock
};

// The clock counts in whole ticks, powers of two of a step, of which `t_max` has between 2^30 and 2^31: finer than f32
// by 2^7, and without its rounding, which under a jitter of the target always falls the same way.
struct ShapedBranch {
    uint first;  // piece of its function
    uint pieces; // from either end
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
// A transition with no more of its time left than this is over: 2^-22.
const int OVER_SHIFT = 22;

// Fewest pieces from either end; a function may have them doubled some times.
const uint FEWEST = 2048u;
// Added to the place of a corner in the last coefficient of its piece.
const float CORNER = 16.0;

ShapedBranch shaped_branch(float span, Material material) {
    bool heating = span >= 0.0;
    float t_max = heating ? material.heating_t_max : material.cooling_t_max;
    // Written by src/gpu/shapes.rs: 16 times the place of the first piece, and how often there are twice as many.
    uint place = uint(heating ? material.heating_function : material.cooling_function);
    // 2^(31 - n) for t_max in [2^(n-1), 2^n).
    float ticks = uintBitsToFloat((284u - (floatBitsToUint(max(t_max, 1e-20)) >> 23u)) << 23u);
    int end = int(t_max * ticks) & ~RESIDUE;
    uint first = (place >> 4u) * 2u * FEWEST;
    uint pieces = FEWEST << (place & 15u);
    return ShapedBranch(first, pieces, end > 0 ? 1.0 / float(end) : 0.0, t_max, ticks, end);
}

// Share of the duration left, as exact near its end as the share gone is near its start.
float time_left(int elapsed, ShapedBranch branch) {
    return float(max(branch.end - elapsed, 0)) * branch.share;
}

// A function at one moment.
struct ShapePoint {
    bool start;  // whether the start is the nearer end
    float small; // what is done since the start, or left until the end
    float place; // distance to the nearer end in pieces
    float slope; // of `small` by the place
    float bend;  // of the slope
};

ShapePoint shape_at(int elapsed, ShapedBranch branch) {
    int left = branch.end - elapsed;
    bool start = elapsed < left;
    float place = sqrt(2.0 * float(start ? elapsed : left) * branch.share) * float(branch.pieces);
    float cell = min(floor(place), float(branch.pieces - 1u));
    float t = place - cell;
    vec4 c = shapes[branch.first + uint(cell) + (start ? 0u : branch.pieces)];
    bool corner = c.w > 0.5 * CORNER;
    float after = max(0.0, t - (c.w - CORNER));
    return ShapePoint(
        start,
        c.x + t * c.y + (corner ? c.z * after : t * t * (c.z + t * c.w)),
        place,
        c.y + (corner ? (after > 0.0 ? c.z : 0.0) : t * (2.0 * c.z + 3.0 * t * c.w)),
        corner ? 0.0 : 2.0 * c.z + 6.0 * t * c.w
    );
}

float left_at(ShapePoint at) {
    return at.start ? 1.0 - at.small : at.small;
}

#ifdef MERGE
// The same curve from another phase, with the same temperature.
ShapedState retarget_merge(ShapedState state, float commanded, Material material) {
    float change = commanded - state.target;
    ShapedBranch branch = shaped_branch(state.span, material);
    ShapePoint here = shape_at(state.elapsed, branch);
    float left = state.span * left_at(here);
    float gap = left + change;

    // r' - r in ticks: the clock rounds, and the span makes up for the phase that it really shows.
    float r = time_left(state.elapsed, branch);
    float s = float(state.elapsed) * branch.share;
    float shift = r * change * s / (left + change * r);
    int moved = int(round(clamp(shift * float(branch.end), -2147483520.0, 2147483520.0)));
    int elapsed = clamp(state.elapsed - clamp(moved, state.elapsed - branch.end, state.elapsed), 0, branch.end);
    ShapePoint there = shape_at(elapsed, branch);
    float left_there = left_at(there);

    // Over a short shift what is left changes by what its slopes say (corrected trapezoidal rule, exact in a cubic), which
    // has no cancellation; where they do not explain each other there is a corner in between.
    float gone = 2.0 * float(elapsed - state.elapsed) * branch.share;
    float farther = (here.start ? gone : -gone) * float(branch.pieces) * float(branch.pieces);
    float way = farther / (here.place + there.place);
    float rise = way * (0.5 * (here.slope + there.slope) - way * (there.bend - here.bend) / 12.0);
    float mismatch = way * (there.slope - here.slope - 0.5 * way * (here.bend + there.bend));
    bool explained = abs(mismatch) < 6e-8 * left_there && here.start == there.start;
    float short_span = state.span + (change - state.span * (here.start ? -rise : rise)) / left_there;

    // What is over has no gap, whatever rounding leaves of the function's end.
    bool goes_on = left * gap > 0.0 && state.elapsed < branch.end;
    bool too_flat = left_there < 1e-30;
    float span = too_flat ? gap / left_at(here) : (explained ? short_span : gap / left_there);
    bool unchanged = change == 0.0;
    return ShapedState(
        commanded,
        unchanged ? state.span : (goes_on ? span : gap),
        unchanged ? state.elapsed : (goes_on ? (too_flat ? state.elapsed : elapsed) : 0)
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
ShapedState retarget_restart(ShapedState state, float commanded, Material material) {
    float change = commanded - state.target;
    ShapedBranch branch = shaped_branch(state.span, material);
    int clock = state.elapsed & ~RESIDUE;
    int residue = ((state.elapsed & RESIDUE) ^ 64) - 64;
    ShapePoint at = shape_at(clock, branch);
    // In the first half of the time the new span is a change of the old, by what was done; in the second it is what was left.
    ShapedState early = restarted(commanded, state.span, residue, change - state.span * at.small);
    ShapedState late = ShapedState(commanded, state.span * left_at(at) + change, 0);
    bool unchanged = change == 0.0;
    return ShapedState(
        commanded,
        unchanged ? state.span : (at.start ? early.span : late.span),
        unchanged ? state.elapsed : (at.start ? early.elapsed : late.elapsed)
    );
}
#endif

// Lets time pass.
ShapedState advance(ShapedState state, float step, Material material) {
    ShapedBranch branch = shaped_branch(state.span, material);
    int ticks = min(int(min(step, branch.t_max) * branch.ticks) & ~RESIDUE, branch.end);
    int elapsed = min(state.elapsed, branch.end - ticks) + ticks;
    bool over = branch.end - elapsed <= branch.end >> OVER_SHIFT;
    return ShapedState(state.target, state.span, over ? branch.end : elapsed);
}

// What the present state has come to; exactly the target once settled.
float transition_value(ShapedState state, Material material) {
    ShapedBranch branch = shaped_branch(state.span, material);
    ShapePoint at = shape_at(state.elapsed & ~RESIDUE, branch);
    return (at.start ? state.target - state.span : state.target) + state.span * (at.start ? at.small : -at.small);
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
ShapedNode transition_step(float target, float span, int elapsed, float commanded, float step, Material material) {
    ShapedState state = ShapedState(of_temperature(target), span, elapsed);
#ifdef MERGE
    state = retarget_merge(state, of_temperature(commanded), material);
#endif
#ifdef RESTART
    state = retarget_restart(state, of_temperature(commanded), material);
#endif
    state = advance(state, step, material);
    return ShapedNode(commanded, state.span, state.elapsed, to_temperature(transition_value(state, material)));
}
