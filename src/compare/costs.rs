//! What a run cost: wall-clock times on the host, measured alike for every response.

use crate::output::report::PassTime;

/// The cost of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cost {
    /// Of a thermal step: from its submission until it is done, network included.
    pub step: Option<PassTime>,
    /// Of an image: from its submission until radiance, temperature and labels are on the host.
    pub image: Option<PassTime>,
    /// Mean time of the thermal passes of a step on the device [ms], by its own clock, warm-up left out; of a network its loads
    /// only.
    pub device_step_ms: Option<f64>,
    /// Ticks of the warm-up, where it has a given length.
    pub warm_up: u64,
    /// Wall time of the warm-up [s].
    pub warm_up_s: f64,
    /// Wall time of the whole run, start-up and warm-up included, pictures not [s].
    pub wall_s: f64,
}

impl Cost {
    /// The ticks of a warm-up of a given length, in words.
    pub fn warm_up_ticks(&self) -> String {
        format!("{} steps", self.warm_up)
    }
}
