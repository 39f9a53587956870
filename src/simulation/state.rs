//! The state of a run between two steps: taken from the engine and the check, and given back to them, bit for bit.
//!
//! The lists and their names:
//!
//! | list | what |
//! |---|---|
//! | `next` | number of the next step (u32) |
//! | `engine.*` | nodes, shadows, network and counts of the engine: `DeviceEngine::save`, `ReferenceEngine::save` |
//! | `check.*` | the reference of the sample and the differences so far: `Check::save`; absent without a check |
//! | `own.*` | in a periodic warm-up: orbits and changes so far, from which it is extrapolated; absent otherwise |
//! | `periodic` | orbits, coarse orbits, change [K] and tolerance [K] of a periodic warm-up (f64); absent without one |
//!
//! Joints, loads and poses follow from the time, so they are computed anew.

use super::check::Check;
use super::engine::{Engine, EngineError};
use super::periodic::Periodic;
use crate::saved::{Saved, SavedError};

/// Most measured times of each kind that a run keeps.
pub(crate) const MOST_TIMES: usize = 4096;

/// The state before a step.
///
/// # Errors
/// A call that fails.
pub(crate) fn capture(next: u32, engine: &mut dyn Engine, check: Option<&mut Check>) -> Result<Saved, EngineError> {
    let mut saved = Saved::default();
    saved.put("next", &[next]);
    saved.put_all("engine", engine.save()?);
    if let Some(check) = check {
        saved.put_all("check", check.save()?);
    }
    Ok(saved)
}

/// Gives the state back. Returns the number of the next step.
///
/// # Errors
/// A state of another scene, engine or check, or a call that fails.
pub(crate) fn restore(saved: &Saved, engine: &mut dyn Engine, check: Option<&mut Check>) -> Result<u32, EngineError> {
    engine.keep_few_times(MOST_TIMES);
    engine.restore(&saved.part("engine"), MOST_TIMES)?;
    if let Some(check) = check {
        check.restore(&saved.part("check"))?;
    }
    let [next] = saved.array("next")?;
    Ok(next)
}

/// Puts the result of a periodic warm-up.
pub(crate) fn put_periodic(saved: &mut Saved, periodic: Option<Periodic>) {
    if let Some(Periodic { orbits, coarse, change, tolerance }) = periodic {
        saved.put("periodic", &[f64::from(orbits), f64::from(coarse), change, tolerance]);
    }
}

/// The result of a periodic warm-up.
///
/// # Errors
/// A list of another length.
pub(crate) fn periodic(saved: &Saved) -> Result<Option<Periodic>, SavedError> {
    if !saved.has("periodic") {
        return Ok(None);
    }
    let [orbits, coarse, change, tolerance] = saved.array("periodic")?;
    Ok(Some(Periodic { orbits: orbits as u32, coarse: coarse as u32, change, tolerance }))
}
