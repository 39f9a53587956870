// What the response functions of a scene are written with. The functions themselves are text that src/gpu/shape_text.rs
// makes when a scene loads. Twin: src/thermal/function.rs.
// The elementary functions here are as good as f32; those of a driver need not be (lavapipe's log near 1 is off by 13 %).

// A function at one moment. Of what is done and what is left, the smaller is exact.
struct ShapePoint {
    float done; // f
    float left; // w = 1 - f
    float rate; // f' = dw/dr
    float bend; // d2w/dr2
};

// e^x as scale (1 + part), scale a power of two.
struct Exponential {
    float scale;
    float part;
};

Exponential exponential(float x) {
    float held = clamp(x, -87.0, 88.0);
    float n = floor(held * 1.44269504 + 0.5);
    // ln 2 in two parts, of which the first times n is exact.
    float f = (held - n * 0.693359375) + n * 2.12194440e-4;
    float p = f + f * f * (0.5 + f * (0.166666667 + f * (0.0416666667 + f * (0.00833333333 + f * (0.00138888889
        + f * 0.000198412698)))));
    return Exponential(uintBitsToFloat(uint(int(n) + 127) << 23u), p);
}

// e^x - 1.
float exp_less_one(float x) {
    Exponential e = exponential(x);
    return e.part * e.scale + (e.scale - 1.0);
}

// ln(1 + x) for x above -1.
float log_one_plus(float x) {
    float y = 1.0 + x;
    // y = 2^n m with m in [sqrt 1/2, sqrt 2).
    uint bits = floatBitsToUint(max(y, 1e-37)) - 0x3f3504f3u;
    int n = int(bits) >> 23u;
    float m = uintBitsToFloat((bits & 0x7fffffu) + 0x3f3504f3u);
    float f = n == 0 ? x : m - 1.0;
    float t = f / (2.0 + f);
    float t2 = t * t;
    float series = t2 * (0.333333333 + t2 * (0.2 + t2 * (0.142857143 + t2 * 0.111111111)));
    float k = float(n);
    return (2.0 * t + (2.0 * t * series + k * -2.12194440e-4)) + k * 0.693359375;
}

// What an expression's text means by exp, log, ...
float own_exp(float x) {
    Exponential e = exponential(x);
    return x < -87.0 ? 0.0 : e.scale + e.scale * e.part;
}

float own_log(float x) {
    return x > 0.0 ? log_one_plus(x - 1.0) : -3e38;
}

float own_exp2(float x) {
    return own_exp(0.693147181 * x);
}

float own_log2(float x) {
    return 1.44269504 * own_log(x);
}

float own_pow(float x, float y) {
    return x > 0.0 ? own_exp(y * log_one_plus(x - 1.0)) : (y == 0.0 ? 1.0 : 0.0);
}

// Polynomial of Cephes' asinf (S. Moshier).
float own_asin(float x) {
    float a = min(abs(x), 1.0);
    bool far = a > 0.5;
    float z = far ? 0.5 * (1.0 - a) : a * a;
    float y = far ? sqrt(z) : a;
    float p = y + y * z * (1.6666752422e-1 + z * (7.4953002686e-2 + z * (4.5470025998e-2 + z * (2.4181311049e-2
        + z * 4.2163199048e-2))));
    float value = far ? 1.57079633 - 2.0 * p : p;
    return x < 0.0 ? -value : value;
}

float own_acos(float x) {
    return 1.57079633 - own_asin(x);
}

float own_sinh(float x) {
    float e = exp_less_one(x);
    return 0.5 * (e + e / (e + 1.0));
}

float own_cosh(float x) {
    float e = own_exp(x);
    return 0.5 * (e + 1.0 / e);
}

float own_tanh(float x) {
    float e = exp_less_one(2.0 * clamp(x, -20.0, 20.0));
    return e / (e + 2.0);
}

// An expression at one moment, from the value of its text and its first and second derivative there and at both ends. Close
// to an end the text's rounding is much of what is done or left: there it is summed from the rates (corrected trapezoidal
// rule) where both agree.
ShapePoint near_its_ends(float s, float r, float done, vec2 slopes, vec2 first, vec2 last) {
    float started = s * (0.5 * (first.x + slopes.x) - s * (slopes.y - first.y) / 12.0);
    float rest = r * (0.5 * (last.x + slopes.x) - r * (last.y - slopes.y) / 12.0);
    float left = 1.0 - done;
    bool start = s < 0.03125 && abs(started - done) < 5e-7;
    bool end = r < 0.03125 && abs(rest - left) < 5e-7;
    return ShapePoint(
        start ? max(0.0, started) : (end ? 1.0 - rest : done),
        start ? 1.0 - started : (end ? max(0.0, rest) : left),
        max(0.0, slopes.x),
        -slopes.y
    );
}
