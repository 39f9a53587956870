// Planet infrared on a plate, for four nodes at a time. Twin: src/environment/view_factor.rs.

const float PI = 3.14159265358979;

// Arc tangent of y / x in [0, pi] for y >= 0, with an error of 1e-7. The built-in atan may have an error of 3e-4. It
// reduces the range to [0, tan(pi/8)] and uses the odd series of Cephes' atanf (S. Moshier).
vec4 arc_tangent(vec4 y, vec4 x) {
    vec4 ax = abs(x);
    vec4 smaller = min(ax, y);
    vec4 larger = max(max(ax, y), vec4(1e-30));
    vec4 t = smaller / larger;
    bvec4 upper = greaterThan(t, vec4(0.41421356));
    vec4 z = mix(t, (t - vec4(1.0)) / (t + vec4(1.0)), upper);
    vec4 z2 = z * z;
    vec4 series = ((vec4(8.05374449538e-2) * z2 - vec4(1.38776856032e-1)) * z2 + vec4(1.99777106478e-1)) * z2
        - vec4(3.33329491539e-1);
    vec4 angle = series * z2 * z + z + mix(vec4(0.0), vec4(0.25 * PI), upper);
    angle = mix(angle, vec4(0.5 * PI) - angle, greaterThan(y, ax));
    return mix(angle, vec4(PI) - angle, lessThan(x, vec4(0.0)));
}

// View factor from a plate to the planet, whose angular radius has this sine and cosine.
vec4 plate_view_factor(vec4 cos_tilt, float sine, float cosine) {
    vec4 x = clamp(cos_tilt / sine, vec4(-1.0), vec4(1.0));
    vec4 w = sqrt((vec4(1.0) - x) * (vec4(1.0) + x));
    vec4 cap = arc_tangent(sine * w, vec4(cosine));
    vec4 arc = arc_tangent(w, -cosine * x);
    vec4 cut = max(cap - sine * cosine * w + sine * sine * cos_tilt * arc, vec4(0.0)) * (1.0 / PI);
    vec4 seen = mix(cut, sine * sine * cos_tilt, greaterThanEqual(cos_tilt, vec4(sine)));
    return mix(seen, vec4(0.0), lessThanEqual(cos_tilt, vec4(-sine)));
}

// Incident infrared of the planet [W/m2].
vec4 planet_ir_flux(Step step, vec4 nx, vec4 ny, vec4 nz) {
#ifdef TUMBLE
    return vec4(step.planet_ir);
#else
    vec4 cos_tilt = nx * step.nadir.x + ny * step.nadir.y + nz * step.nadir.z;
    return step.planet_ir * plate_view_factor(cos_tilt, step.nadir.w, step.sunward.w);
#endif
}
