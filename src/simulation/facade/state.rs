//! The state of a simulation that is driven from outside: it is saved, restored, and given to another engine.

use super::Simulation;
use crate::saved::Saved;
use crate::scene::Camera;
use crate::simulation::engine::{Engine, EngineError};
use crate::simulation::facade_error::SimulationError;
use crate::simulation::state::MOST_TIMES;
use crate::simulation::thermal_state::{begin_from, differences, take};

impl Simulation {
    /// The thermal state and the sensor's, bit for bit, with the present time. `output::state_file` writes it to a file, as `--save-state` does.
    ///
    /// # Errors
    /// A call that fails.
    pub fn save(&mut self) -> Result<Saved, SimulationError> {
        self.begin()?;
        Ok(take(&self.prepared, &mut *self.engine, None, self.time)?)
    }

    /// Goes back to a saved state and to its time. Places and joints that were set from outside are forgotten: the craft follows the scene's own orbit until
    /// it is placed again.
    ///
    /// # Errors
    /// A state of another craft or of another kind of device, or a call that fails.
    pub fn restore(&mut self, saved: &Saved) -> Result<(), SimulationError> {
        let time = saved.array::<f64, 1>("of.time").map_err(SimulationError::NoState)?[0];
        self.restore_at(saved, time)
    }

    /// Goes to a saved state as the state at a time [s], whatever its own time. With 0 this is `--from-state`.
    ///
    /// # Errors
    /// As for [`Simulation::restore`].
    pub fn restore_at(&mut self, saved: &Saved, time: f64) -> Result<(), SimulationError> {
        if !time.is_finite() {
            return Err(SimulationError::Time { time, now: self.time });
        }
        let on_device = self.target.device().is_some();
        let found = differences(saved, &self.prepared, on_device).map_err(SimulationError::NoState)?;
        if !found.is_empty() {
            return Err(SimulationError::State(found.join("; ")));
        }
        let fits = match &self.prepared.scene.sensor {
            Some(_) => with_sensor_of(saved.clone(), &self.engine.save()?, false),
            None => saved.clone(),
        };
        begin_from(&fits, &mut *self.engine, None).map_err(|error| match error {
            EngineError::Saved(error) => SimulationError::NoState(error),
            error => error.into(),
        })?;
        self.prepared.loads = self.own.clone();
        (self.placed, self.begun, self.time) = (false, true, time);
        Ok(())
    }

    /// Another engine for a camera, in a thermal state. Its sensor begins anew.
    pub(super) fn engine_with(
        &self,
        state: Saved,
        camera: Option<&Camera>,
    ) -> Result<Box<dyn Engine>, SimulationError> {
        let mut engine = self.target.engine(&self.prepared, camera)?;
        engine.keep_few_times(MOST_TIMES);
        let state = with_sensor_of(state, &engine.save()?, true);
        begin_from(&state, &mut *engine, None)?;
        Ok(engine)
    }
}

/// A state with the lists of an engine's sensor, all of them or those that do not fit it.
fn with_sensor_of(mut state: Saved, fresh: &Saved, all: bool) -> Saved {
    for (name, bytes) in fresh.lists() {
        let own = format!("state.engine.{name}");
        let is_sensor = name.starts_with("sensor.") || name.starts_with("scene.sensor.");
        let fits = state.list::<u8>(&own).is_ok_and(|list: Vec<u8>| list.len() == bytes.len());
        if is_sensor && (all || !fits) {
            state.put(own, bytes);
        }
    }
    state
}
