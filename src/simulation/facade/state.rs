//! The state of a simulation that is driven from outside: it is saved, restored, and given to another engine.

use super::Simulation;
use crate::environment::scene_time::SceneTime;
use crate::scene::Camera;
use crate::simulation::engine::{Engine, EngineError};
use crate::simulation::engine_state::EngineState;
use crate::simulation::facade_error::SimulationError;
use crate::simulation::parts::Passing;
use crate::simulation::state::MOST_TIMES;
use crate::simulation::thermal_state::ThermalState;

impl Simulation {
    /// The thermal state and the sensor's, bit for bit, with the present time. `output::state_file` writes it to a file, as `--save-state` does.
    ///
    /// # Errors
    /// A call that fails.
    pub fn save(&mut self) -> Result<ThermalState, SimulationError> {
        self.begin()?;
        let state = ThermalState::take(&self.prepared, &mut *self.engine, None, self.time)?;
        Ok(state.with_errors(self.with_errors(|errors| errors.save())))
    }

    /// Goes back to a saved state and to its time. Places, joints and powers that were set from outside are forgotten: the craft follows the scene's own orbit until
    /// it is placed again.
    ///
    /// # Errors
    /// A state of another craft or of another kind of device, or a call that fails.
    pub fn restore(&mut self, saved: &ThermalState) -> Result<(), SimulationError> {
        self.restore_at(saved, saved.time)
    }

    /// Goes to a saved state as the state at a time [s], whatever its own time. With 0 this is `--from-state`.
    ///
    /// # Errors
    /// As for [`Simulation::restore`].
    pub fn restore_at(&mut self, saved: &ThermalState, time: f64) -> Result<(), SimulationError> {
        SceneTime::new(time)?;
        let found = saved.differences(&self.prepared, self.target.device().is_some());
        if !found.is_empty() {
            return Err(SimulationError::State(found.join("; ")));
        }
        let begun = match &self.prepared.scene.sensor {
            Some(_) => with_sensor_of(saved, self.engine.save()?, false).begin(&mut *self.engine, None),
            None => saved.begin(&mut *self.engine, None),
        };
        begun.map_err(|error| match error {
            EngineError::Saved(error) => SimulationError::NoState(error),
            error => error.into(),
        })?;
        self.prepared.loads = self.own.clone();
        if let Some(network) = &self.prepared.network {
            network.forget_powers();
        }
        (self.placed, self.turned, self.begun, self.time) = (false, false, true, time);
        let step = self.prepared.scene.time.step;
        self.last = (time > 0.0).then_some(Passing { start: time - step, end: time, steps: 1.0 });
        self.restore_errors(saved)
    }

    /// Another engine for a camera, in a thermal state. Its sensor begins anew.
    pub(super) fn engine_with(
        &self,
        state: &ThermalState,
        camera: Option<&Camera>,
    ) -> Result<Box<dyn Engine>, SimulationError> {
        let mut engine = self.target.engine(&self.prepared, camera)?;
        engine.keep_few_times(MOST_TIMES);
        with_sensor_of(state, engine.save()?, true).begin(&mut *engine, None)?;
        Ok(engine)
    }
}

/// A state with the sensor of an engine's fresh state: as a whole, or only what does not fit.
fn with_sensor_of(state: &ThermalState, fresh: EngineState, all: bool) -> ThermalState {
    let mut state = state.clone();
    state.state.engine.take_sensor(fresh, all);
    state
}
