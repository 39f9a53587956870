//! The errors of the temperatures of a simulation that is driven from outside, where its scene asks for them.

use std::sync::atomic::AtomicBool;

use super::Simulation;
use crate::simulation::facade_error::SimulationError;
use crate::simulation::forward::forward;
use crate::simulation::parts::Passing;
use crate::simulation::thermal_state::ThermalState;
use crate::simulation::uncertainty::Uncertainty;
use crate::stop::whole;

impl Simulation {
    /// Works with the errors, where the scene asks for them.
    pub(super) fn with_errors<T>(&mut self, work: impl FnOnce(&mut Uncertainty<'_>) -> T) -> Option<T> {
        let mut errors = Uncertainty::wake(&self.prepared, self.errors.take()?);
        // Work that is cut would lose the errors.
        let done = whole(|| work(&mut errors));
        self.errors = Some(errors.rest());
        Some(done)
    }

    /// Begins the errors at the present time.
    pub(super) fn begin_errors(&mut self) -> Result<(), SimulationError> {
        if self.errors.is_some() {
            let temperatures = self.read_temperatures()?;
            let (time, has_past) = (self.time, !self.placed);
            self.with_errors(|errors| errors.begin(time, &temperatures, has_past));
        }
        Ok(())
    }

    /// Takes the errors of a saved state, or begins them anew where it has none.
    pub(super) fn restore_errors(&mut self, saved: &ThermalState) -> Result<(), SimulationError> {
        let fresh = Uncertainty::asked(&self.prepared, saved.errors.as_ref()).map_err(SimulationError::NoState)?;
        self.errors = fresh.map(Uncertainty::rest);
        self.begin_errors()
    }

    /// Makes steps one by one, and carries the errors through each. Returns whether all were made before `stop` was set.
    pub(super) fn pass_with_errors(
        &mut self,
        steps: &[(Passing, f64)],
        stop: &AtomicBool,
        progress: &mut dyn FnMut(),
    ) -> Result<bool, SimulationError> {
        self.time = steps.first().map_or(self.time, |(passing, _)| passing.start);
        for (passing, end) in steps {
            if !forward(&self.prepared, &mut *self.engine, None, [*passing], stop, progress)? {
                return Ok(false);
            }
            (self.time, self.last) = (*end, Some(*passing));
            let temperatures = self.read_temperatures()?;
            self.with_errors(|errors| errors.pass(*passing, &temperatures));
        }
        Ok(true)
    }
}
