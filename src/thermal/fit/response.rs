//! A fitted step response, and its difference from the data.

use super::data::Data;
use crate::thermal::function::Function;
use crate::thermal::material::Domain;

/// Residuals below this share of the data's range count as 0.
pub(super) const NOTHING: f64 = 1e-6;

/// A step response.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Response function.
    pub function: Function,
    /// Domain of the function.
    pub domain: Domain,
    /// Time to the target, in the unit of the data.
    pub t_max: f64,
    /// Initial temperature [K].
    pub initial: f64,
    /// Target [K].
    pub target: f64,
}

/// The best fit of a kind in a domain.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The response. It starts at the temperature of the first row.
    pub response: Response,
    /// Number of free parameters.
    pub parameters: usize,
    /// Root mean square of the differences from the data [K].
    pub rms: f64,
    /// Largest difference [K].
    pub max: f64,
    /// Whether the response ends after the last row. t_max is then an extrapolation.
    pub ends_after_data: bool,
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
    /// Compares a response with rows of (time since the first row, temperature [K]).
    pub(super) fn new(response: Response, parameters: usize, data: &Data, rows: &[[f64; 2]]) -> Self {
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
