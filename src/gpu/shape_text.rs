//! The GLSL of a response function, its numbers written out: what is compiled when a scene loads.
//!
//! An expression is the user's own text; the other kinds are their formulas (glsl/shape.glsl has what they call). The merge
//! of each is a file of glsl/ in which BRANCH stands for heating or cooling.

use std::fmt::Write as _;

use super::compile::source;
use crate::thermal::function::{END, Expression, Function, Kind, Measured, Point, Polynomial, Shape, literal};
use crate::thermal::material::Transition;

/// Elementary functions that an expression means ours by, for a driver's may be far off.
const OWN: [&str; 10] = ["exp", "log", "exp2", "log2", "pow", "asin", "acos", "sinh", "cosh", "tanh"];

/// The two functions of a transition and their merge, and what the shader calls: `shape_at` and `merge_on`. `firsts`: of
/// each function that is read in pieces, the first of them.
pub fn pair(transition: &Transition, firsts: [usize; 2]) -> String {
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
fn branch(name: &str, function: &Function, first: usize) -> String {
    let at = match function {
        Function::Linear => polynomial(&[0.0, 1.0], &[0.0, 1.0]),
        Function::Quadratic => polynomial(&[0.0, 2.0, -1.0], &[0.0, 0.0, 1.0]),
        Function::Shaped(shape) => match &shape.kind {
            Kind::Polynomial(function) => of_polynomial(function),
            Kind::Exponential { rate } => exponential(*rate),
            Kind::Logarithmic { rate } => logarithmic(*rate),
            Kind::Table(measured) => match shape.cubics() {
                Some(cubics) => format!(
                    "const float BRANCH_WARP = {};\nconst uint BRANCH_FIRST = {first}u;\n{}",
                    literal(cubics.warp),
                    source("shape_pieces.glsl")
                ),
                None => table(measured),
            },
            Kind::Expression(expression) => of_expression(expression),
        },
    };
    let mut text = format!("const float BRANCH_START_RATE = {};\n{at}#ifdef MERGE\n", literal(function.at(1.0).rate));
    match function {
        Function::Linear | Function::Quadratic => text.push_str(&newton(1, true)),
        Function::Shaped(shape) => match (&shape.kind, shape.newton()) {
            (Kind::Exponential { .. }, _) => text.push_str(source("merge_exponential.glsl")),
            (_, Some(plan)) => text.push_str(&newton(plan.steps, plan.by_rate)),
            (_, None) => {
                text.push_str(&stretches(function, shape));
                text.push_str(source("merge_turns.glsl"));
            }
        },
    }
    text.push_str("#endif\n");
    text.replace("BRANCH", name)
}

fn newton(steps: u32, by_rate: bool) -> String {
    let refine = "near = BRANCH_at(max(0.0, s - shift), r + shift);\n    \
                  beyond = BRANCH_newton(excess_at(near, here, excess, shift, gap, rate), near, gap, rate);\n    \
                  beyond = clamp(beyond, -0.999 * (r + shift), s - shift);\n    \
                  shift += beyond;\n    ";
    let define = if by_rate { "#define BRANCH_BY_RATE 1\n" } else { "" };
    define.to_owned()
        + &source("merge_newton.glsl").replacen(
            "    REFINE\n",
            &("    ".to_owned() + &refine.repeat(steps as usize) + "\n"),
            1,
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

fn logarithmic(rate: f64) -> String {
    let scale = 1.0 / rate.ln_1p();
    format!(
        "ShapePoint BRANCH_at(float s, float r) {{\n    \
         float whole = 1.0 / (1.0 + {rate} * s);\n    \
         float rate = {speed} * whole;\n    \
         return ShapePoint({scale} * log_one_plus({rate} * s), {negative} * log_one_plus({share} * r), rate, \
         {rate} * rate * whole);\n}}\n",
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
    let ends = expression.end_polynomials();
    let close = |x: &str, powers: &Option<Vec<f64>>| {
        let Some(powers) = powers else { return String::new() };
        let sum: Vec<f64> = powers.iter().enumerate().map(|(k, c)| c / (k + 1) as f64).collect();
        let (small, bend) = (horner(&sum, x), horner(&derivative(powers), x));
        let point = if x == "s" {
            "small, 1.0 - small, max(0.0, rate), -bend"
        } else {
            "1.0 - small, small, max(0.0, rate), bend"
        };
        format!(
            "    if ({x} < {}) {{\n        float small = max(0.0, {x} * ({small}));\n        float rate = {};\n        \
             float bend = {bend};\n        return ShapePoint({point});\n    }}\n",
            literal(END),
            horner(powers, x)
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
