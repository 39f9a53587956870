//! A response function that the user writes as GLSL text of s: compiled by naga, checked, evaluated in f64.
//!
//! The text is made the body of a shader function and compiled as any other shader, so that what is accepted is what
//! GLSL is. Its compiled form is then read operation by operation: arithmetic, comparisons, `?:` and the functions of
//! one moment (exp, pow, mix, smoothstep, ...) are kept, and all else is refused.

mod dual;
pub mod glsl;
mod program;

use super::{FunctionError, Point};
use dual::Dual;
use program::Program;

/// Operations that a text may come to; the paper's functions take four.
pub const MAX_OPERATIONS: usize = 200;
/// Intervals at whose borders a text is checked.
const SAMPLES: u32 = 4096;
/// How far the ends may miss 0 and 1 (the text's own constants are rounded); f is then scaled to meet them.
const END_TOLERANCE: f64 = 1e-5;
/// How far below 0 a rate may be by the rounding of the text's constants.
const RATE_TOLERANCE: f64 = 1e-6;
/// Steepest rate that is not taken for infinite.
const MAX_RATE: f64 = 1e6;
/// A change over an interval that its rates do not explain is looked into.
const JUMP: f64 = 1e-4;

/// Reaches of the polynomials that stand for a text from its ends, tried one after the other.
const REACHES: [f64; 3] = [0.5, 0.125, 0.031_25];
/// Most terms of such a polynomial.
const END_TERMS: usize = 12;
/// Relative error of a rate that such a polynomial may have.
const END_ERROR: f64 = 1e-7;

/// A rate close to one end of a text, as a polynomial of the distance x to it, or of its root.
#[derive(Debug, Clone, PartialEq)]
pub struct EndPolynomial {
    /// How far from the end it holds.
    pub reach: f64,
    /// Whether it is one of the root of x.
    pub of_root: bool,
    /// Coefficients of what is done since the end, or left until it, over x.
    pub coefficients: Vec<f64>,
}

/// GLSL text of `s`, compiled.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    text: String,
    program: Program,
    /// f at 0, and 1 / (f(1) - f(0)).
    start: f64,
    scale: f64,
}

impl Expression {
    pub(super) fn new(text: &str) -> Result<Self, FunctionError> {
        let text = text.trim().to_owned();
        let program =
            Program::compile(&text).map_err(|message| FunctionError::Expression { text: text.clone(), message })?;
        let mut expression = Self { text, program, start: 0.0, scale: 1.0 };
        expression.check()?;
        let (start, end) = (expression.value(0.0).value, expression.value(1.0).value);
        (expression.start, expression.scale) = (start, 1.0 / (end - start));
        Ok(expression)
    }

    /// The text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Number of operations that it comes to.
    pub fn operations(&self) -> usize {
        self.program.operations()
    }

    /// f at 0, and 1 / (f(1) - f(0)), of the text as it stands.
    pub fn ends(&self) -> [f64; 2] {
        [self.start, self.scale]
    }

    /// First and second derivative at s = 0 and at s = 1, f scaled to end at 1; the second from differences of the first.
    pub fn end_slopes(&self) -> [[f64; 2]; 2] {
        const STEP: f64 = 1e-5;
        let rate = |s: f64| self.value(s).rate * self.scale;
        let (first, last) = (rate(0.0), rate(1.0));
        // One-sided, of second order.
        let bend = |at: f64, one: f64, two: f64| (4.0 * one - 3.0 * at - two) / (2.0 * STEP);
        [
            [first, bend(first, rate(STEP), rate(2.0 * STEP))],
            [last, -bend(last, rate(1.0 - STEP), rate(1.0 - 2.0 * STEP))],
        ]
    }

    /// The polynomials that stand for the text close to its start and to its end; none for an end that is no polynomial
    /// to f32. Two of them that reach the middle stand for all of it.
    ///
    /// A flat end is where a text in f32 loses what is left and its rate to cancellation, and there a merge multiplies
    /// them by the largest spans.
    pub fn end_polynomials(&self) -> [Option<EndPolynomial>; 2] {
        [false, true].map(|end| {
            let rate = |x: f64| self.value(if end { 1.0 - x } else { x }).rate * self.scale;
            REACHES
                .into_iter()
                .flat_map(|reach| [false, true].map(|of_root| (reach, of_root)))
                .find_map(|(reach, of_root)| EndPolynomial::new(&rate, reach, of_root))
        })
    }

    /// GLSL function `vec2 NAME(float s)` of the first and the second derivative of the text as it stands.
    pub fn derivatives(&self, name: &str) -> String {
        glsl::derivatives(&self.program, name)
    }

    pub(super) fn at(&self, r: f64) -> Point {
        let Dual { value, rate } = self.value(1.0 - r);
        Point { left: (1.0 - (value - self.start) * self.scale).clamp(0.0, 1.0), rate: (rate * self.scale).max(0.0) }
    }

    fn value(&self, s: f64) -> Dual {
        self.program.run(s)
    }

    fn check(&self) -> Result<(), FunctionError> {
        let function = "expression";
        let mut before = None;
        for step in 0..=SAMPLES {
            let s = f64::from(step) / f64::from(SAMPLES);
            let at = self.value(s);
            let not_finite = |what| Err(FunctionError::NotFinite { function, what, s });
            if !at.value.is_finite() {
                return not_finite("f is not finite");
            }
            if at.rate.is_nan() || at.rate.abs() > MAX_RATE {
                return not_finite("its rate is not finite");
            }
            if at.rate < -RATE_TOLERANCE {
                return Err(FunctionError::Falls { function, s, value: at.value, rate: at.rate });
            }
            if let Some((s_before, at_before)) = before {
                self.check_interval(s_before, at_before, s, at)?;
            }
            before = Some((s, at));
        }
        for (s, wanted) in [(0.0, 0.0), (1.0, 1.0)] {
            let found = self.value(s).value;
            if (found - wanted).abs() > END_TOLERANCE {
                return Err(FunctionError::End { function, s, wanted, found });
            }
        }
        Ok(())
    }

    /// Refuses a fall between two samples, and a jump: a change that stays however near the two come.
    fn check_interval(&self, s0: f64, at0: Dual, s1: f64, at1: Dual) -> Result<(), FunctionError> {
        let function = "expression";
        let (mut low, mut high) = ((s0, at0), (s1, at1));
        let unexplained = |low: (f64, Dual), high: (f64, Dual)| {
            let by_rates = 0.5 * (low.1.rate + high.1.rate) * (high.0 - low.0);
            (high.1.value - low.1.value - by_rates).abs()
        };
        while unexplained(low, high) > JUMP {
            let s = 0.5 * (low.0 + high.0);
            if high.0 - low.0 < 1e-9 {
                return Err(FunctionError::NotFinite { function, what: "f jumps", s });
            }
            let middle = (s, self.value(s));
            if unexplained(low, middle) > unexplained(middle, high) { high = middle } else { low = middle }
        }
        if at1.value < at0.value - RATE_TOLERANCE * (s1 - s0) - 1e-12 {
            let rate = (at1.value - at0.value) / (s1 - s0);
            return Err(FunctionError::Falls { function, s: s1, value: at1.value, rate });
        }
        Ok(())
    }
}

impl EndPolynomial {
    /// Through Chebyshev's points, by Newton's interpolation; none where it does not follow the rate.
    fn new(rate: &impl Fn(f64) -> f64, reach: f64, of_root: bool) -> Option<Self> {
        let (longest, x) =
            if of_root { (reach.sqrt(), square as fn(f64) -> f64) } else { (reach, same as fn(f64) -> f64) };
        let angle = |i: usize| std::f64::consts::PI * (2 * i + 1) as f64 / (2 * END_TERMS) as f64;
        let places: Vec<f64> = (0..END_TERMS).map(|i| 0.5 * longest * (1.0 - angle(i).cos())).collect();
        let mut divided: Vec<f64> = places.iter().map(|v| rate(x(*v))).collect();
        for order in 1..END_TERMS {
            for i in (order..END_TERMS).rev() {
                divided[i] = (divided[i] - divided[i - 1]) / (places[i] - places[i - order]);
            }
        }
        let mut powers = vec![0.0; END_TERMS];
        for i in (0..END_TERMS).rev() {
            for k in (1..END_TERMS).rev() {
                powers[k] = powers[k - 1] - places[i] * powers[k];
            }
            powers[0] = divided[i] - places[i] * powers[0];
        }
        let size = |k: usize, c: f64| (c * longest.powi(k as i32)).abs();
        let largest = powers.iter().enumerate().fold(0.0, |largest, (k, c)| size(k, *c).max(largest));
        for (k, c) in powers.iter_mut().enumerate() {
            *c = if size(k, *c) < 1e-10 * largest { 0.0 } else { *c };
        }
        while powers.len() > 1 && powers.last() == Some(&0.0) {
            powers.pop();
        }
        let follows = (1..=128).map(|i| longest * f64::from(i) / 128.0).all(|v| {
            let exact = rate(x(v));
            let found = powers.iter().rev().fold(0.0, |sum, c| sum * v + c);
            (found - exact).abs() <= END_ERROR * exact.abs() + 1e-12
        });
        // The integral of c v^k over x is c v^k x / (k + 1), or over (k/2 + 1) where v is the root of x.
        let share = |k: usize| 1.0 + if of_root { 0.5 } else { 1.0 } * k as f64;
        let coefficients = powers.iter().enumerate().map(|(k, c)| c / share(k)).collect();
        follows.then_some(Self { reach, of_root, coefficients })
    }
}

fn same(v: f64) -> f64 {
    v
}

fn square(v: f64) -> f64 {
    v * v
}
