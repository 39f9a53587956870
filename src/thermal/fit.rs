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

use crate::thermal::material::Domain;

mod data;
mod response;
mod search;
mod table;
#[cfg(test)]
mod tests;

pub use crate::thermal::function::Sample;
use data::Data;
pub use data::{FEWEST_ROWS, FitError};
use response::NOTHING;
pub use response::{Fit, Response};
use search::{KINDS, Problem};

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fits {
    /// Every kind that can be had, the best first.
    pub best: Vec<Fit>,
    /// Kinds that cannot, with the reason.
    pub left_out: Vec<(&'static str, String)>,
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
