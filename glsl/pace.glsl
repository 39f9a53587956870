// How fast the phase moves as the gap grows: BRANCH is heating or cooling. Cubic pieces of g, the change of x = ln(s/r) with that
// of the logarithm of the gap, are read from `shapes`, BRANCH_PACE_FIRST the first of them. Twin: src/thermal/function/pace.rs.

// How much more of the time is left after the logarithm of the gap has grown, by Taylor's method of third order.
float BRANCH_followed(float s, float r, float growth) {
    float v = min(sqrt(min(s, r)) * (1.0 + abs(growth)), 0.71);
    int number = int(clamp(ceil(abs(growth) * v * BRANCH_PACE_PARTS), 1.0, MOST_PARTS));
    float part = growth / float(number);
    float shift = 0.0;
    for (int i = 0; i < number; i++) {
        float gone = s - shift;
        float left = r + shift;
        bool start = gone < left;
        float near = start ? gone : left;
        float place = sqrt(near) * BRANCH_PACE_PLACES;
        float cell = min(floor(place), float(BRANCH_PACE_HALF - 1u));
        float t = place - cell;
        vec4 c = shapes[BRANCH_PACE_FIRST + uint(cell) + (start ? 0u : BRANCH_PACE_HALF)];
        float g = c.x + t * (c.y + t * (c.z + t * c.w));
        float slope = c.y + t * (2.0 * c.z + 3.0 * t * c.w);
        float bend = 2.0 * c.z + 6.0 * t * c.w;
        // dt/dx, and its own derivative by t.
        float side = start ? 0.5 : -0.5;
        float pace = side * place * (1.0 - near);
        float first = pace * slope;
        float second = pace * (side * (1.0 - 3.0 * near) * slope + pace * bend);
        float change = part * g * (1.0 + 0.5 * part * (first + 0.333333333 * part * (first * first + g * second)));
        float e = exp_less_one(change);
        shift = clamp(shift - gone * left * e / (1.0 + gone * e), -r, s);
    }
    return shift;
}
