// The merge of a power of the time left: BRANCH is heating or cooling. The new phase is u/q of NUMERICS.md 1.

ShapedState BRANCH_merge(ShapedState state, float change, ShapedBranch branch) {
    float s = time_gone(state.elapsed, branch);
    float r = time_left(state.elapsed, branch);
    ShapePoint here = BRANCH_at(s, r);
    float left = state.span * here.left;
    float shift = clamp(r * change * s / (left + change * r), -r, s);
    ShapePoint near = BRANCH_at(s - shift, r + shift);
    return shifted(state, change, branch, here, near, shift, 0.0);
}
