//! The state of a run between two steps: taken from the engine and the check, and given back to them, bit for bit.
//!
//! Each room declares what it keeps as a struct with serde, and a check of what comes back. Joints, loads and poses follow from the time, so they are
//! computed anew.

use super::check::{Check, CheckState};
use super::device_engine::DeviceEngineState;
use super::engine::{Engine, EngineError};
use super::reference_engine::ReferenceEngineState;
use crate::thermal::misfit::part;
use crate::thermal::sensor::twin::SensorState;

/// Most measured times of each kind that a run keeps.
pub(crate) const MOST_TIMES: usize = 4096;

/// The saved state of an engine.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub enum EngineState {
    /// Of a device.
    Device(Box<DeviceEngineState>),
    /// Of the f64 reference.
    Reference(Box<ReferenceEngineState>),
}

impl EngineState {
    /// Forgets what belongs to one run only: measured times, counts of work, and triangles culled for its camera.
    pub(crate) fn forget_run(&mut self) {
        match self {
            Self::Device(state) => state.forget_run(),
            Self::Reference(state) => state.forget_run(),
        }
    }

    /// Takes the sensor of another state of the same kind of engine: as a whole where `all` is set or this state has none, otherwise only a signal of
    /// another image.
    pub(crate) fn take_sensor(&mut self, other: Self, all: bool) {
        match (self, other) {
            (Self::Device(own), Self::Device(mut other)) => {
                take_sensor(own.scene.sensor_mut(), other.scene.sensor_mut().take(), all);
            }
            (Self::Reference(own), Self::Reference(other)) => take_sensor(&mut own.sensor, other.sensor, all),
            _ => {}
        }
    }
}

fn take_sensor<T>(own: &mut Option<SensorState<T>>, other: Option<SensorState<T>>, all: bool) {
    match (own, other) {
        (Some(own), Some(other)) if !all => {
            if own.signal.len() != other.signal.len() {
                own.signal = other.signal;
            }
        }
        (own, other @ Some(_)) => *own = other,
        (_, None) => {}
    }
}

/// The saved state of engine and check before a step.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct BetweenSteps {
    /// Number of the step.
    pub(crate) next: u32,
    pub(crate) engine: EngineState,
    /// Absent without a check.
    pub(crate) check: Option<CheckState>,
}

impl BetweenSteps {
    /// The state before a step.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn capture(next: u32, engine: &mut dyn Engine, check: Option<&mut Check>) -> Result<Self, EngineError> {
        Ok(Self { next, engine: engine.save()?, check: check.map(Check::save).transpose()? })
    }

    /// Gives the state back.
    ///
    /// # Errors
    /// A state of another scene, engine or check, or a call that fails.
    pub(crate) fn restore(&self, engine: &mut dyn Engine, check: Option<&mut Check>) -> Result<(), EngineError> {
        engine.keep_few_times(MOST_TIMES);
        engine.restore(&self.engine, MOST_TIMES)?;
        check.map_or(Ok(()), |check| check.restore(part("the f64 reference beside the run", &self.check)?))
    }
}
