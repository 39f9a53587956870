// A table too long to be written out: BRANCH is heating or cooling. Cubic pieces made in f64 when the scene loads are read
// from `shapes`, BRANCH_FIRST the first of them. Twin: src/thermal/function/cubics.rs makes them.

const uint BRANCH_HALF = 2048u; // pieces from either end

ShapePoint BRANCH_at(float s, float r) {
    float scale = 1.0 / (1.0 + BRANCH_WARP * r);
    float from_start = s * scale;
    float from_end = (1.0 + BRANCH_WARP) * r * scale;
    bool start = from_start < from_end;
    float place = min(from_start, from_end) * float(2u * BRANCH_HALF);
    float cell = clamp(floor(place), 0.0, float(BRANCH_HALF - 1u));
    float t = place - cell;
    vec4 c = shapes[BRANCH_FIRST + uint(cell) + (start ? 0u : BRANCH_HALF)];
    float small = c.x + t * (c.y + t * (c.z + t * c.w));
    float slope = c.y + t * (2.0 * c.z + 3.0 * t * c.w);
    float curvature = 2.0 * c.z + 6.0 * t * c.w;
    float stretch = float(2u * BRANCH_HALF) * (1.0 + BRANCH_WARP) * scale * scale; // dt/ds
    float bend = curvature * stretch * stretch;
    return ShapePoint(
        start ? small : 1.0 - small,
        start ? 1.0 - small : small,
        max(0.0, slope * stretch),
        (start ? -bend : bend) - 2.0 * BRANCH_WARP * scale * stretch * slope
    );
}
