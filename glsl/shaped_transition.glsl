// Transition with thermal inertia along a response function that is not a power, for one node. Twin: src/thermal/transition.rs,
// which evaluates the function itself. Here `shapes` holds the straight pieces that src/thermal/function/pieces.rs makes
// when the scene loads. Reading them is what such a function costs on lavapipe, so a step reads two: at the phase from
// which the gap closes, and at its end. Therefore the state is the gap and the phase, and no span.

// The clock is an integer. Its unit is a power of two of a step, chosen so that `t_max` has 2^30 to 2^31 units. It is
// finer than f32 by 2^7, and a held target adds no rounding error to it.
struct ShapedBranch {
    int first;   // piece of its function
    float share; // of t_max, that one clock unit is; 0 where t_max is 0
    float scale; // square of a place in pieces from an end, over the clock units to that end
    int step;    // that passes, in clock units
    int end;     // t_max in clock units
};

// Low bits of the clock. While the target is held, and under the rule `restart`, they hold the rounding of the gap in place
// of time. Where a target moves under `merge` they hold time, and read as a rounding they are a dither without bias.
const int RESIDUE = 31;
// A transition is over if at most 2^-22 of its duration remains.
const int OVER_SHIFT = 22;

// Pieces on either side of a function, and parts of a piece that is divided.
const int SIDE = 16384;
const float PARTS = 16.0;

ShapedBranch shaped_branch(float function, float t_max, float step) {
    // 2^(31 - n) for t_max in [2^(n-1), 2^n).
    float units = uintBitsToFloat((284u - (floatBitsToUint(max(t_max, 1e-20)) >> 23u)) << 23u);
    int end = int(t_max * units) & ~RESIDUE;
    float share = end > 0 ? 1.0 / float(end) : 0.0;
    return ShapedBranch(
        int(function),
        share,
        2.0 * share * float(SIDE) * float(SIDE),
        min(int(min(step, t_max) * units) & ~RESIDUE, end),
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

// The branch that a gap closes on: heating where it is zero or positive.
ShapedBranch branch_of(float gap, ShapedBranches both) {
    bool heating = gap >= 0.0;
    return ShapedBranch(
        heating ? both.heating.first : both.cooling.first,
        heating ? both.heating.share : both.cooling.share,
        heating ? both.heating.scale : both.cooling.scale,
        heating ? both.heating.step : both.cooling.step,
        heating ? both.heating.end : both.cooling.end
    );
}

// A function at one phase. The smaller one of the shares done and left is exact.
struct ShapePoint {
    float done;
    float left;
};

ShapePoint shape_at(int elapsed, ShapedBranch branch) {
    int remaining = branch.end - elapsed;
    bool start = elapsed < remaining;
    float place = sqrt(float(start ? elapsed : remaining) * branch.scale);
    int cell = min(int(place), SIDE - 1);
    float t = place - float(cell);
    vec2 c = shapes[branch.first + cell + (start ? 0 : SIDE)];
    // A piece that is divided tells where its parts are.
    while (c.y < 0.0) {
        float part = min(floor(PARTS * t), PARTS - 1.0);
        t = PARTS * t - part;
        c = shapes[branch.first + int(part - c.y)];
    }
    float small = abs(c.x + t * c.y);
    bool done = start == (c.x >= 0.0);
    return ShapePoint(done ? small : 1.0 - small, done ? 1.0 - small : small);
}

#ifdef MERGE
// Phase from which the same curve continues with a new gap. For a small move of the target it is a shift of the old one.
int phase_after(float gap, int elapsed, float change, ShapedBranch branch) {
    float r = float(branch.end - elapsed) * branch.share;
    float moved = round(r * change * float(elapsed) / (gap + change * r));
    // The transition starts afresh if the gap changes direction or was closed.
    return gap * (gap + change) > 0.0 ? clamp(elapsed - int(moved), 0, branch.end) : 0;
}
#endif

// Sum of a gap and a change in one step. The rounding (in 1/32 of the last place, from -16 to 15) comes from the residue
// and goes into it. Without it the gap, which changes by a few last places a step in a long or slow transition, would be
// rounded the same way over many steps.
struct Carried {
    float gap;
    int residue;
};

Carried carried(float gap, float change, int residue) {
    uint exponent = (floatBitsToUint(gap) >> 23u) & 255u;
    float place = uintBitsToFloat((max(exponent, 24u) - 23u) << 23u);
    float places = change / place + float(residue) * 0.03125;
    float whole = round(places);
    bool small = abs(places) < 4e6;
    int rest = clamp(int(round((places - whole) * 32.0)), -16, 15);
    return Carried(small ? gap + whole * place : gap + change, small ? rest & RESIDUE : 0);
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

// A node between steps, as its buffers hold it: the target in K, the gap in what the transition moves.
struct ShapedNode {
    float target;
    float gap;
    int elapsed;
    float temperature; // K
};

// One step of a node: the target moves and with it the phase, time passes, and the gap closes in proportion to the share left.
ShapedNode transition_step(float target, float gap, int elapsed, float commanded, ShapedBranches both) {
#ifdef RESTART
    commanded = abs(commanded - target) <= MOVED ? target : commanded;
#endif
    float moved = of_temperature(commanded);
    float change = moved - of_temperature(target);
    float open = gap + change;
    ShapedBranch branch = branch_of(open, both);
    int clock = elapsed & ~RESIDUE;
    int residue = ((elapsed & RESIDUE) ^ 16) - 16;
#if defined(MERGE)
    int from = change == 0.0 ? clock : phase_after(gap, elapsed, change, branch_of(gap, both));
#elif defined(RESTART)
    int from = change == 0.0 ? clock : 0;
#else
    int from = clock;
#endif
    int to = min(from, branch.end - branch.step) + branch.step;
    to = branch.end - to <= branch.end >> OVER_SHIFT ? branch.end : to;
    ShapePoint before = shape_at(from, branch);
    ShapePoint after = shape_at(to, branch);

    // A curve that is too flat here for its share left continues as a line.
    bool too_flat = before.left < 1e-30;
    float line = float(to - from) / float(max(branch.end - from, 1));
    float closed = max(0.0, max(before.done, after.done) < 0.5 ? after.done - before.done : before.left - after.left);
    float part = too_flat ? line : closed / before.left;
    bool over = to == branch.end;
    Carried sum = carried(gap, change - open * part, residue);
    float rest = over ? 0.0 : sum.gap;
#ifdef MERGE
    to = over || change != 0.0 ? to : to | sum.residue;
#else
    to = over ? to : to | sum.residue;
#endif
    return ShapedNode(commanded, rest, to, to_temperature(moved - rest));
}
