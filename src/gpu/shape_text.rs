//! The GLSL of a response function, its numbers written out: what is compiled when a scene loads.
//!
//! An expression is the user's own text, or two polynomials from its ends where they follow it; the other kinds are their
//! formulas (glsl/shape.glsl has what they call). The merge of each is a file of glsl/ in which BRANCH stands for heating
//! or cooling.

use std::fmt::Write as _;

use super::shaders::text_of;
use crate::thermal::function::{
    EndPolynomial, Expression, Function, HALF, Kind, Measured, Pace, Point, Polynomial, Shape, WIDTH, literal,
};
use crate::thermal::material::Transition;

/// Elementary functions that an expression means ours by, for a driver's may be far off.
const OWN: [&str; 10] = ["exp", "log", "exp2", "log2", "pow", "asin", "acos", "sinh", "cosh", "tanh"];

/// Where the pieces of a function begin in the buffer that has them; 0 for those that it does not have.
#[derive(Debug, Clone, Copy)]
pub struct Firsts {
    /// Of the function itself.
    pub cubics: usize,
    /// Of the pace of its phase.
    pub pace: usize,
}

/// The two functions of a transition and their merge, and what the shader calls: `shape_at` and `merge_on`. `firsts`: of
/// each function, where its pieces begin.
pub fn pair(transition: &Transition, firsts: [Firsts; 2]) -> String {
    let functions = [&transition.heating.function, &transition.cooling.function];
    let mut text = branch("heating", functions[0], firsts[0]);
    if functions[0] == functions[1] {
        text.push_str(
            "ShapePoint shape_at(bool heating, float s, float r) {\n    return heating_at(s, r);\n}\n\
             #ifdef MERGE\n\
             ShapedState merge_on(ShapedState state, float change, ShapedBranch branch) {\n    \
             return heating_merge(state, change, branch);\n}\n#endif\n",
        );
    } else {
        text.push_str(&branch("cooling", functions[1], firsts[1]));
        text.push_str(
            "ShapePoint shape_at(bool heating, float s, float r) {\n    \
             if (heating) {\n        return heating_at(s, r);\n    }\n    return cooling_at(s, r);\n}\n\
             #ifdef MERGE\n\
             ShapedState merge_on(ShapedState state, float change, ShapedBranch branch) {\n    \
             if (branch.heating) {\n        return heating_merge(state, change, branch);\n    }\n    \
             return cooling_merge(state, change, branch);\n}\n#endif\n",
        );
    }
    text
}

/// One function by the name of its branch.
fn branch(name: &str, function: &Function, first: Firsts) -> String {
    let at = match function {
        Function::Linear => polynomial(&[0.0, 1.0], &[0.0, 1.0]),
        Function::Quadratic => polynomial(&[0.0, 2.0, -1.0], &[0.0, 0.0, 1.0]),
        Function::Shaped(shape) => match &shape.kind {
            Kind::Polynomial(function) => of_polynomial(function),
            Kind::Exponential { rate } => exponential(*rate),
            Kind::Logarithmic { rate } => logarithmic(*rate),
            Kind::Table(measured) => match shape.cubics() {
                Some(cubics) => format!(
                    "const float BRANCH_WARP = {};\nconst uint BRANCH_FIRST = {}u;\n{}",
                    literal(cubics.warp),
                    first.cubics,
                    text_of("shape_pieces.glsl")
                ),
                None => table(measured),
            },
            Kind::Expression(expression) => of_expression(expression),
        },
    };
    let mut text = format!("const float BRANCH_START_RATE = {};\n{at}#ifdef MERGE\n", literal(function.at(1.0).rate));
    match function {
        Function::Linear | Function::Quadratic => text.push_str(text_of("merge_power.glsl")),
        Function::Shaped(shape) if shape.pace().is_some_and(Pace::is_of_a_power) => {
            text.push_str(text_of("merge_power.glsl"));
        }
        Function::Shaped(shape) => {
            if let Some(found) = shape.pace() {
                text.push_str(&pace(found, first.pace));
            }
            match (&shape.kind, shape.pace()) {
                (_, Some(_)) if shape.turns().is_empty() => text.push_str(text_of("merge_flow.glsl")),
                (Kind::Exponential { .. }, _) => text.push_str(text_of("merge_exponential.glsl")),
                (_, found) => {
                    text.push_str(&stretches(function, shape));
                    if found.is_some() {
                        text.push_str("#define BRANCH_FOLLOWS 1\n");
                    }
                    text.push_str(text_of("merge_turns.glsl"));
                }
            }
        }
    }
    text.push_str("#endif\n");
    text.replace("BRANCH", name)
}

fn pace(pace: &Pace, first: usize) -> String {
    format!(
        "const uint BRANCH_PACE_FIRST = {first}u;\nconst uint BRANCH_PACE_HALF = {HALF}u;\n\
         const float BRANCH_PACE_PLACES = {};\nconst float BRANCH_PACE_PARTS = {};\n{}",
        literal(1.0 / WIDTH),
        literal(pace.parts),
        text_of("pace.glsl")
    )
}

/// Text of a polynomial of `x` by Horner's rule.
fn horner(coefficients: &[f64], x: &str) -> String {
    let Some((last, rest)) = coefficients.split_last() else { return "0.0".to_owned() };
    rest.iter().rev().fold(literal(*last), |text, c| {
        if *c == 0.0 { format!("{x} * ({text})") } else { format!("({} + {x} * ({text}))", literal(*c)) }
    })
}

fn derivative(coefficients: &[f64]) -> Vec<f64> {
    coefficients.iter().enumerate().skip(1).map(|(power, c)| power as f64 * c).collect()
}

fn of_polynomial(function: &Polynomial) -> String {
    polynomial(&function.done(), function.left())
}

/// From what is done by s and what is left by r; each where its terms are the smaller.
fn polynomial(done: &[f64], left: &[f64]) -> String {
    let (slope, bend) = (derivative(left), derivative(&derivative(left)));
    let (start_slope, start_bend) = (derivative(done), derivative(&derivative(done)));
    let border = border(done, left);
    format!(
        "ShapePoint BRANCH_at(float s, float r) {{\n    \
         bool start = s < {};\n    \
         float small = start ? {} : {};\n    \
         float rate = start ? {} : {};\n    \
         float bend = start ? -({}) : {};\n    \
         return ShapePoint(start ? small : 1.0 - small, start ? 1.0 - small : small, max(0.0, rate), bend);\n}}\n",
        literal(border),
        horner(done, "s"),
        horner(left, "r"),
        horner(&start_slope, "s"),
        horner(&slope, "r"),
        horner(&start_bend, "s"),
        horner(&bend, "r"),
    )
}

/// The s from which the sum of the terms' sizes of what is left is below that of what is done.
fn border(done: &[f64], left: &[f64]) -> f64 {
    let size = |coefficients: &[f64], x: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c.abs());
    let crosses = (1..64).map(|i| f64::from(i) / 64.0).find(|s| size(left, 1.0 - s) <= size(done, *s));
    crosses.unwrap_or(1.0)
}

fn exponential(rate: f64) -> String {
    let scale = -1.0 / (-rate).exp_m1();
    format!(
        "const float BRANCH_RATE = {};\n\
         ShapePoint BRANCH_at(float s, float r) {{\n    \
         float still = {} * own_exp(-BRANCH_RATE * s);\n    \
         float rate = BRANCH_RATE * still;\n    \
         return ShapePoint({} * exp_less_one(-BRANCH_RATE * s), -still * exp_less_one(-BRANCH_RATE * r), rate, \
         BRANCH_RATE * rate);\n}}\n",
        literal(rate),
        literal(scale),
        literal(-scale),
    )
}

/// What is left is taken from r where it is the smaller: at the start 1 + k r loses the digits of s.
fn logarithmic(rate: f64) -> String {
    let scale = 1.0 / rate.ln_1p();
    format!(
        "ShapePoint BRANCH_at(float s, float r) {{\n    \
         float whole = 1.0 / (1.0 + {rate} * s);\n    \
         float rate = {speed} * whole;\n    \
         float done = {scale} * log_one_plus({rate} * s);\n    \
         float left = {negative} * log_one_plus({share} * r);\n    \
         bool start = done < left;\n    \
         return ShapePoint(start ? done : 1.0 - left, start ? 1.0 - done : left, rate, {rate} * rate * whole);\n}}\n",
        rate = literal(rate),
        speed = literal(scale * rate),
        scale = literal(scale),
        negative = literal(-scale),
        share = literal(-rate / (1.0 + rate)),
    )
}

/// The pieces of a table: those of the end by r, those of the start by s, chosen one by one.
fn table(measured: &Measured) -> String {
    let knots = measured.knots();
    let pieces: Vec<(f64, bool, [f64; 4])> = measured
        .pieces()
        .into_iter()
        .enumerate()
        .map(|(i, c)| {
            let (low, high) = (knots[i], knots[i + 1]);
            if low + high > 1.0 { (1.0 - high, true, from_the_start(c, high - low)) } else { (low, false, c) }
        })
        .collect();
    let late = pieces.iter().filter(|piece| !piece.1).count();
    let border = knots[late];
    let chosen = |text: &mut String, first: bool, (origin, _, c): &(f64, bool, [f64; 4]), condition: &str| {
        for (name, value) in ["o", "c0", "c1", "c2", "c3"].into_iter().zip([origin, &c[0], &c[1], &c[2], &c[3]]) {
            let value = literal(*value);
            let _ = if first {
                writeln!(text, "    float {name} = {value};")
            } else {
                writeln!(text, "    {name} = {condition} ? {value} : {name};")
            };
        }
    };
    let mut text = "ShapePoint BRANCH_at(float s, float r) {\n".to_owned();
    // From the piece at the end on towards the middle, then from that next to the middle on to the start.
    let order = pieces[..late].iter().chain(&pieces[late..]);
    for (i, piece) in order.enumerate() {
        let condition = format!("p{i}");
        if i > 0 {
            let _ = if piece.1 {
                writeln!(text, "    bool p{i} = s < {};", literal(1.0 - knots[i]))
            } else {
                writeln!(text, "    bool p{i} = r >= {};", literal(knots[i]))
            };
        }
        chosen(&mut text, i == 0, piece, &condition);
    }
    let start = if late == 0 { "true".to_owned() } else { format!("s < {}", literal(1.0 - border)) };
    let _ = write!(
        text,
        "    bool start = {start};\n    \
         float t = (start ? s : r) - o;\n    \
         float small = c0 + t * (c1 + t * (c2 + t * c3));\n    \
         float rate = c1 + t * (2.0 * c2 + 3.0 * t * c3);\n    \
         float bend = 2.0 * c2 + 6.0 * t * c3;\n    \
         return ShapePoint(start ? small : 1.0 - small, start ? 1.0 - small : small, max(0.0, rate), \
         start ? -bend : bend);\n}}\n"
    );
    text
}

/// A cubic of what is left in powers from its lower border, as what is done in powers of the time from its upper one.
fn from_the_start([w, m, a, b]: [f64; 4], width: f64) -> [f64; 4] {
    let left = w + width * (m + width * (a + width * b));
    let slope = m + width * (2.0 * a + 3.0 * width * b);
    let half_bend = a + 3.0 * width * b;
    [1.0 - left, slope, -half_bend, b]
}

fn of_expression(expression: &Expression) -> String {
    let ends = expression.end_polynomials();
    if let [Some(start), Some(end)] = &ends
        && start.reach + end.reach >= 1.0
    {
        return halves(start, end);
    }
    let mut text = String::new();
    for name in OWN {
        let _ = writeln!(text, "#define {name} own_{name}");
    }
    let [start, scale] = expression.ends();
    let [first, last] = expression.end_slopes();
    let _ = write!(
        text,
        "float BRANCH_text(float s) {{\n    return float(\n{}\n);\n}}\n{}",
        expression.text(),
        expression.derivatives("BRANCH_slopes")
    );
    for name in OWN {
        let _ = writeln!(text, "#undef {name}");
    }
    let close = |x: &str, end: &Option<EndPolynomial>| {
        let Some(end) = end else { return String::new() };
        format!(
            "    if ({x} < {}) {{\n        float x = {x};\n{}    }}\n",
            literal(end.reach),
            close_to_end(end, x == "s", &end.coefficients.iter().map(|c| literal(*c)).collect::<Vec<_>>())
        )
    };
    let _ = write!(
        text,
        "ShapePoint BRANCH_at(float s, float r) {{\n{}{}    \
         float done = clamp({scale} * (BRANCH_text(s) - {start}), 0.0, 1.0);\n    \
         vec2 slopes = {scale} * BRANCH_slopes(s);\n    \
         return near_its_ends(s, r, done, slopes, vec2({}, {}), vec2({}, {}));\n}}\n",
        close("s", &ends[0]),
        close("r", &ends[1]),
        literal(first[0]),
        literal(first[1]),
        literal(last[0]),
        literal(last[1]),
        scale = literal(scale),
        start = literal(start),
    );
    text
}

/// An expression that polynomials from both ends stand for all of.
fn halves(start: &EndPolynomial, end: &EndPolynomial) -> String {
    let close = |end: &EndPolynomial, start: bool| {
        close_to_end(end, start, &end.coefficients.iter().map(|c| literal(*c)).collect::<Vec<_>>())
    };
    if start.of_root != end.of_root {
        return format!(
            "ShapePoint BRANCH_at(float s, float r) {{\n    if (s < 0.5) {{\n        float x = s;\n{}    }}\n    \
             float x = r;\n{}}}\n",
            close(start, true),
            close(end, false)
        );
    }
    let number = start.coefficients.len().max(end.coefficients.len());
    let at = |end: &EndPolynomial, k: usize| literal(end.coefficients.get(k).copied().unwrap_or(0.0));
    let chosen: Vec<String> = (0..number).map(|k| format!("(start ? {} : {})", at(start, k), at(end, k))).collect();
    format!(
        "ShapePoint BRANCH_at(float s, float r) {{\n    bool start = s < 0.5;\n    float x = start ? s : r;\n{}    \
         return ShapePoint(start ? small : 1.0 - small, start ? 1.0 - small : small, rate, start ? -bend : bend);\n}}\n",
        sums(start.of_root, &chosen)
    )
}

fn close_to_end(end: &EndPolynomial, start: bool, coefficients: &[String]) -> String {
    let point = if start { "small, 1.0 - small, rate, -bend" } else { "1.0 - small, small, rate, bend" };
    format!("{}    return ShapePoint({point});\n", sums(end.of_root, coefficients))
}

/// Text that has `small`, x Q(v), and its first two derivatives by x, with v = x or its root.
fn sums(of_root: bool, coefficients: &[String]) -> String {
    let mut text = format!("    float v = {};\n", if of_root { "sqrt(max(0.0, x))" } else { "x" });
    // Horner's rule for Q, Q' and Q''/2.
    text.push_str("    float q = 0.0;\n    float q1 = 0.0;\n    float q2 = 0.0;\n");
    for c in coefficients.iter().rev() {
        let _ = write!(text, "    q2 = q2 * v + q1;\n    q1 = q1 * v + q;\n    q = q * v + {c};\n");
    }
    text.push_str("    float small = max(0.0, x * q);\n");
    text.push_str(if of_root {
        "    float rate = max(0.0, q + 0.5 * v * q1);\n    \
         float bend = (0.75 * q1 + 0.5 * v * q2) / max(v, 1e-6);\n"
    } else {
        "    float rate = max(0.0, q + x * q1);\n    float bend = 2.0 * (q1 + x * q2);\n"
    });
    text
}

/// The stretches between the turns of a relative rate: the one around a phase, and the nearest beyond it that a
/// relative rate is found on.
fn stretches(function: &Function, shape: &Shape) -> String {
    let z = |r: f64| {
        let Point { left, rate } = function.at(r);
        rate / (left + rate)
    };
    let start = function.at(1.0).rate;
    // At the very end h is infinite, and z beyond the reach of any.
    let mut borders = vec![(0.0, 2.0)];
    borders.extend(shape.turns().iter().map(|&r| (r, z(r))));
    borders.push((1.0, start / (1.0 + start)));
    let written: Vec<[String; 2]> = borders.iter().map(|&(r, z)| [literal(r), literal(z)]).collect();
    let stretch = |i: usize| {
        let [[low, low_z], [high, high_z]] = [&written[i], &written[i + 1]];
        format!("Stretch({low}, {low_z}, {high}, {high_z})")
    };
    let last = written.len() - 2;
    let mut text = format!("Stretch BRANCH_stretch(float r) {{\n    Stretch at = {};\n", stretch(0));
    for i in 1..=last {
        let names = ["low", "low_z", "high", "high_z"];
        let values = [&written[i][0], &written[i][1], &written[i + 1][0], &written[i + 1][1]];
        for (name, value) in names.into_iter().zip(values) {
            let _ = writeln!(text, "    at.{name} = r > {} ? {value} : at.{name};", written[i][0]);
        }
    }
    text.push_str("    return at;\n}\n");
    text.push_str("Stretch BRANCH_opposite(Stretch own, float aim, bool upwards) {\n    Stretch at = Stretch(1.0, 0.0, 0.0, 0.0);\n");
    // The last that fits is the nearest.
    let below = (0..=last).map(|i| (i, format!("upwards && {} <= own.low", written[i + 1][0])));
    let above = (0..=last).rev().map(|i| (i, format!("!upwards && {} >= own.high", written[i][0])));
    for (i, side) in below.chain(above) {
        let crosses = format!("({} < aim) != ({} < aim)", written[i][1], written[i + 1][1]);
        let _ = writeln!(text, "    if ({side} && {crosses}) {{\n        at = {};\n    }}", stretch(i));
    }
    text.push_str("    return at;\n}\n");
    text
}
