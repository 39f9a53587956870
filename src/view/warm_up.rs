//! The warm-up of a scene on a thread of its own, while open pages are told how far it is.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use serde_json::json;
use tokio::runtime::Handle;
use tokio::sync::mpsc::{Receiver, Sender};

use super::worker::{ToPage, WorkerMessage, problem_message};
use crate::output::console::say;
use crate::simulation::facade::Simulation;
use crate::simulation::facade_error::SimulationError;
use crate::simulation::forecast::Forecast;
use crate::stop::until;
use crate::trace::{Trace, Track};

/// Time between two messages to the pages.
const EVERY: Duration = Duration::from_millis(250);

/// Pages that were opened, each with the way to it.
pub(crate) type JoinedPages = BTreeMap<u64, Sender<ToPage>>;

/// Brings a simulation to time 0, and tells the pages that are opened meanwhile. `stepped` is called for each step, or each orbit of a periodic warm-up.
/// Returns the pages. `None` if `stop` ended the warm-up.
///
/// # Errors
/// A call that fails.
pub(crate) fn warm_up(
    simulation: &mut Simulation,
    commands: &mut Receiver<WorkerMessage>,
    runtime: &Handle,
    stop: &Arc<AtomicBool>,
    mut stepped: Box<dyn FnMut() + Send>,
) -> Result<Option<JoinedPages>, SimulationError> {
    let mut pages = JoinedPages::new();
    if simulation.has_begun() {
        return Ok(Some(pages));
    }
    let forecast = Forecast::of(simulation.prepared());
    let steps = (!forecast.warm_up_is_most).then_some(forecast.warm_up);
    let (trace, done) = (Trace::begin(false), AtomicU64::new(0));
    let begun = std::thread::scope(|scope| {
        let thread = scope.spawn(|| {
            let _on_track = trace.enter(Track::Host);
            let mut progress = || {
                done.fetch_add(1, Ordering::Relaxed);
                stepped();
            };
            until(stop, || simulation.begin_with(stop, &mut progress))
        });
        while !thread.is_finished() {
            let wait = async { tokio::time::timeout(EVERY, commands.recv()).await };
            match runtime.block_on(wait) {
                Ok(Some(message)) => take(message, &mut pages),
                // Without a server nobody is told any more.
                Ok(None) => std::thread::sleep(EVERY),
                Err(_) => {}
            }
            let told = json!({
                "type": "warm_up",
                "done": done.load(Ordering::Relaxed),
                "steps": steps,
                "doing": trace.doing(),
            });
            pages.values().for_each(|page| tell(page, told.to_string()));
        }
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    });
    if let Some(warning) = simulation.periodic().and_then(|periodic| periodic.warning("")) {
        say!("warning: {warning}");
    }
    match begun {
        Ok(begun) => Ok(begun?.then_some(pages)),
        Err(_) => Ok(None),
    }
}

fn take(message: WorkerMessage, pages: &mut JoinedPages) {
    match message {
        WorkerMessage::Join { id, page } => {
            pages.insert(id, page);
        }
        WorkerMessage::Leave(id) => {
            pages.remove(&id);
        }
        WorkerMessage::Ask(id, _) => {
            if let Some(page) = pages.get(&id) {
                tell(page, problem_message("the scene is still in its warm-up"));
            }
        }
        WorkerMessage::Tell(_) | WorkerMessage::Sigma(_) => {}
    }
}

/// Sends a message. One that a slow page has no place for is lost.
fn tell(page: &Sender<ToPage>, message: String) {
    let _ = page.try_send(ToPage::Text(message));
}
