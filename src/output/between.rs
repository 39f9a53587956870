//! Error of the temperatures of images between steps, estimated while a run goes on.

use crate::saved::{Saved, SavedError};
use crate::simulation::prepare::Prepared;
use crate::thermal::between::between_error;

/// Error of the temperatures between steps, where images lie there.
#[derive(Default)]
pub(super) struct Between {
    /// Temperatures at the last two steps [K].
    before: Vec<Vec<f32>>,
    /// Largest error so far [K].
    pub(crate) error: Option<f64>,
}

impl Between {
    /// Reads the lists of `save`.
    ///
    /// # Errors
    /// A list is absent.
    pub(crate) fn of(saved: &Saved) -> Result<Self, SavedError> {
        let error: Vec<f64> = saved.list("between.error")?;
        let names = ["between.0", "between.1"].into_iter().filter(|name| saved.has(name));
        Ok(Self {
            before: names.map(|name| saved.list(name)).collect::<Result<_, _>>()?,
            error: error.first().copied(),
        })
    }

    /// Puts the error, and the temperatures that the next step needs.
    pub(crate) fn save(&self, saved: &mut Saved) {
        saved.put("between.error", self.error.as_slice());
        for (number, temperatures) in self.before.iter().enumerate() {
            saved.put(format!("between.{number}"), temperatures);
        }
    }

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
