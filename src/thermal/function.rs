//! Response functions: the share of the way done against the share of the time gone.
//!
//! A function f(s) on [0, 1] has f(0) = 0 and f(1) = 1 and never decreases: T = old + (target - old) f(s). The program uses the share of the way left, w =
//! 1 - f, against the share of the time left, r = 1 - s. Near the end of a transition, where w is small, w then keeps its relative accuracy.

use std::fmt;
use std::sync::{Arc, OnceLock};

mod error;
mod expression;
mod measured;
pub(crate) mod parse;
pub(crate) mod pieces;
mod polynomial;

pub(crate) use error::FunctionError;
pub(crate) use expression::Expression;
pub(crate) use measured::MeasuredFunction;
pub use measured::TemperatureSample;
use pieces::FunctionPieces;
pub(crate) use polynomial::Polynomial;

/// Largest rate of an exponential. Beyond about 700 the share left would leave the range of f64.
const MAX_EXPONENTIAL_RATE: f64 = 500.0;
/// Smallest rate. The function then differs from 'linear' by 1e-10, and far below it its differences leave the range of f64.
const LEAST_RATE: f64 = 1e-9;
/// Largest rate of a logarithm, whose start is then 1e4 times as steep as its end.
const MAX_LOGARITHMIC_RATE: f64 = 1e4;
/// Shortest time at the end without any way left that counts as more than rounding, as a share of the whole time.
const SHORTEST_REST: f64 = 1e-6;

/// The share of the way done against the share of the time gone.
#[derive(Debug, Clone, PartialEq)]
pub enum Function {
    /// Equations 1 and 2 of Vural et al. 2023.
    Linear,
    /// Equations 3 and 4 of Vural et al. 2023, constant after `t_max`.
    Quadratic,
    /// Any other function, already checked.
    Shaped(Arc<FunctionShape>),
}

/// A function that is not a power.
#[derive(Debug, Clone)]
pub struct FunctionShape {
    pub(crate) kind: FunctionKind,
    /// Share of the time in which the way is done, below 1 where the function reaches its target early.
    active: f64,
    /// Made when they are first asked for, because a table of materials has many functions that a scene does not use.
    pieces: OnceLock<FunctionPieces>,
}

/// The kind decides everything else.
impl PartialEq for FunctionShape {
    fn eq(&self, other: &Self) -> bool {
        self.kind == other.kind
    }
}

/// The kinds of function that are not powers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum FunctionKind {
    /// A sum of powers of s.
    Polynomial(Polynomial),
    /// (1 - e^-ks) / (1 - e^-k).
    Exponential {
        /// The rate k, above 0.
        rate: f64,
    },
    /// ln(1 + ks) / ln(1 + k).
    Logarithmic {
        /// The rate k, above 0.
        rate: f64,
    },
    /// Measured times and temperatures, interpolated by a monotone cubic.
    Table(MeasuredFunction),
    /// GLSL text of s.
    Expression(Expression),
}

impl Function {
    /// The polynomial f = c0 + c1 s + c2 s^2 + ...
    ///
    /// # Errors
    /// A sum that does not lead from 0 to 1, or that decreases in between.
    pub fn polynomial(coefficients: &[f64]) -> Result<Self, FunctionError> {
        Self::shaped(FunctionKind::Polynomial(Polynomial::new(coefficients)?))
    }

    /// f = (1 - e^-ks) / (1 - e^-k).
    ///
    /// # Errors
    /// A rate that is not above 0, or beyond 500.
    pub fn exponential(rate: f64) -> Result<Self, FunctionError> {
        check_rate("exponential", rate, MAX_EXPONENTIAL_RATE)?;
        Self::shaped(FunctionKind::Exponential { rate })
    }

    /// f = ln(1 + ks) / ln(1 + k).
    ///
    /// # Errors
    /// A rate that is not above 0, or beyond 1e4.
    pub fn logarithmic(rate: f64) -> Result<Self, FunctionError> {
        check_rate("logarithmic", rate, MAX_LOGARITHMIC_RATE)?;
        Self::shaped(FunctionKind::Logarithmic { rate })
    }

    /// A table of measured samples, normalised in time and in temperature. Where the measurement ends before its `target` [K], it continues at its last
    /// rate until it reaches the target.
    ///
    /// # Errors
    /// The first sample that is not valid, with its row.
    pub fn table(samples: &[TemperatureSample], target: Option<f64>) -> Result<Self, FunctionError> {
        Self::shaped(FunctionKind::Table(MeasuredFunction::new(samples, target)?))
    }

    /// A table from a CSV file with the columns `time` and `temperature` [K].
    ///
    /// # Errors
    /// A file that cannot be read, or its first bad row.
    pub(crate) fn read_table(path: &std::path::Path, target: Option<f64>) -> Result<Self, FunctionError> {
        Self::shaped(FunctionKind::Table(MeasuredFunction::read(path, target)?))
    }

    /// A table from the text of a CSV file, as if it lay at `path`.
    ///
    /// # Errors
    /// Its first bad row.
    pub fn parse_table(text: &str, path: &std::path::Path, target: Option<f64>) -> Result<Self, FunctionError> {
        Self::shaped(FunctionKind::Table(MeasuredFunction::parse(text, path, target)?))
    }

    /// An expression from GLSL text of `s`, compiled by naga.
    ///
    /// # Errors
    /// Text that does not parse, that contains more than arithmetic, or that is not a response function.
    pub fn expression(text: &str) -> Result<Self, FunctionError> {
        Self::shaped(FunctionKind::Expression(Expression::new(text)?))
    }

    fn shaped(kind: FunctionKind) -> Result<Self, FunctionError> {
        let active = 1.0 - idle_share(&kind);
        let shape = FunctionShape { kind, active, pieces: OnceLock::new() };
        if !shape.is_plain() {
            shape.check()?;
        }
        Ok(Self::Shaped(Arc::new(shape)))
    }

    /// Makes the pieces and checks that they follow the function. Where a quick look has not shown it, this was done when the function was made.
    ///
    /// # Errors
    /// A function that changes too fast.
    pub(crate) fn check(&self) -> Result<(), FunctionError> {
        match self {
            Self::Linear | Self::Quadratic => Ok(()),
            Self::Shaped(shape) => shape.check(),
        }
    }

    /// Name of the kind in scene files.
    pub(crate) fn kind_name(&self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Quadratic => "quadratic",
            Self::Shaped(shape) => shape.kind.name(),
        }
    }

    pub(crate) fn power(&self) -> Option<f64> {
        match self {
            Self::Linear => Some(1.0),
            Self::Quadratic => Some(2.0),
            Self::Shaped(_) => None,
        }
    }

    /// Share of the way left when the share `r` of the time is left.
    pub(crate) fn remaining(&self, r: f64) -> f64 {
        match self {
            Self::Linear => r,
            Self::Quadratic => r * r,
            Self::Shaped(shape) => shape.kind.remaining(r),
        }
    }

    /// Share of the way done when the share `s` of the time is gone: f(s).
    pub fn done(&self, s: f64) -> f64 {
        1.0 - self.remaining(1.0 - s.clamp(0.0, 1.0))
    }

    /// Share of the time in which the way is done, below 1 where the function reaches its target early.
    pub(crate) fn active(&self) -> f64 {
        match self {
            Self::Linear | Self::Quadratic => 1.0,
            Self::Shaped(shape) => shape.active,
        }
    }

    /// The function as the device evaluates it, over the time in which the way is done.
    pub(crate) fn pieces(&self) -> FunctionPieces {
        match self {
            Self::Linear | Self::Quadratic => FunctionPieces::new(&|r| self.remaining(r)),
            Self::Shaped(shape) => shape.pieces().clone(),
        }
    }
}

impl FunctionShape {
    /// Share of the way left when the share `r` of the active time is left.
    fn remaining(&self, r: f64) -> f64 {
        self.kind.remaining(1.0 - self.active + self.active * r)
    }

    fn pieces(&self) -> &FunctionPieces {
        self.pieces.get_or_init(|| FunctionPieces::new(&|r| self.remaining(r)))
    }

    /// Whether its pieces follow it, as far as a quick look shows.
    fn is_plain(&self) -> bool {
        match self.kind {
            // A piece errs by at most h^2/8 times the second derivative in v, s f'' + f' for s = v^2/2 in [0, 1/2], which is below 2 (k + 1) here. With
            // h = 2^-14 and a rate of 500 this is 5e-7. A logarithm's is below 1.5 k / ln(1 + k), 8e-7 for a rate of 1e4.
            FunctionKind::Exponential { .. } | FunctionKind::Logarithmic { .. } => true,
            FunctionKind::Polynomial(_) | FunctionKind::Table(_) | FunctionKind::Expression(_) => {
                pieces::are_plain(&|r| self.remaining(r))
            }
        }
    }

    fn check(&self) -> Result<(), FunctionError> {
        let FunctionPieces { error, worst, .. } = *self.pieces();
        // Not the opposite, which a NaN would pass.
        let is_close = error <= pieces::LARGEST_ERROR;
        if is_close {
            return Ok(());
        }
        Err(FunctionError::Sharp { function: self.kind.name(), s: self.active * worst, error })
    }
}

impl FunctionKind {
    /// Name in scene files.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Polynomial(_) => "polynomial",
            Self::Exponential { .. } => "exponential",
            Self::Logarithmic { .. } => "logarithmic",
            Self::Table(_) => "table",
            Self::Expression(_) => "expression",
        }
    }

    /// Share of the way left when the share `r` of the time is left.
    pub(crate) fn remaining(&self, r: f64) -> f64 {
        match self {
            Self::Polynomial(polynomial) => polynomial.remaining(r),
            // e^-ks - e^-k = e^-ks (1 - e^-kr) does not cancel near the end.
            Self::Exponential { rate } => (-rate * (1.0 - r)).exp() / (-rate).exp_m1() * (-rate * r).exp_m1(),
            // ln(1 + k) - ln(1 + ks) = -ln(1 - kr / (1 + k)) does not cancel near the end.
            Self::Logarithmic { rate } => -(-rate * r / (1.0 + rate)).ln_1p() / rate.ln_1p(),
            Self::Table(measured) => measured.remaining(r),
            Self::Expression(expression) => expression.remaining(r),
        }
    }
}

/// The share of the time at the end without any way left, by bisection.
fn idle_share(kind: &FunctionKind) -> f64 {
    if !matches!(kind, FunctionKind::Table(_) | FunctionKind::Expression(_)) || kind.remaining(SHORTEST_REST) > 0.0 {
        return 0.0;
    }
    let (mut none, mut some) = (SHORTEST_REST, 1.0);
    while some - none > f64::EPSILON {
        let middle = 0.5 * (none + some);
        if kind.remaining(middle) > 0.0 { some = middle } else { none = middle }
    }
    none
}

fn check_rate(function: &'static str, rate: f64, largest: f64) -> Result<(), FunctionError> {
    if (LEAST_RATE..=largest).contains(&rate) {
        Ok(())
    } else {
        Err(FunctionError::Rate { function, rate, least: LEAST_RATE, largest })
    }
}

impl fmt::Display for Function {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Linear | Self::Quadratic => write!(out, "{}", self.kind_name()),
            Self::Shaped(shape) => match &shape.kind {
                FunctionKind::Polynomial(polynomial) => write!(out, "polynomial {:?}", polynomial.coefficients()),
                FunctionKind::Exponential { rate } => write!(out, "exponential, rate {rate}"),
                FunctionKind::Logarithmic { rate } => write!(out, "logarithmic, rate {rate}"),
                FunctionKind::Table(measured) => write!(out, "table of {} points", measured.len()),
                FunctionKind::Expression(expression) => write!(out, "expression {}", expression.text()),
            },
        }
    }
}

#[cfg(test)]
mod tests;
