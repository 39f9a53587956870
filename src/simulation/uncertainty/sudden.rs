//! Sunlight that may come or go at any time within a step.

use super::Uncertainty;
use super::absorbed::Absorbed;
use crate::environment::StepLoad;

/// Standard deviation of what the mean of an interval lacks where light jumps at any time within it, over the jump: 1 over the root of 12, as half of the square for each of both second differences.
const SUDDEN: f64 = 0.204;
/// Second difference of the sunlight, over the sunlight, of a face that turns evenly by as much as an interval allows (4 deg).
const EVEN: f64 = 0.005;

impl Uncertainty<'_> {
    /// Uncertainty of the sunlight that each node absorbs [W/m2] because it may come or go at any time within the interval, where light was found for it. Empty where none was.
    ///
    /// Sunlight that changes evenly has no second difference over three findings. Sunlight that jumps from one finding to the next has two of its own size, one after the other.
    pub(super) fn sudden(&mut self, load: &StepLoad, absorbed: &Absorbed, is_found: bool) -> Vec<f64> {
        let sunlight: f64 = load.sun.iter().map(|sample| sample.flux).sum();
        if sunlight <= 0.0 {
            // The Sun comes back from elsewhere.
            self.state.sunlit = Default::default();
        }
        if !is_found || sunlight <= 0.0 {
            return Vec::new();
        }
        let now: Vec<f64> = absorbed.solar.iter().map(|flux| flux / sunlight).collect();
        let [first, second] = &self.state.sunlit;
        let sudden = |((first, second), now): ((&f64, &f64), &f64)| {
            SUDDEN * sunlight * ((first - 2.0 * second + now).abs() - EVEN).max(0.0)
        };
        let found = first.iter().zip(second).zip(&now).map(sudden).collect();
        let last = std::mem::replace(&mut self.state.sunlit[1], now);
        self.state.sunlit[0] = last;
        found
    }
}
