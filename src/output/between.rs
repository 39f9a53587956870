//! Error of the temperatures of images between steps, estimated while a run goes on.

use crate::simulation::prepare::Prepared;
use crate::thermal::between::between_error;

/// Error of the temperatures between steps, where images lie there.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Between {
    /// Temperatures at the last two steps [K].
    before: Vec<Vec<f32>>,
    /// Largest error so far [K].
    pub(crate) error: Option<f64>,
}

impl Between {
    /// Takes the temperatures at the end of a step [K].
    pub(crate) fn take(&mut self, prepared: &Prepared, step: u32, temperatures: Vec<f32>) {
        let time = &prepared.scene.time;
        if let [first, second] = self.before.as_slice() {
            let near = (step - 1..=step).any(|step| !time.draw.in_step(step, time.step).is_empty());
            let error = near.then(|| between_error([first, second, &temperatures]));
            self.error = error.into_iter().chain(self.error).reduce(f64::max);
            self.before.remove(0);
        }
        self.before.push(temperatures);
    }
}
