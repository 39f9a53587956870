//! Steps of which nothing is asked but the state that they lead to: loads found in parallel, many steps a dispatch.
//!
//! Such steps are those of a warm-up and of the way to a still. A node's normal and state are then read and written once for up to 32 steps.
//! That needs nodes that do not interact and joints that stand still; the result is the same to the bit (`tests/it/fused.rs`).

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::check::Check;
use super::engine::{Engine, EngineError, Step};
use super::prepare::Prepared;
use crate::gpu::layout::FUSED_STEPS;

/// When a step passes, and how many steps it is long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passing {
    /// Begin [s].
    pub start: f64,
    /// End [s].
    pub end: f64,
    /// Length in steps.
    pub steps: f64,
}

/// Lets steps pass, on the check's nodes too where there is one; `progress` hears of each. Returns whether all did before
/// `stop` was set.
///
/// # Errors
/// A call that fails.
pub fn forward(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    mut check: Option<&mut Check>,
    passing: impl IntoIterator<Item = Passing>,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
) -> Result<bool, EngineError> {
    // A step of a network is long, and may be the last before a stop.
    let at_once = if prepared.network.is_some() { 1 } else { FUSED_STEPS };
    let mut passing = passing.into_iter().peekable();
    while passing.peek().is_some() {
        if stop.load(Ordering::Relaxed) {
            return Ok(false);
        }
        let batch: Vec<Passing> = passing.by_ref().take(at_once).collect();
        let loads: Vec<_> = batch.par_iter().map(|one| prepared.loads.step_load(one.start, one.end)).collect();
        let under_load: Vec<Step<'_>> = batch
            .iter()
            .zip(&loads)
            .map(|(one, load)| Step { load, steps: one.steps, start: one.start, length: one.end - one.start })
            .collect();
        engine.forward(&under_load)?;
        for one in under_load {
            if let Some(check) = check.as_deref_mut() {
                check.step(one.load, one.steps, one.start, one.length);
            }
            progress();
        }
    }
    engine.wait()?;
    Ok(true)
}
