// The merge of a function whose relative rate turns, or that no few steps of Newton's method are sure for: BRANCH is heating
// or cooling. BRANCH_stretch and BRANCH_opposite are written by src/gpu/shape_text.rs. Derivation and rule: src/thermal/function/phase.rs.

// z = h / (1 + h) of a point less that of the wanted gap and rate, from its excess; at the very end h is infinite.
float BRANCH_z_excess(float excess, ShapePoint at, float gap, float rate) {
    float sum = at.rate + at.left;
    return sum > 0.0 ? excess / ((gap + rate) * max(sum, 1e-37)) : gap / (gap + rate);
}

float BRANCH_z_slope(ShapePoint at) {
    float sum = max(at.rate + at.left, 1e-18);
    return (at.bend * at.left - at.rate * at.rate) / (sum * sum);
}

ShapedState BRANCH_merge(ShapedState state, float change, ShapedBranch branch) {
    float s = time_gone(state.elapsed, branch);
    float r = time_left(state.elapsed, branch);
    ShapePoint here = BRANCH_at(s, r);
    float share = change / state.span;
    float gap = here.left + share;
    float rate = here.rate + share * BRANCH_START_RATE;
    float excess = share * (here.rate - here.left * BRANCH_START_RATE);

    // How far z must go, on the stretch around r on which it is monotone.
    float z = here.rate / max(here.rate + here.left, 1e-37);
    float far = -BRANCH_z_excess(excess, here, gap, rate);
    Stretch own = BRANCH_stretch(r);
    bool rises = own.high_z > own.low_z;
    bool upwards = (far > 0.0) == rises;
    float border_z = upwards ? own.high_z : own.low_z;
    // Rounding must not hide a root at either end of the function, where one always is.
    bool to_an_end = upwards ? own.high >= 1.0 : own.low <= 0.0;
    bool reachable = to_an_end || (far > 0.0 ? z + far <= border_z : z + far >= border_z);
    bool sought = rate >= 0.0 && far != 0.0 && reachable;
    float border = min(own.high < 1.0 ? own.high - r : 2.0, own.low > 0.0 ? r - own.low : 2.0);
    float size = abs(share / gap);
#ifdef BRANCH_FOLLOWS
    // No number, where the transition under way has no span, is no small change.
    bool is_step = !(size <= STEP);
    sought = sought && is_step;
#else
    bool is_step = size > STEP;
#endif

    // Newton's method, halving the bracket where it leaves it; then, of a step, on the nearest stretch of the other side,
    // which may have a nearer root.
    float low = upwards ? 0.0 : own.low - r;
    float high = upwards ? own.high - r : 0.0;
    float slope = BRANCH_z_slope(here);
    float first = slope == 0.0 ? DISTANT : far / slope;
    first = (first > 0.0) == upwards ? first : (upwards ? high : low);
    float shift = sought ? clamp(first, low, high) : 0.0;
    float own_shift = 0.0;
    bool other = false;
    bool moving = sought && first * first > EXACT_SHIFT * min(s, r);
    for (int i = 0; i < MAX_STEPS && moving; i++) {
        ShapePoint at = BRANCH_at(min(1.0, max(0.0, s - shift)), min(1.0, max(0.0, r + shift)));
        float e = BRANCH_z_excess(excess_at(at, here, excess, shift, gap, rate), at, gap, rate);
        bool past = (e > 0.0) == rises;
        high = past ? shift : high;
        low = past ? low : shift;
        float slope_there = BRANCH_z_slope(at);
        float next = shift + (slope_there == 0.0 ? DISTANT : -e / slope_there);
        bool inside = next >= low && next <= high;
        next = inside ? next : 0.5 * (low + high);
        float step = next - shift;
        // What a step of Newton's method leaves is about its square over the distance to an end, where rates are bent most.
        float reach = max(min(s - next, r + next), 1e-6);
        moving = high - low > 1e-8 && (inside ? step * step > LAST_STEP * reach : abs(step) > 1e-8);
        shift = next;
        if (!moving && !other && is_step && abs(shift) > border) {
            Stretch opposite = BRANCH_opposite(own, z + far, upwards);
            other = opposite.low < opposite.high;
            own_shift = shift;
            rises = opposite.high_z > opposite.low_z;
            low = opposite.low - r;
            high = opposite.high - r;
            moving = other && min(abs(low), abs(high)) < abs(own_shift);
            shift = moving ? 0.5 * (low + high) : shift;
        }
    }
    shift = other && abs(own_shift) < abs(shift) ? own_shift : shift;

#ifdef BRANCH_FOLLOWS
    float growth = is_step ? 0.0 : log_one_plus(share / max(here.left, 1e-37));
    float followed = BRANCH_followed(s, r, growth);
    shift = is_step ? shift : followed;
#endif
    shift = clamp(shift, -r, s);
    ShapePoint near = BRANCH_at(s - shift, r + shift);
    return shifted(state, change, branch, here, near, shift, 0.0);
}
