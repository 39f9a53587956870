//! Advances through steps that need only their final state, with loads computed in parallel and many steps in a dispatch.
//!
//! A warm-up and the way to a still consist of such steps. A dispatch reads and writes a node's normal and state once for up to 32 steps. This needs nodes
//! that do not interact. Each joint has loads of its own. The result has the same bits (`tests/it/fused.rs`).

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::check::Check;
use super::engine::{Engine, EngineError, EngineStep};
use super::parts::Passing;
use super::prepare::Prepared;
use crate::gpu::layout::FUSED_STEPS;
use crate::stop::whole;
use crate::trace::span;

/// Advances through steps, with the check's nodes where there is a check. `progress` is called for each step. Returns whether all steps were done before
/// `stop` was set.
///
/// # Errors
/// A call that fails.
pub(crate) fn forward(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    mut check: Option<&mut Check>,
    passing: impl IntoIterator<Item = Passing>,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
) -> Result<bool, EngineError> {
    // The check of exchange follows the engine step by step. A step of a network takes long, so `stop` is read after each.
    let at_once = if prepared.network.is_some() || prepared.exchange.is_some() { 1 } else { FUSED_STEPS };
    let mut passing = passing.into_iter().peekable();
    while passing.peek().is_some() {
        if stop.load(Ordering::Relaxed) {
            return Ok(false);
        }
        let batch: Vec<Passing> = passing.by_ref().take(at_once).collect();
        let parts: Vec<Passing> = batch.iter().flat_map(|one| one.parts(&prepared.loads)).collect();
        let finds = span("finding the loads");
        let loads: Vec<_> = parts.par_iter().map(|one| prepared.loads.step_load(one.start, one.end)).collect();
        drop(finds);
        let under_load: Vec<EngineStep<'_>> = parts
            .iter()
            .zip(&loads)
            .map(|(one, load)| EngineStep { load, steps: one.steps, start: one.start, length: one.end - one.start })
            .collect();
        for together in under_load.chunks(at_once) {
            whole(|| engine.forward(together))?;
            for one in together {
                if let Some(check) = check.as_deref_mut() {
                    check.step(one.load, one.steps, one.start, one.length, engine.exchange_rows().as_ref());
                }
            }
        }
        batch.iter().for_each(|_| progress());
    }
    engine.wait()?;
    Ok(true)
}
