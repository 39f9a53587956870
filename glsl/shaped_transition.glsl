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
    int first;   // piece of its function
    int pieces;  // from either end
    float share; // of t_max, that one tick is; 0 where t_max is 0
    float scale; // square of a place in pieces from an end, over the ticks to that end
    int step;    // that passes, in ticks
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
const int FEWEST = 2048;
// Added to the place of a corner in the last coefficient of its piece.
const float CORNER = 16.0;

ShapedBranch shaped_branch(float function, float t_max, float step) {
    // Written by src/gpu/shapes.rs: 16 times the place of the first piece, and how often there are twice as many.
    int place = int(function);
    int pieces = FEWEST << uint(place & 15);
    // 2^(31 - n) for t_max in [2^(n-1), 2^n).
    float ticks = uintBitsToFloat((284u - (floatBitsToUint(max(t_max, 1e-20)) >> 23u)) << 23u);
    int end = int(t_max * ticks) & ~RESIDUE;
    float share = end > 0 ? 1.0 / float(end) : 0.0;
    return ShapedBranch(
        place / 16 * 2 * FEWEST,
        pieces,
        share,
        2.0 * share * float(pieces) * float(pieces),
        min(int(min(step, t_max) * ticks) & ~RESIDUE, end),
        end
    );
}

// Both branches of a material in a step, found once for four nodes.
struct ShapedBranches {
    ShapedBranch heating;
    ShapedBranch cooling;
};

ShapedBranches shaped_branches(Material material, float step) {
    return ShapedBranches(
        shaped_branch(material.heating_function, material.heating_t_max, step),
        shaped_branch(material.cooling_function, material.cooling_t_max, step)
    );
}

// The branch that a span runs on: heating where it is zero or positive.
ShapedBranch branch_of(float span, ShapedBranches both) {
    bool heating = span >= 0.0;
    return ShapedBranch(
        heating ? both.heating.first : both.cooling.first,
        heating ? both.heating.pieces : both.cooling.pieces,
        heating ? both.heating.share : both.cooling.share,
        heating ? both.heating.scale : both.cooling.scale,
        heating ? both.heating.step : both.cooling.step,
        heating ? both.heating.end : both.cooling.end
    );
}

// A function at one moment.
struct ShapePoint {
    bool start;  // whether the start is the nearer end
    bool done;   // whether less is done than left
    float small; // the smaller of what is done and what is left
    float place; // distance to the nearer end in pieces
    float slope; // of what is done, or at the end of what is left, by the place
    float bend;  // of the slope
};

ShapePoint shape_at(int elapsed, ShapedBranch branch) {
    int left = branch.end - elapsed;
    bool start = elapsed < left;
    float place = sqrt(float(start ? elapsed : left) * branch.scale);
    int cell = min(int(place), branch.pieces - 1);
    float t = place - float(cell);
    vec4 c = shapes[branch.first + cell + (start ? 0 : branch.pieces)];
    bool corner = c.w > 0.5 * CORNER;
    float after = max(0.0, t - (c.w - CORNER));
    return ShapePoint(
        start,
        start == (c.x >= 0.0),
        abs(c.x + t * c.y + (corner ? c.z * after : t * t * (c.z + t * c.w))),
        place,
        c.y + (corner ? (after > 0.0 ? c.z : 0.0) : t * (2.0 * c.z + 3.0 * t * c.w)),
        corner ? 0.0 : 2.0 * c.z + 6.0 * t * c.w
    );
}

float left_at(ShapePoint at) {
    return at.done ? 1.0 - at.small : at.small;
}

#ifdef MERGE
// The same curve from another phase, with the same temperature.
ShapedState retarget_merge(ShapedState state, float commanded, ShapedBranch branch) {
    float change = commanded - state.target;
    ShapePoint here = shape_at(state.elapsed, branch);
    float left = state.span * left_at(here);
    float gap = left + change;

    // By r' - r in ticks: the clock rounds, and the span makes up for the phase that it really shows.
    float r = float(branch.end - state.elapsed) * branch.share;
    float moved = round(r * change * float(state.elapsed) / (left + change * r));
    int elapsed = clamp(state.elapsed - int(moved), 0, branch.end);
    ShapePoint there = shape_at(elapsed, branch);
    // Where the curve is too flat at its end for a span to reach the gap from there, the phase is kept.
    bool too_flat = left_at(there) < 1e-30;
    float left_there = too_flat ? left_at(here) : left_at(there);
    float inverse = 1.0 / left_there;

    // Over a short shift what is left changes by what its slopes say (corrected trapezoidal rule, exact in a cubic), which
    // has no cancellation; where they do not explain each other there is a corner in between. A longer way could hide one.
    float later = float(elapsed - state.elapsed) * branch.scale;
    float way = (here.start ? later : -later) / (here.place + there.place);
    float rise = way * (0.5 * (here.slope + there.slope) - way * (there.bend - here.bend) * 0.0833333333);
    float mismatch = way * (there.slope - here.slope - 0.5 * way * (here.bend + there.bend));
    bool explained = !too_flat && abs(way) < 2.0 && abs(mismatch) < 6e-8 * left_there && here.start == there.start;
    float short_span = state.span + (change - state.span * (here.start ? -rise : rise)) * inverse;

    // What is over has no gap, whatever rounding leaves of the function's end.
    bool goes_on = left * gap > 0.0 && state.elapsed < branch.end;
    float span = explained ? short_span : gap * inverse;
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
// at zero. A function that starts slowly changes the span by a few last places a step, always rounded the same way.
ShapedState restarted(float commanded, float span, int residue, float change) {
    uint exponent = (floatBitsToUint(span) >> 23u) & 255u;
    float place = uintBitsToFloat((max(exponent, 24u) - 23u) << 23u);
    float places = change / place + float(residue) * 0.0078125;
    float whole = round(places);
    bool carried = abs(places) < 4e6;
    int rest = clamp(int(round((places - whole) * 128.0)), -64, 63);
    return ShapedState(commanded, carried ? span + whole * place : span + change, carried ? rest & RESIDUE : 0);
}

// Starts afresh from the present temperature at every change of the target.
ShapedState retarget_restart(ShapedState state, float commanded, ShapedBranch branch) {
    float change = commanded - state.target;
    int clock = state.elapsed & ~RESIDUE;
    int residue = ((state.elapsed & RESIDUE) ^ 64) - 64;
    ShapePoint at = shape_at(clock, branch);
    // While less is done than left the new span is a change of the old, by what was done; later it is what was left.
    ShapedState early = restarted(commanded, state.span, residue, change - state.span * at.small);
    ShapedState late = ShapedState(commanded, state.span * left_at(at) + change, 0);
    bool unchanged = change == 0.0;
    return ShapedState(
        commanded,
        unchanged ? state.span : (at.done ? early.span : late.span),
        unchanged ? state.elapsed : (at.done ? early.elapsed : late.elapsed)
    );
}
#endif

// Lets time pass.
ShapedState advance(ShapedState state, ShapedBranch branch) {
    int elapsed = min(state.elapsed, branch.end - branch.step) + branch.step;
    bool over = branch.end - elapsed <= branch.end >> OVER_SHIFT;
    return ShapedState(state.target, state.span, over ? branch.end : elapsed);
}

// What the present state has come to; exactly the target once settled.
float transition_value(ShapedState state, ShapedBranch branch) {
    ShapePoint at = shape_at(state.elapsed & ~RESIDUE, branch);
    return (at.done ? state.target - state.span : state.target) + state.span * (at.done ? at.small : -at.small);
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

// A node between steps, as its buffers hold it: the target in K, the span in what the transition moves.
struct ShapedNode {
    float target;
    float span;
    int elapsed;
    float temperature; // K
};

// One step of a node.
ShapedNode transition_step(float target, float span, int elapsed, float commanded, ShapedBranches both) {
    ShapedState state = ShapedState(of_temperature(target), span, elapsed);
#ifdef MERGE
    state = retarget_merge(state, of_temperature(commanded), branch_of(span, both));
#endif
#ifdef RESTART
    state = retarget_restart(state, of_temperature(commanded), branch_of(span, both));
#endif
    ShapedBranch branch = branch_of(state.span, both);
    state = advance(state, branch);
    return ShapedNode(commanded, state.span, state.elapsed, to_temperature(transition_value(state, branch)));
}
