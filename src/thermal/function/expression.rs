//! A response function given as GLSL text of s: compiled by naga, checked, and evaluated in f64.
//!
//! The text becomes the body of a shader function, so its syntax is exactly GLSL. The compiled form is then translated operation by operation.
//! Arithmetic, comparisons, `?:` and functions without state (exp, pow, mix, smoothstep, ...) are allowed. Everything else is refused.

mod program;

use super::error::FunctionError;
use program::ExpressionProgram;

/// Number of intervals at whose ends a text is checked.
const SAMPLES: u32 = 4096;
/// Largest error of f(0) and f(1), which covers rounded constants. f is then scaled to meet 0 and 1.
const END_TOLERANCE: f64 = 1e-5;
/// Most negative rate that counts as rounding of the text's constants.
const RATE_TOLERANCE: f64 = 1e-6;
/// A change within a billionth of the time is a jump.
const JUMP: f64 = 1e-4;

/// GLSL text of `s`, compiled.
#[derive(Debug, Clone)]
pub(crate) struct Expression {
    text: String,
    program: ExpressionProgram,
    /// f at 0, and 1 / (f(1) - f(0)).
    start: f64,
    scale: f64,
}

impl PartialEq for Expression {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

impl Expression {
    pub(super) fn new(text: &str) -> Result<Self, FunctionError> {
        let text = text.trim().to_owned();
        let program = ExpressionProgram::compile(&text)
            .map_err(|message| FunctionError::Expression { text: text.clone(), message })?;
        let mut expression = Self { text, program, start: 0.0, scale: 1.0 };
        expression.check()?;
        let (start, end) = (expression.program.run(0.0), expression.program.run(1.0));
        (expression.start, expression.scale) = (start, 1.0 / (end - start));
        Ok(expression)
    }

    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    pub(super) fn remaining(&self, r: f64) -> f64 {
        (1.0 - (self.program.run(1.0 - r) - self.start) * self.scale).clamp(0.0, 1.0)
    }

    fn check(&self) -> Result<(), FunctionError> {
        let function = "expression";
        let f = |s: f64| self.program.run(s);
        let mut before = (0.0, f(0.0));
        for step in 0..=SAMPLES {
            let s = f64::from(step) / f64::from(SAMPLES);
            let value = f(s);
            if !value.is_finite() {
                return Err(FunctionError::NotFinite { function, what: "f is not finite", s });
            }
            if value < before.1 - RATE_TOLERANCE * (s - before.0) - 1e-12 {
                let rate = (value - before.1) / (s - before.0);
                return Err(FunctionError::Falls { function, s: before.0, value: before.1, rate });
            }
            let (mut low, mut high) = (before, (s, value));
            while high.1 - low.1 > JUMP {
                let s = 0.5 * (low.0 + high.0);
                if high.0 - low.0 < 1e-9 {
                    return Err(FunctionError::NotFinite { function, what: "f jumps", s });
                }
                let middle = (s, f(s));
                if middle.1 - low.1 > high.1 - middle.1 { high = middle } else { low = middle }
            }
            before = (s, value);
        }
        for (s, wanted) in [(0.0, 0.0), (1.0, 1.0)] {
            let value = f(s);
            if (value - wanted).abs() > END_TOLERANCE {
                return Err(FunctionError::End { function, s, wanted, value });
            }
        }
        Ok(())
    }
}
