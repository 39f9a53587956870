// The merge of a function whose relative rate grows throughout: BRANCH is heating or cooling, and src/gpu/shape_text.rs
// repeats REFINE as often as the function needs. Derivation: src/thermal/function/phase.rs.

// A step of Newton's method for the share of the time left at which w/f' (or w/(w + f'), whichever is straighter) is what
// is wanted. `excess` is f' times the wanted gap less w times the wanted rate.
float BRANCH_newton(float excess, ShapePoint at, float gap, float rate) {
#ifdef BRANCH_BY_RATE
    float weight = at.rate;
    float wanted = rate;
#else
    float weight = at.rate + at.left;
    float wanted = rate + gap;
#endif
    return excess * weight / max(wanted * (at.rate * at.rate - at.left * at.bend), 1e-35);
}

ShapedState BRANCH_merge(ShapedState state, float change, ShapedBranch branch) {
    float s = time_gone(state.elapsed, branch);
    float r = time_left(state.elapsed, branch);
    ShapePoint here = BRANCH_at(s, r);
    float share = change / state.span;
    float gap = here.left + share;
    float rate = here.rate + share * BRANCH_START_RATE;
    float excess = share * (here.rate - here.left * BRANCH_START_RATE);
    // Never quite to the end, where nothing is left to step from.
    float shift = clamp(BRANCH_newton(excess, here, gap, rate), -0.999 * r, s);
    float beyond = 0.0;
    ShapePoint near = here;
    REFINE
    return shifted(state, change, branch, here, near, shift, beyond);
}
