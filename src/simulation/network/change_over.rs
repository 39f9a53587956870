//! A network leaves the one pass for sub-steps where the estimate of its error stays above the tolerance.

use super::NetworkRun;
use super::left::OnePassExit;
use crate::thermal::network::control::Integrator;
use crate::thermal::network::one_pass::{Estimate, Halving};

/// Decisions with the most halvings that find the estimate above the tolerance, after which the network takes sub-steps. The first decisions may
/// still see the error of longer steps.
const PATIENCE: u32 = 4;

impl NetworkRun {
    /// Whether sub-steps are to take over. A scene that asks for one pass keeps it.
    pub(crate) fn gives_up(&self, halving: Halving) -> bool {
        halving.exceeded >= PATIENCE && self.scene.settings.integrator == Integrator::Default
    }

    /// Takes sub-steps from a time [s] on, from temperatures [K].
    pub(crate) fn change_over(&mut self, temperatures: &[f64], estimate: Estimate, time: f64) {
        self.leave(OnePassExit { time, estimate });
        self.set_temperatures(temperatures);
    }

    pub(super) fn leave(&mut self, left: OnePassExit) {
        (self.one_pass, self.in_frames, self.course.left) = (None, false, Some(left));
    }
}
