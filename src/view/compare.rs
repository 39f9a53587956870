//! Compares a run of the scene with the f64 reference, on a thread of its own beside the page.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use serde_json::json;

use crate::scene::{Draw, Scene};
use crate::simulation::check::{Check, SAMPLE};
use crate::simulation::engine::EngineError;
use crate::simulation::facade_error::SimulationError;
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;
use crate::simulation::{StepResult, run, start};

/// Time between two messages of progress [s].
const EVERY: f64 = 0.5;

#[derive(Clone)]
pub(crate) struct Comparison {
    pub(crate) scene: Scene,
    pub(crate) target: Target,
    /// Ends it early.
    pub(crate) stop: Arc<AtomicBool>,
    pub(crate) is_under_way: Arc<AtomicBool>,
}

impl Comparison {
    /// Runs the scene from its warm-up to its end without images, beside f64 for a sample of nodes. `tell` takes messages for the pages, the last of which has
    /// the result or the reason why there is none.
    pub(crate) fn run(&self, tell: &mut dyn FnMut(String)) {
        let message = match self.compare(tell) {
            Ok(message) => message,
            Err(error) => json!({ "type": "accuracy", "failed": error.to_string() }).to_string(),
        };
        self.is_under_way.store(false, Ordering::Relaxed);
        tell(message);
    }

    fn compare(&self, tell: &mut dyn FnMut(String)) -> Result<String, SimulationError> {
        let refused = |reason: &str| Ok(json!({ "type": "accuracy", "failed": reason }).to_string());
        if self.target.device().is_none() {
            return refused("this is the f64 reference itself");
        }
        if self.scene.exchange.is_some() {
            return refused("a scene with [exchange] has no comparison");
        }
        let mut scene = self.scene.clone();
        scene.time.draw = Draw::None;
        let prepared = Prepared::from_scene(scene, &mut |_| ())?;
        let mut engine = self.target.engine(&prepared, None)?;
        let mut check = Check::new(&prepared, SAMPLE);
        let steps = prepared.scene.time.steps;
        tell(json!({ "type": "accuracy", "step": 0, "steps": steps }).to_string());
        start(&prepared, &mut *engine, Some(&mut check), &self.stop, &mut || ())?;
        let mut told = Instant::now();
        let mut take = |result: StepResult| {
            if told.elapsed().as_secs_f64() > EVERY {
                told = Instant::now();
                tell(json!({ "type": "accuracy", "step": result.step, "steps": steps }).to_string());
            }
            Ok::<_, EngineError>(())
        };
        run(&prepared, &mut *engine, Some(&mut check), &self.stop, &mut take)?;
        if self.stop.load(Ordering::Relaxed) {
            return refused("it was stopped");
        }
        let accuracy = check.accuracy(&prepared);
        Ok(json!({ "type": "accuracy", "result": accuracy }).to_string())
    }
}
