//! The uncertainty of a scene that asks for it, before its run.

use std::cell::RefCell;
use std::sync::atomic::AtomicBool;

use super::error::CliError;
use super::progress::{show_news, spinner};
use crate::output::sigma::RunSigma;
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
    let sigma = find_sigma(prepared, &Search { target, stop, news: &news, kept: &kept });
    bar.borrow().finish_and_clear();
    Ok(Some(sigma?))
}
