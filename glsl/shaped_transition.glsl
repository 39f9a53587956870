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
    uint shape;
    float t_max; // steps
    float ticks; // of a step
    int end;     // t_max in ticks
};

// Where the relative rate turns, small changes of the target leave the phase in place (phase.rs).
const float NEAR = 0.01;
const float FAR = 0.03;
const float SMALL = 2e-4;
const float LARGE = 2e-3;
// A shift of the phase that is as exact by one step of Newton's method as f32 makes it.
const float EXACT_SHIFT = 1e-5;
// A step of Newton's method after which none is needed.
const float LAST_STEP = 1e-4;
// A shift over which the fall of w is summed from its rates rather than taken as a difference.
const float SHORT_SHIFT = 1e-2;
// Larger than any shift: the function near the root is not known yet.
const float DISTANT = 2.0;
const int MAX_STEPS = 40;
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
    return ShapedBranch(
        uint(heating ? material.heating_function : material.cooling_function), t_max, ticks, int(t_max * ticks) & ~RESIDUE
    );
}

// Share of the duration gone; 1 once settled and where the response is immediate.
float time_gone(int elapsed, ShapedBranch branch) {
    return branch.end > 0 ? float(min(elapsed, branch.end)) / float(branch.end) : 1.0;
}

// Share of the duration left, as exact near its end as the share gone is near its start.
float time_left(int elapsed, ShapedBranch branch) {
    return branch.end > 0 ? float(max(branch.end - elapsed, 0)) / float(branch.end) : 0.0;
}

// A gap and its rate, in spans: what the merged transition must have.
struct Wanted {
    float gap;
    float rate;
};

// z = h / (1 + h) of a point less that of the wanted gap and rate; at the very end h is infinite.
float excess(ShapePoint at, Wanted wanted) {
    float sum = at.rate + at.left;
    float scale = 1.0 / (wanted.gap + wanted.rate);
    float e = (at.rate * wanted.gap - at.left * wanted.rate) * scale / max(sum, 1e-37);
    return sum > 0.0 ? e : wanted.gap * scale;
}

float excess_slope(ShapePoint at) {
    float sum = max(at.rate + at.left, 1e-18);
    return (at.bend * at.left - at.rate * at.rate) / (sum * sum);
}

// A phase as a shift of the share of the time left, and the function near it.
struct Phase {
    float shift;
    ShapePoint near;
    float beyond; // shift less that of `near`
};

// The root of `excess` between two shifts: Newton's method, halving the bracket where it leaves it.
// `rises`: whether the excess rises with the shift.
Phase solve_phase(
    Shape shape, float s, float r, ShapePoint here, Wanted wanted,
    float first, float low, float high, bool rises, bool sought
) {
    Phase phase = Phase(clamp(first, low, high), here, 0.0);
    phase.beyond = phase.shift;
    bool moving = sought && abs(first) > EXACT_SHIFT;
    for (int i = 0; i < MAX_STEPS && moving; i++) {
        phase.near = shape_at(shape, min(1.0, max(0.0, s - phase.shift)), min(1.0, max(0.0, r + phase.shift)));
        float e = excess(phase.near, wanted);
        bool past = (e > 0.0) == rises;
        high = past ? phase.shift : high;
        low = past ? low : phase.shift;
        float slope = excess_slope(phase.near);
        float step = slope == 0.0 ? 2.0 : -e / slope;
        float next = phase.shift + step;
        bool inside = next >= low && next <= high;
        float middle = 0.5 * (low + high);
        next = inside ? next : middle;
        phase.beyond = next - phase.shift;
        moving = abs(phase.beyond) > (inside ? LAST_STEP : 1e-7);
        phase.shift = next;
    }
    return phase;
}

// The phase at which the transition goes on: a shift of the share of the time left.
Phase merged_phase(Shape shape, float s, float r, ShapePoint here, float change) {
    Wanted wanted = Wanted(here.left + change, here.rate + change * shape.start_rate);

    // The stretch around r on which the relative rate is monotone.
    float z = here.rate / max(here.rate + here.left, 1e-37);
    float low = 0.0;
    float low_z = 2.0; // at the very end: out of reach for no z
    float high = 1.0;
    float high_z = shape.start_rate / (1.0 + shape.start_rate);
    for (uint i = 0u; i < shape.turns; i++) {
        vec4 turn = shapes[shape.first + SHAPE_TURNS + i];
        bool below = turn.x < r;
        low_z = below ? turn.y : low_z;
        low = below ? turn.x : low;
        bool nearest = !below && turn.x < high;
        high_z = nearest ? turn.y : high_z;
        high = nearest ? turn.x : high;
    }

    // How far z must go, without cancellation.
    float sum = max(here.rate + here.left, 1e-37);
    float far = change * (shape.start_rate * here.left - here.rate) / ((wanted.gap + wanted.rate) * sum);
    bool rises = high_z > low_z;
    bool upwards = (far > 0.0) == rises;
    float border_z = upwards ? high_z : low_z;
    bool reachable = far > 0.0 ? z + far <= border_z : z + far >= border_z;
    bool sought = wanted.rate >= 0.0 && far != 0.0 && reachable;
    float slope = excess_slope(here);
    float first = slope == 0.0 ? 2.0 : far / slope;
    first = sought ? first : 0.0;
    first = (first > 0.0) == upwards ? first : (upwards ? high - r : low - r);
    Phase phase = solve_phase(
        shape, s, r, here, wanted, first, upwards ? 0.0 : low - r, upwards ? high - r : 0.0, rises, sought
    );

    // Another stretch may have a nearer root.
    float border = min(high < 1.0 ? high - r : 2.0, low > 0.0 ? r - low : 2.0);
    bool look = sought && abs(phase.shift) > border;
    float aim = z + far;
    for (uint i = 0u; i <= shape.turns && look; i++) {
        vec4 from = i == 0u ? vec4(0.0, 2.0, 0.0, 0.0) : shapes[shape.first + SHAPE_TURNS + i - 1u];
        vec4 to = i == shape.turns ? vec4(1.0, shape.start_rate / (1.0 + shape.start_rate), 0.0, 0.0)
                                   : shapes[shape.first + SHAPE_TURNS + i];
        bool crosses = (from.y < aim) != (to.y < aim);
        float nearest = from.x >= r ? from.x - r : r - to.x; // below 0 on the stretch around r
        bool tried = crosses && nearest >= 0.0 && nearest < abs(phase.shift);
        float guess = 0.5 * (from.x + to.x) - r;
        Phase other = solve_phase(shape, s, r, here, wanted, guess, from.x - r, to.x - r, to.y > from.y, tried);
        bool better = tried && abs(other.shift) < abs(phase.shift);
        phase.shift = better ? other.shift : phase.shift;
        phase.beyond = better ? DISTANT : phase.beyond;
    }

    // Near an extremum of the relative rate small changes would not cancel their reverse.
    float by_place = clamp((border - NEAR) / (FAR - NEAR), 0.0, 1.0);
    float by_size = clamp((abs(change / wanted.gap) - SMALL) / (LARGE - SMALL), 0.0, 1.0);
    float weight = max(by_place, by_size);
    phase.beyond = weight < 1.0 ? DISTANT : phase.beyond;
    phase.shift = sought ? weight * phase.shift : 0.0;

    bool distant = sought && abs(phase.beyond) > LAST_STEP;
    for (int i = 0; i < 1 && distant; i++) {
        phase.near = shape_at(shape, min(1.0, max(0.0, s - phase.shift)), min(1.0, max(0.0, r + phase.shift)));
        phase.beyond = 0.0;
    }
    phase.beyond = sought ? phase.beyond : 0.0;
    return phase;
}

#ifdef MERGE
// Superposes the gap and the rate of the transition under way with those of the new step.
ShapedState shaped_merge(ShapedState state, float commanded, Material material) {
    float change = commanded - state.target;
    ShapedBranch branch = shaped_branch(state.span, material);
    Shape shape = shape_of(branch.shape);
    float s = time_gone(state.elapsed, branch);
    float r = time_left(state.elapsed, branch);
    ShapePoint here = shape_at(shape, s, r);
    float left = state.span * here.left;
    float gap = left + change;
    bool goes_on = left * gap > 0.0;
    Phase phase = merged_phase(shape, s, r, here, goes_on ? change / state.span : 0.0);

    // The clock rounds; the span then makes up for the phase that it really shows.
    int elapsed = clamp(state.elapsed - int(round(phase.shift * float(branch.end))), 0, branch.end);
    float shift = branch.end > 0 ? float(state.elapsed - elapsed) / float(branch.end) : 0.0;
    float beyond = phase.beyond + (shift - phase.shift);
    float there = phase.near.left + beyond * (phase.near.rate + 0.5 * beyond * phase.near.bend);
    float rate_there = phase.near.rate + beyond * phase.near.bend;
    // Rise of w from here to there, by the corrected trapezoidal rule where its ends are near.
    float summed = shift * (0.5 * (here.rate + rate_there) - shift * (phase.near.bend - here.bend) / 12.0);
    float span = abs(shift) < SHORT_SHIFT ? state.span + (change - state.span * summed) / there : gap / there;
    bool too_flat = there < 1e-30;
    elapsed = too_flat ? state.elapsed : elapsed;
    span = too_flat ? gap / here.left : span;

    bool unchanged = change == 0.0;
    return ShapedState(
        commanded,
        unchanged ? state.span : (goes_on ? span : gap),
        unchanged ? state.elapsed : (goes_on ? elapsed : 0)
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
    ShapePoint at = shape_at(shape_of(branch.shape), time_gone(clock, branch), time_left(clock, branch));
    // In the first half the new span is a change of the old, by what was done; in the second it is what was left.
    ShapedState early = restarted(commanded, state.span, residue, change - state.span * at.small);
    ShapedState late = ShapedState(commanded, state.span * at.small + change, 0);
    bool unchanged = change == 0.0;
    return ShapedState(
        commanded,
        unchanged ? state.span : (at.start ? early.span : late.span),
        unchanged ? state.elapsed : (at.start ? early.elapsed : late.elapsed)
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
    ShapePoint at = shape_at(shape_of(branch.shape), time_gone(clock, branch), time_left(clock, branch));
    float origin = state.target - state.span;
    return at.start ? origin + state.span * at.small : state.target - state.span * at.small;
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
