//! The balance by which an error is carried through a step.

use super::materials::{Memory, SurfaceConstants};
use crate::thermal::STEFAN_BOLTZMANN;

/// Lowest temperature that a deviation may reach [K].
const LOWEST: f64 = 3.0;
/// Most conductance-free slope that is 0 [W m-2 K-1].
const LEAST_SLOPE: f64 = 1e-6;
/// Rounds in which the slope of the radiation follows the deviation.
const ROUNDS: u32 = 6;

/// A place that radiates, stores heat and conducts.
pub(super) struct PlaceBalance {
    memory: Memory,
    /// Emissivity times the Stefan-Boltzmann constant [W m-2 K-4].
    emission: f64,
    /// Conductance to what surrounds it [W m-2 K-1].
    conductance: f64,
    /// Drawn temperature [K].
    temperature: f64,
    /// What the nodes emit in the mean, less what the drawn temperature would [W/m2].
    emitted_more: f64,
}

impl PlaceBalance {
    /// The balance of a place of a node with this area [m2], with the drawn temperature [K] and the mean of the nodes' fourth powers.
    pub(super) fn new(constants: &SurfaceConstants, area: f64, temperature: f64, fourth: f64) -> Self {
        let emission = constants.emissivity * STEFAN_BOLTZMANN;
        Self {
            memory: constants.memory,
            emission,
            conductance: if area > 0.0 { 4.0 * constants.conductance / area } else { 0.0 },
            temperature,
            emitted_more: emission * (fourth - temperature.powi(4)),
        }
    }

    /// Slope of what leaves the place between its drawn temperature and another [W m-2 K-1].
    fn slope(&self, other: f64) -> f64 {
        let (t, u) = (self.temperature, other);
        (self.emission * (t * t + u * u) * (t + u) + self.conductance).max(LEAST_SLOPE)
    }

    /// Slope of what the place radiates [W m-2 K-1].
    pub(super) fn radiated_slope(&self) -> f64 {
        4.0 * self.emission * self.temperature.powi(3)
    }

    /// Share of conduction in the slope.
    pub(super) fn conducted_share(&self) -> f64 {
        self.conductance / self.slope(self.temperature)
    }

    /// Step of a length [s] over the time constant, and the slope [W m-2 K-1].
    pub(super) fn rate(&self, length: f64) -> (f64, f64) {
        let slope = self.slope(self.temperature);
        (self.memory.rate(length, slope), slope)
    }

    /// What of an error is kept after a step of a length [s], and gained for each W/m2 [K m2/W].
    pub(super) fn passed(&self, length: f64) -> [f64; 2] {
        let (rate, slope) = self.rate(length);
        let kept = (-rate).exp();
        [kept, (1.0 - kept) / slope]
    }

    /// Deviation [K] after a step of a length [s] under a flux [W/m2], and what of an amplitude is kept, and gained for each W/m2.
    pub(super) fn deviation(&self, before: f64, flux: f64, length: f64) -> (f64, [f64; 2]) {
        let flux = flux + self.emitted_more;
        let (mut after, mut carried) = (before, [0.0; 2]);
        for _ in 0..ROUNDS {
            let slope = self.slope((self.temperature + after).max(LOWEST));
            let kept = (-self.memory.rate(length, slope)).exp();
            let goal = flux / slope;
            let next = (goal + (before - goal) * kept).max(LOWEST - self.temperature);
            after = 0.5 * (after + next);
            carried = [kept, (1.0 - kept) / slope];
        }
        (after, carried)
    }
}

/// Error at the end of a step by a load that grows evenly over the step by 1 and was taken as its mean, over the change of the balance: the integral of
/// (u - 1/2) k exp(-k (1 - u)) du over the step, with k the step over the time constant. 1/2 for a place that follows at once, and k2/12 for a slow one.
pub(super) fn within_step(rate: f64) -> f64 {
    if rate < 1e-3 {
        return rate * rate / 12.0;
    }
    if rate > 700.0 {
        return 0.5;
    }
    let kept = (-rate).exp();
    0.5 * (1.0 - kept) - (1.0 - kept * (1.0 + rate)) / rate
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_that_grows_within_a_step_errs_as_its_integral_says() {
        for rate in [1e-4, 1e-3, 0.02, 0.5, 3.0, 40.0, 1e3] {
            let parts = 200_000;
            let part = |number: u32| {
                let u = (f64::from(number) + 0.5) / f64::from(parts);
                (u - 0.5) * rate * (-rate * (1.0 - u)).exp() / f64::from(parts)
            };
            let sum: f64 = (0..parts).map(part).sum();
            assert!((within_step(rate) / sum - 1.0).abs() < 1e-2, "{rate}: {} and {sum}", within_step(rate));
        }
    }
}
