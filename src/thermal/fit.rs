//! Fits the response function and t_max that follow a measured step response best.
//!
//! A step response starts at rest at the temperature of its first row and moves to one target. For every kind of function, in T and in T^4, least
//! squares on the temperatures find t_max, the parameters of the function and (where it is not given) the target. A table meets all rows exactly. The
//! error is therefore measured with a table of every second row, at the other rows. The kinds are ordered by Schwarz's criterion, n ln(mean square) +
//! p ln n with p free parameters (Schwarz, "Estimating the dimension of a model", 1978), which penalises free parameters.
//!
//! If the data stop before the end of the response, every later end fits some kinds equally well, because a part of a line, a logarithm or an exponential
//! has the same form. A line, a logarithm and a polynomial then end with the data. An exponential ends where 0.1 % of its way is left, so that its target
//! is its asymptote.

use crate::thermal::material::Domain;

mod data;
mod response;
mod search;
mod table;
#[cfg(test)]
mod tests;

pub(crate) use crate::thermal::function::TemperatureSample;
use data::FitData;
pub(crate) use data::FitError;
pub(crate) use response::Fit;
use response::NOTHING;
use search::{FitProblem, KINDS};

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fits {
    /// Every kind that can be fitted, the best first.
    pub(crate) best: Vec<Fit>,
    /// Kinds that can not be fitted, with the reason.
    pub(crate) left_out: Vec<(&'static str, String)>,
}

/// Fits every kind in both domains. A table is fitted only in T, because in T^4 it differs only between its rows.
///
/// # Errors
/// Data that are not a step response, or a target [K] that contradicts them.
pub(crate) fn fit(samples: &[TemperatureSample], target: Option<f64>) -> Result<Fits, FitError> {
    let data = FitData::new(samples, target)?;
    let mut fits = Fits { best: Vec::new(), left_out: Vec::new() };
    let domains = [Domain::Temperature, Domain::FourthPower];
    let problems = KINDS.iter().flat_map(|kind| domains.map(|domain| FitProblem { data: &data, kind: *kind, domain }));
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
