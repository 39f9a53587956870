// The merge of a function whose relative rate grows throughout: BRANCH is heating or cooling. BRANCH_pace, the change of
// ln(s/r) with that of the logarithm of the gap, is written by src/gpu/shape_text.rs. Derivation: src/thermal/function/flow.rs.

// How much more of the time is left after ln(s/r) has changed.
float BRANCH_moved(float s, float r, float change) {
    float e = change * (1.0 + change * (0.5 + change * (0.166666667 + change * (0.0416666667 + change * 0.00833333333))));
    return -s * r * e / (1.0 + s * e);
}

ShapedState BRANCH_merge(ShapedState state, float change, ShapedBranch branch) {
    float s = time_gone(state.elapsed, branch);
    float r = time_left(state.elapsed, branch);
    ShapePoint here = BRANCH_at(s, r);
    float share = change / (state.span * max(here.left, 1e-37));
    float growth = share > -1.0 ? log_one_plus(share) : 0.0;
    int number = int(clamp(ceil(abs(growth) / LONGEST_PART), 1.0, MOST_PARTS));
    float part = growth / float(number);
    float shift = 0.0;
    for (int i = 0; i < number; i++) {
        // The method of Runge and Kutta, of fourth order.
        float from = s - shift;
        float left = r + shift;
        float a = part * BRANCH_pace(from, left);
        float to = BRANCH_moved(from, left, 0.5 * a);
        float b = part * BRANCH_pace(from - to, left + to);
        to = BRANCH_moved(from, left, 0.5 * b);
        float c = part * BRANCH_pace(from - to, left + to);
        to = BRANCH_moved(from, left, c);
        float d = part * BRANCH_pace(from - to, left + to);
        shift = clamp(shift + BRANCH_moved(from, left, (a + 2.0 * (b + c) + d) * 0.166666667), -r, s);
    }
    ShapePoint near = BRANCH_at(s - shift, r + shift);
    return shifted(state, change, branch, here, near, shift, 0.0);
}
