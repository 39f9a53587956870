//! Measured values with their times and standard deviations, by sensor and image.

use super::FittingError;
use crate::scene::{FitInput, HoldOut};

/// A sensor or an image.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MeasuredGroup {
    /// `sensor` or `image`.
    pub(crate) kind: &'static str,
    pub(crate) name: String,
    /// The place of a sensor, in words.
    pub(crate) place: String,
}

/// A measured temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MeasuredPoint {
    pub(crate) group: usize,
    /// Time of the scene [s].
    pub(crate) time: f64,
    /// Temperature [K].
    pub(crate) value: f64,
    /// Standard deviation [K].
    pub(crate) sigma: f64,
    /// Whether it is kept out of the fit.
    pub(crate) held_out: bool,
}

/// All measured values.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Measurements {
    pub(crate) groups: Vec<MeasuredGroup>,
    pub(crate) points: Vec<MeasuredPoint>,
}

impl Measurements {
    /// Keeps values out of the fit, as the file says.
    ///
    /// # Errors
    /// Nothing or everything would be kept out.
    pub(crate) fn hold_out(&mut self, input: &FitInput) -> Result<(), FittingError> {
        let Some(rule) = input.hold_out else { return Ok(()) };
        let times = || self.points.iter().map(|point| point.time);
        let [first, last] = [times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max)];
        let [from, to] = match rule {
            HoldOut::Between(ends) => ends,
            HoldOut::Share(share) => [last - share * (last - first), f64::INFINITY],
        };
        self.points.iter_mut().for_each(|point| point.held_out = (from..=to).contains(&point.time));
        let held = self.held_out();
        if held == 0 || held == self.points.len() {
            let message = format!(
                "keeps {held} of {} measured values out of the fit, from {first} s to {last} s",
                self.points.len()
            );
            return Err(input.error(1, "fit.hold_out", message).into());
        }
        Ok(())
    }

    pub(crate) fn held_out(&self) -> usize {
        self.points.iter().filter(|point| point.held_out).count()
    }
}
