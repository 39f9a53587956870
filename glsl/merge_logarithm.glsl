// How the phase of a logarithm whose relative rate turns follows small changes of its target: BRANCH is heating or cooling.
// Twin and derivation: Logarithm in src/thermal/function/phase.rs.

float BRANCH_pace(float s, float r) {
    float left = BRANCH_SCALE * -log_one_plus(BRANCH_SHARE * r);
    float done = BRANCH_SCALE * log_one_plus(BRANCH_RATE * s);
    float a = 1.0 - BRANCH_WHOLE * left;
    float past_start = done - BRANCH_RATE * s * left;
    float relative = past_start * (1.0 + BRANCH_RATE * s) * left * (BRANCH_WHOLE / BRANCH_RATE);
    return -relative * a / max(a * a, BRANCH_LEAST_SQUARE);
}

// How much more of the time is left after the logarithm of the gap has grown.
float BRANCH_followed(float s, float r, float growth) {
    int number = int(ceil(abs(growth) / BRANCH_LONGEST));
    float part = growth / float(max(number, 1));
    float shift = 0.0;
    for (int i = 0; i < number; i++) {
        float from = s - shift;
        float left = r + shift;
        float a = part * BRANCH_pace(from, left);
        float b = part * BRANCH_pace(from + 0.5 * a, left - 0.5 * a);
        float c = part * BRANCH_pace(from + 0.5 * b, left - 0.5 * b);
        float d = part * BRANCH_pace(from + c, left - c);
        shift = clamp(shift - (a + 2.0 * (b + c) + d) * 0.166666667, -r, s);
    }
    return shift;
}
