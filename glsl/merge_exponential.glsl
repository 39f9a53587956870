// The merge of an exponential: BRANCH is heating or cooling. With T = target - span (e^-ks - e^-k) / (1 - e^-k), the sum of
// two such curves of one k is such a curve, whose span is the sum of theirs: the gap and the rate together fix
// e^-ks' = (span e^-ks + change) / (span + change). Derivation: src/thermal/function/phase.rs.

ShapedState BRANCH_merge(ShapedState state, float change, ShapedBranch branch) {
    float s = time_gone(state.elapsed, branch);
    float r = time_left(state.elapsed, branch);
    float still = own_exp(-BRANCH_RATE * s);
    float gone = -exp_less_one(-BRANCH_RATE * s);
    float share = change / state.span;
    // e^-ks' / e^-ks - 1; where e^-ks is lost, from e^-ks' itself.
    float ratio = share * gone / (still * (1.0 + share));
    float sum = (still + share) / (1.0 + share);
    float shift = abs(ratio) < 1.0 ? log_one_plus(ratio) / BRANCH_RATE
                                   : s + log_one_plus(max(sum, 1e-37) - 1.0) / BRANCH_RATE;
    shift = clamp(shift, -r, s);
    int elapsed = shifted_clock(state.elapsed, shift, branch);
    return ShapedState(state.target, state.span + change, elapsed);
}
