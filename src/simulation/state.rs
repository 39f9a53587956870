//! The state of a run between two steps: taken from the engine and the check, and given back to them, bit for bit.
//!
//! Each room declares what it keeps as a struct with serde, and a check of what comes back. Joints, loads and poses follow from the time, so they are
//! computed anew.

use super::check::{Check, CheckState};
use super::engine::{Engine, EngineError};
use super::engine_state::EngineState;
use crate::thermal::misfit::part;

/// Most measured times of each kind that a run keeps.
pub(crate) const MOST_TIMES: usize = 4096;

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
