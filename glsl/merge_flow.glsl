// The merge of a function whose relative rate grows throughout: BRANCH is heating or cooling. Derivation: src/thermal/function/flow.rs.

ShapedState BRANCH_merge(ShapedState state, float change, ShapedBranch branch) {
    float s = time_gone(state.elapsed, branch);
    float r = time_left(state.elapsed, branch);
    ShapePoint here = BRANCH_at(s, r);
    float share = change / (state.span * max(here.left, 1e-37));
    // Where no gap goes on nothing is followed.
    float growth = share > -1.0 ? log_one_plus(min(share, 1e30)) : 0.0;
    float shift = BRANCH_followed(s, r, growth);
    ShapePoint near = BRANCH_at(s - shift, r + shift);
    return shifted(state, change, branch, here, near, shift, 0.0);
}
