// Local step of a node that radiates under constant power, for four nodes at a time. With FAST a node may have any time
// constant. Twin: src/thermal/local_step.rs.

// Change at a rate that radiation has changed [K].
vec4 local_rate(vec4 start, vec4 emission, vec4 here, vec4 change) {
    vec4 reached = here + change;
    return start - emission * change * (reached + here) * (reached * reached + here * here);
}

// One Runge-Kutta step over a share of the local step.
vec4 local_part(float share, vec4 start, vec4 emission, vec4 here, vec4 change) {
    vec4 a = share * local_rate(start, emission, here, change);
    vec4 b = share * local_rate(start, emission, here, change + 0.5 * a);
    vec4 c = share * local_rate(start, emission, here, change + 0.5 * b);
    vec4 d = share * local_rate(start, emission, here, change + c);
    return change + (a + 2.0 * (b + c) + d) * (1.0 / 6.0);
}

#ifdef FAST
// atan within 1e-7, for |x| <= 1 (Cephes).
vec4 small_arctangent(vec4 x) {
    vec4 size = abs(x);
    bvec4 large = greaterThan(size, vec4(0.41421356));
    vec4 r = mix(size, (size - 1.0) / (size + 1.0), large);
    vec4 z = r * r;
    vec4 odd = (((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1) * z * r + r;
    return sign(x) * mix(odd, odd + 0.785398163, large);
}

// tanh of x >= 0. Its difference of exponentials would cancel where x is small.
vec4 hyperbolic_tangent(vec4 x) {
    vec4 z = x * x;
    vec4 series = x * (1.0 + z * (-0.333333333 + z * (0.133333333 + z * -0.053968254)));
    vec4 falling = exp(-2.0 * x);
    return mix((1.0 - falling) / (1.0 + falling), series, lessThan(x, vec4(0.3)));
}

// Change in closed form [K]. `power` is the change that the power alone would cause [K], and is above 0.
vec4 closed_change(vec4 here, vec4 start, vec4 power, vec4 emission) {
    vec4 balance = sqrt(sqrt(power / max(emission, vec4(1e-30))));
    vec4 from = here / balance;
    vec4 distance = start / (power * (1.0 + from * from));
    vec4 goal = 2.0 * emission * balance * balance * balance;
    vec4 reached = 0.5 * goal * (1.0 + from * from);
    vec4 moved = vec4(0.0);
    for (uint i = 0u; i <= 4u; i++) {
        reached = clamp(reached, vec4(0.0), vec4(9.0));
        vec4 ratio = hyperbolic_tangent(reached);
        moved = distance * ratio / (1.0 + from * ratio);
        vec4 to = from + moved;
        reached -= 0.5 * (1.0 + to * to) * (reached + small_arctangent(moved / (1.0 + from * to)) - goal);
    }
    return balance * moved;
}
#endif
