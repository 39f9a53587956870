//! Which function and t_max follow a measured step response best.
//!
//! A step response starts at rest, at the temperature of its first row, and moves to one target. For every kind of
//! function, in T and in T^4, t_max, the function's own numbers and (where it is not given) the target are found by
//! least squares on the temperatures. A table goes through all rows by itself, so it is judged by what it misses where
//! it is made of every second row only. The kinds are ordered by Schwarz's criterion, n ln(mean square) + p ln n with
//! p free numbers (Schwarz, "Estimating the dimension of a model", 1978): a function with more numbers must earn them.
//!
//! Where the end of the response is not in the data, some kinds fit alike with every later end, since a part of a line,
//! of a logarithm or of an exponential is again one. Then a line, a logarithm and a polynomial end with the data, and an
//! exponential ends where 0.1 % of its way is left, so that its target is its asymptote.

use crate::thermal::function::Function;
use crate::thermal::material::Domain;

mod data;
mod search;
mod table;
#[cfg(test)]
mod tests;

pub use crate::thermal::function::Sample;
use data::Data;
pub use data::{FEWEST_ROWS, FitError};
use search::{KINDS, Problem};

/// Residuals below this share of the data's range tell nothing.
const NOTHING: f64 = 1e-6;

/// A step response.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Which function.
    pub function: Function,
    /// What it is applied to.
    pub domain: Domain,
    /// Time to the target, in the unit of the data.
    pub t_max: f64,
    /// Initial temperature [K].
    pub initial: f64,
    /// Target [K].
    pub target: f64,
}

/// The best that a kind can do in a domain.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The response; it starts at the temperature of the first row.
    pub response: Response,
    /// Free numbers.
    pub parameters: usize,
    /// Root mean square of the differences from the data [K].
    pub rms: f64,
    /// Largest difference [K].
    pub max: f64,
    /// Whether the response ends after the last row, so that t_max is an extrapolation.
    pub ends_after_data: bool,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fits {
    /// Every kind that can be had, the best first.
    pub best: Vec<Fit>,
    /// Kinds that cannot, with the reason.
    pub left_out: Vec<(&'static str, String)>,
}

impl Response {
    /// Temperature [K] at a time after the first row.
    pub fn temperature(&self, time: f64) -> f64 {
        let done = self.function.done(time / self.t_max);
        let (initial, target) = (self.domain.of(self.initial), self.domain.of(self.target));
        self.domain.temperature(initial * (1.0 - done) + target * done)
    }
}

impl Fit {
    /// A response held against rows of (time since the first row, temperature [K]).
    fn new(response: Response, parameters: usize, data: &Data, rows: &[[f64; 2]]) -> Self {
        let differences: Vec<f64> = rows.iter().map(|[time, t]| response.temperature(*time) - t).collect();
        let mean = differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64;
        Self {
            parameters,
            rms: mean.sqrt(),
            max: differences.iter().fold(0.0, |max, d| max.max(d.abs())),
            ends_after_data: response.t_max > data.last_time() * (1.0 + 1e-9),
            response,
        }
    }
}

/// Fits every kind in both domains; a table only in T, where it is the same curve as in T^4 but for what lies between
/// its rows.
///
/// # Errors
/// Data that are no step response, or a target [K] that cannot be theirs.
pub fn fit(samples: &[Sample], target: Option<f64>) -> Result<Fits, FitError> {
    let data = Data::new(samples, target)?;
    let mut fits = Fits { best: Vec::new(), left_out: Vec::new() };
    let domains = [Domain::Temperature, Domain::FourthPower];
    let problems = KINDS.iter().flat_map(|kind| domains.map(|domain| Problem { data: &data, kind: *kind, domain }));
    for problem in problems {
        match problem.solve() {
            Ok(fit) => fits.best.push(fit),
            Err(error) => fits.left_out.push((problem.kind.name(), error.to_string())),
        }
    }
    match table::fit(&data, samples) {
        Ok(fit) => fits.best.push(fit),
        Err(error) => fits.left_out.push(("table", error.to_string())),
    }
    let n = data.rows.len() as f64;
    let floor = NOTHING * data.range;
    let criterion = |fit: &Fit| n * (fit.rms * fit.rms + floor * floor).ln() + fit.parameters as f64 * n.ln();
    fits.best.sort_by(|a, b| criterion(a).total_cmp(&criterion(b)));
    Ok(fits)
}
