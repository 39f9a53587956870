//! A network leaves the one pass for sub-steps where the estimate of its error stays above the tolerance.

use super::NetworkRun;
use super::left::Left;
use crate::saved::Saved;
use crate::simulation::engine_error::EngineError;
use crate::thermal::network::control::Integrator;
use crate::thermal::network::one_pass::{Estimate, Halving};

/// Decisions with the most halvings that find the estimate above the tolerance, after which the network takes sub-steps. The first ones may still see the
/// error of longer steps.
const PATIENCE: u32 = 4;

impl NetworkRun {
    /// Whether sub-steps are to take over. A scene that asks for one pass keeps it.
    pub fn gives_up(&self, halving: Halving) -> bool {
        halving.exceeded >= PATIENCE && self.scene.settings.integrator == Integrator::Default
    }

    /// Takes sub-steps from a time [s] on, from temperatures [K].
    pub fn change_over(&mut self, temperatures: &[f64], estimate: Estimate, time: f64) {
        self.leave(Left { time, estimate });
        self.set_temperatures(temperatures);
    }

    fn leave(&mut self, left: Left) {
        (self.one_pass, self.in_frames, self.left) = (None, false, Some(left));
    }

    pub(super) fn save_left(&self, saved: &mut Saved) {
        if let Some(Left { time, estimate: Estimate { rms, most, node } }) = self.left {
            saved.put("left", &[time, rms, most, node as f64]);
        }
    }

    pub(super) fn restore_left(&mut self, saved: &Saved) -> Result<(), EngineError> {
        if !saved.has("left") {
            return Ok(());
        }
        let [time, rms, most, node] = saved.array("left")?;
        self.leave(Left { time, estimate: Estimate { rms, most, node: node as usize } });
        Ok(())
    }
}
