//! Finds the uncertainty by the ranges of parameters, on a thread of its own beside the page.

use std::cell::Cell;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use serde_json::json;

use super::compare::Comparison;
use crate::converge::RunNews;
use crate::output::material_picture;
use crate::scene::Draw;
use crate::sensitivity::SensitivityError;
use crate::sensitivity::node_sigma::{NodeSigma, find_node_sigma};
use crate::sensitivity::search::Search;
use crate::simulation::prepare::Prepared;

/// Time between two messages of progress.
const EVERY: Duration = Duration::from_millis(500);

/// Takes the runs of a scene that its uncertainty needs. `tell` takes messages of progress for the pages, and the reason where there is no uncertainty.
pub(crate) fn find_page_sigma(beside: &Comparison, tell: &dyn Fn(String)) -> Option<NodeSigma> {
    let sigma = find(beside, tell);
    beside.is_under_way.store(false, Ordering::Relaxed);
    match sigma {
        Ok(sigma) => Some(sigma),
        Err(error) => {
            tell(json!({ "type": "sigma", "failed": error.to_string() }).to_string());
            None
        }
    }
}

fn find(beside: &Comparison, tell: &dyn Fn(String)) -> Result<NodeSigma, SensitivityError> {
    let mut scene = beside.scene.clone();
    scene.time.draw = Draw::None;
    let prepared = Prepared::from_scene(scene, &mut |_| ())?;
    let (done, told) = (Cell::new(0), Cell::new(Instant::now()));
    let news = |news| match news {
        RunNews::Begins(run, _) => {
            done.set(0);
            tell(json!({ "type": "sigma", "run": run, "step": 0 }).to_string());
        }
        RunNews::Stepped => {
            done.set(done.get() + 1);
            if told.get().elapsed() > EVERY {
                told.set(Instant::now());
                tell(json!({ "type": "sigma", "step": done.get() }).to_string());
            }
        }
        RunNews::Says(_) => {}
    };
    let search = Search { target: &beside.target, stop: &beside.stop, news: &news, kept: &[], nodes_every: None };
    find_node_sigma(&prepared, &search)
}

/// The message that the uncertainty is known, with names and colours of its causes.
pub(crate) fn sigma_message(sigma: &NodeSigma) -> String {
    let causes = sigma.causes().enumerate();
    let causes = causes.map(|(number, name)| json!({ "name": name, "colour": material_picture::colour(number) }));
    json!({ "type": "sigma", "causes": causes.collect::<Vec<_>>(), "every": sigma.every() }).to_string()
}
