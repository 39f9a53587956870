//! A fitted step response, and its difference from the data.

use super::data::FitData;
use crate::thermal::function::Function;
use crate::thermal::material::Domain;

/// Residuals below this share of the data's range count as 0.
pub(super) const NOTHING: f64 = 1e-6;

/// Share of the data's range above which the largest difference is poor.
const POOR: f64 = 0.05;
/// Multiple of the length of the data above which t_max is a far extrapolation.
const FAR: f64 = 3.0;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FittedResponse {
    pub(crate) function: Function,
    pub(crate) domain: Domain,
    /// Time to the target, in the unit of the data.
    pub(crate) t_max: f64,
    /// Initial temperature [K].
    pub(crate) initial: f64,
    /// Target [K].
    pub(crate) target: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fit {
    /// The response, which starts at the temperature of the first row.
    pub(crate) response: FittedResponse,
    pub(crate) parameters: usize,
    /// Root mean square of the differences from the data [K].
    pub(crate) rms: f64,
    /// Largest difference [K].
    pub(crate) max: f64,
    /// Whether the response ends after the last row. t_max is then an extrapolation.
    pub(crate) ends_after_data: bool,
    /// t_max over the time of the last row.
    pub(crate) of_data: f64,
    /// `max` as a share of the range of the data.
    pub(crate) share: f64,
    /// Fitted numbers that are at a bound of the search, in words. The data do not determine them.
    pub(crate) at_bounds: Vec<&'static str>,
}

impl FittedResponse {
    /// Temperature [K] at a time after the first row.
    pub(crate) fn temperature(&self, time: f64) -> f64 {
        let done = self.function.done(time / self.t_max);
        let (initial, target) = (self.domain.of(self.initial), self.domain.of(self.target));
        self.domain.temperature(initial * (1.0 - done) + target * done)
    }
}

impl Fit {
    /// Compares a response with rows of (time since the first row, temperature [K]).
    pub(super) fn new(
        response: FittedResponse,
        parameters: usize,
        data: &FitData,
        rows: &[[f64; 2]],
        at_bounds: Vec<&'static str>,
    ) -> Self {
        let differences: Vec<f64> = rows.iter().map(|[time, t]| response.temperature(*time) - t).collect();
        let mean = differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64;
        let max = differences.iter().fold(0.0f64, |max, d| max.max(d.abs()));
        Self {
            parameters,
            rms: mean.sqrt(),
            max,
            ends_after_data: response.t_max > data.last_time() * (1.0 + 1e-9),
            of_data: response.t_max / data.last_time(),
            share: max / data.range,
            at_bounds,
            response,
        }
    }

    /// Reasons not to trust the fit, in words.
    pub(crate) fn doubts(&self) -> Vec<String> {
        let mut doubts = Vec::new();
        if self.share > POOR {
            doubts.push(format!("it is up to {:.3} K off the data, {:.0} % of the step", self.max, 100.0 * self.share));
        }
        if !self.at_bounds.is_empty() {
            let names = self.at_bounds.join(" and ");
            doubts.push(format!("{names} at a bound of the search: the data do not determine it"));
        }
        if self.of_data > FAR {
            doubts.push(format!("its t_max is extrapolated to {:.1} times the length of the data", self.of_data));
        }
        doubts
    }
}
