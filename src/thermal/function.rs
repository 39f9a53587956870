//! Response functions: the share of the way done as a function of the share of the time gone.
//!
//! A function is f(s) on [0, 1] with f(0) = 0 and f(1) = 1, nowhere falling: T = old + (target - old) f(s). The rest of
//! the program asks for what is left of the way, w = 1 - f, against the share of the time that is left, r = 1 - s:
//! so the end of a transition, where w is small, keeps its relative accuracy.

use std::fmt;
use std::sync::Arc;

pub mod cubics;
mod error;
mod expression;
mod flow;
mod measured;
mod pace;
pub mod parse;
pub mod phase;
mod polynomial;

use cubics::Cubics;
pub use error::FunctionError;
pub use expression::glsl::literal;
pub use expression::{EndPolynomial, Expression};
use flow::Flow;
pub use measured::{Measured, Sample};
pub use pace::{HALF, Pace, WIDTH};
pub use phase::Superposition;
pub use polynomial::Polynomial;

/// Largest rate of an exponential; the share that is left would leave the range of f64 beyond about 700.
const MAX_EXPONENTIAL_RATE: f64 = 500.0;
/// Rate of an exponential from which the device takes the closed form of its merge in place of its pace. That of
/// a lower rate loses digits: on a saw of 500 K in 361 steps it is 7.5e-4 K off at a rate of 0.1.
const CLOSED_FORM_RATE: f64 = 1.0;
/// Largest rate of a logarithm: its start is 1e4 times as steep as its end.
const MAX_LOGARITHMIC_RATE: f64 = 1e4;

/// Points of a table beyond which the device reads its pieces from a buffer.
pub const MAX_POINTS_WRITTEN_OUT: usize = 24;

/// The share of the way done as a function of the share of the time gone.
#[derive(Debug, Clone, PartialEq)]
pub enum Function {
    /// Equations 1 and 2 of Vural et al. 2023.
    Linear,
    /// Equations 3 and 4 of Vural et al. 2023, held at the target after `t_max`.
    Quadratic,
    /// Any other, checked when it was made.
    Shaped(Arc<Shape>),
}

/// A function that is no power, and where its relative rate turns.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// What it is.
    pub kind: Kind,
    /// Extrema of the relative rate, as shares of the time left, rising; none where it grows throughout.
    turns: Vec<f64>,
    /// How fast the phase moves with the gap; none where the device must search for it, or has a closed form.
    pace: Option<Pace>,
    /// Pieces that the device reads where a table is too long to be written out.
    cubics: Option<Cubics>,
}

/// The kinds of function that are no power.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// A sum of powers of s.
    Polynomial(Polynomial),
    /// (1 - e^-ks) / (1 - e^-k).
    Exponential {
        /// k, above 0.
        rate: f64,
    },
    /// ln(1 + ks) / ln(1 + k).
    Logarithmic {
        /// k, above 0.
        rate: f64,
    },
    /// Measured times and temperatures, joined by a monotone cubic.
    Table(Measured),
    /// GLSL text of s.
    Expression(Expression),
}

/// A function at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Share of the way that is left: w = 1 - f.
    pub left: f64,
    /// How fast it falls: f' = df/ds, in spans over `t_max`.
    pub rate: f64,
}

impl Point {
    /// Relative rate f'/w, in 1 over `t_max`; infinite where nothing is left.
    pub fn relative_rate(self) -> f64 {
        if self.left > 0.0 { self.rate / self.left } else { f64::INFINITY }
    }
}

impl Function {
    /// f = c0 + c1 s + c2 s^2 + ...
    ///
    /// # Errors
    /// A sum that does not lead from 0 to 1, or falls in between.
    pub fn polynomial(coefficients: &[f64]) -> Result<Self, FunctionError> {
        Self::shaped(Kind::Polynomial(Polynomial::new(coefficients)?))
    }

    /// f = (1 - e^-ks) / (1 - e^-k).
    ///
    /// # Errors
    /// A rate that is not above 0, or beyond 500.
    pub fn exponential(rate: f64) -> Result<Self, FunctionError> {
        check_rate("exponential", rate, MAX_EXPONENTIAL_RATE)?;
        Self::shaped(Kind::Exponential { rate })
    }

    /// f = ln(1 + ks) / ln(1 + k).
    ///
    /// # Errors
    /// A rate that is not above 0, or beyond 1e4.
    pub fn logarithmic(rate: f64) -> Result<Self, FunctionError> {
        check_rate("logarithmic", rate, MAX_LOGARITHMIC_RATE)?;
        Self::shaped(Kind::Logarithmic { rate })
    }

    /// Measured samples, normalised in time and in temperature. Where the measurement stopped short of its `target`
    /// [K], it goes on at its last rate until there.
    ///
    /// # Errors
    /// The first sample that cannot be, with its row.
    pub fn table(samples: &[Sample], target: Option<f64>) -> Result<Self, FunctionError> {
        Self::shaped(Kind::Table(Measured::new(samples, target)?))
    }

    /// The same from a CSV file with the columns `time` and `temperature` [K].
    ///
    /// # Errors
    /// A file that cannot be read, or its first bad row.
    pub fn read_table(path: &std::path::Path, target: Option<f64>) -> Result<Self, FunctionError> {
        Self::shaped(Kind::Table(Measured::read(path, target)?))
    }

    /// GLSL text of `s`, compiled by naga.
    ///
    /// # Errors
    /// Text that does not parse, does more than arithmetic, or is no response function.
    pub fn expression(text: &str) -> Result<Self, FunctionError> {
        Self::shaped(Kind::Expression(Expression::new(text)?))
    }

    fn shaped(kind: Kind) -> Result<Self, FunctionError> {
        let long = matches!(&kind, Kind::Table(measured) if measured.len() > MAX_POINTS_WRITTEN_OUT);
        let cubics = long.then(|| Cubics::new(&|r| kind.at(r)));
        if let Some(Cubics { error, worst, .. }) = cubics
            && error > cubics::LARGEST_ERROR
        {
            return Err(FunctionError::Sharp { function: kind.name(), s: worst, error });
        }
        let turns = phase::turns(&kind);
        let closed = matches!(kind, Kind::Exponential { rate } if rate >= CLOSED_FORM_RATE);
        let pace = if !turns.is_empty() {
            Some(Pace::limited(&kind))
        } else if closed {
            None
        } else {
            Flow::new(&kind).map(|flow| Pace::of_flow(&flow))
        };
        Ok(Self::Shaped(Arc::new(Shape { kind, turns, pace, cubics })))
    }

    /// Name of the kind, as scene files write it.
    pub fn kind_name(&self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Quadratic => "quadratic",
            Self::Shaped(shape) => shape.kind.name(),
        }
    }

    /// The power of a power function.
    pub fn power(&self) -> Option<f64> {
        match self {
            Self::Linear => Some(1.0),
            Self::Quadratic => Some(2.0),
            Self::Shaped(_) => None,
        }
    }

    /// Share of the way left and its rate when the share `r` of the time is left.
    pub fn at(&self, r: f64) -> Point {
        match self {
            Self::Linear => Point { left: r, rate: 1.0 },
            Self::Quadratic => Point { left: r * r, rate: 2.0 * r },
            Self::Shaped(shape) => shape.kind.at(r),
        }
    }

    /// Share of the way left when the share `r` of the time is left.
    pub fn remaining(&self, r: f64) -> f64 {
        self.at(r).left
    }

    /// Share of the way done when the share `s` of the time is gone: f(s).
    pub fn done(&self, s: f64) -> f64 {
        1.0 - self.remaining(1.0 - s.clamp(0.0, 1.0))
    }

    /// The share of the time left at which the transition goes on when its target moves (see [`phase`]). `r` is the
    /// share of the time left.
    pub fn merged_phase(&self, r: f64, sum: Superposition) -> f64 {
        match self {
            Self::Linear | Self::Quadratic => phase::merged_power(r, sum),
            Self::Shaped(shape) => match shape.kind {
                Kind::Exponential { rate } => phase::merged_exponential(rate, r, sum),
                _ if !shape.turns.is_empty() && sum.change.abs() <= phase::STEP => {
                    shape.pace.as_ref().map_or(r, |pace| pace.followed(r, -(-sum.change).ln_1p()))
                }
                _ => phase::merged(&shape.kind, &shape.turns, r, sum),
            },
        }
    }
}

impl Shape {
    /// Shares of the time left at which the relative rate has an extremum, rising.
    pub fn turns(&self) -> &[f64] {
        &self.turns
    }

    /// How fast the phase moves with the gap; `None` where the device must search for it, or has a closed form.
    pub fn pace(&self) -> Option<&Pace> {
        self.pace.as_ref()
    }

    /// The cubic pieces that the device reads, of a long table.
    pub fn cubics(&self) -> Option<&Cubics> {
        self.cubics.as_ref()
    }
}

impl Kind {
    /// Name, as scene files write it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Polynomial(_) => "polynomial",
            Self::Exponential { .. } => "exponential",
            Self::Logarithmic { .. } => "logarithmic",
            Self::Table(_) => "table",
            Self::Expression(_) => "expression",
        }
    }

    /// Share of the way left and its rate when the share `r` of the time is left.
    pub fn at(&self, r: f64) -> Point {
        match self {
            Self::Polynomial(polynomial) => polynomial.at(r),
            // e^-ks - e^-k = e^-ks (1 - e^-kr): no cancellation towards the end.
            Self::Exponential { rate } => {
                let scale = (-rate * (1.0 - r)).exp() / (-rate).exp_m1();
                Point { left: scale * (-rate * r).exp_m1(), rate: -rate * scale }
            }
            // ln(1 + k) - ln(1 + ks) = -ln(1 - kr / (1 + k)), likewise.
            Self::Logarithmic { rate } => {
                let scale = 1.0 / rate.ln_1p();
                Point {
                    left: -scale * (-rate * r / (1.0 + rate)).ln_1p(),
                    rate: scale * rate / (1.0 + rate * (1.0 - r)),
                }
            }
            Self::Table(measured) => measured.at(r),
            Self::Expression(expression) => expression.at(r),
        }
    }
}

fn check_rate(function: &'static str, rate: f64, largest: f64) -> Result<(), FunctionError> {
    if rate > 0.0 && rate <= largest { Ok(()) } else { Err(FunctionError::Rate { function, rate, largest }) }
}

impl fmt::Display for Function {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Linear | Self::Quadratic => write!(out, "{}", self.kind_name()),
            Self::Shaped(shape) => match &shape.kind {
                Kind::Polynomial(polynomial) => write!(out, "polynomial {:?}", polynomial.coefficients()),
                Kind::Exponential { rate } => write!(out, "exponential, rate {rate}"),
                Kind::Logarithmic { rate } => write!(out, "logarithmic, rate {rate}"),
                Kind::Table(measured) => write!(out, "table of {} points", measured.len()),
                Kind::Expression(expression) => write!(out, "expression {}", expression.text()),
            },
        }
    }
}

#[cfg(test)]
mod tests;
