//! The uncertainty of a scene that asks for it, before its run or its images.

use std::cell::RefCell;
use std::sync::atomic::AtomicBool;

use super::error::CliError;
use super::progress::{show_news, spinner};
use crate::output::sigma::RunSigma;
use crate::scene::Draw;
use crate::sensitivity::search::Search;
use crate::sensitivity::sigma::{all_images, find_sigma};
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;

/// Takes the runs that `[uncertainty]` needs: two for each parameter. `None` where the scene does not ask.
pub(super) fn sigma_of(prepared: &Prepared, target: &Target, stop: &AtomicBool) -> Result<Option<RunSigma>, CliError> {
    if prepared.scene.uncertainty.is_none() {
        return Ok(None);
    }
    let kept = all_images(&prepared.scene)?;
    let bar = RefCell::new(spinner("preparing"));
    let news = |news| show_news(&bar, news);
    let sigma = find_sigma(prepared, &Search { target, stop, news: &news, kept: &kept, nodes_every: None });
    bar.borrow().finish_and_clear();
    Ok(Some(sigma?))
}

/// The same for one image at a time [s].
pub(super) fn sigma_at(
    time: f64,
    prepared: &Prepared,
    target: &Target,
    stop: &AtomicBool,
) -> Result<Option<RunSigma>, CliError> {
    if prepared.scene.uncertainty.is_none() {
        return Ok(None);
    }
    let mut scene = prepared.scene.clone();
    scene.time.steps = ((time / scene.time.step - 1e-9).ceil() as u32).max(1);
    scene.time.draw = Draw::Times(vec![time]);
    sigma_of(&prepared.varied(scene, |_| ())?, target, stop)
}
