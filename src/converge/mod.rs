//! Finds by finer runs how far a scene's settings are from convergence, and the cheapest settings that are near enough.
//!
//! `knobs` says how each setting is refined. `walk` takes a variant through the scene's steps and images. `pixels` compares two runs. `search`
//! refines each knob by itself, then all, and chooses. `files` writes the results.

pub(crate) mod files;
pub(crate) mod knobs;
pub(crate) mod pixels;
pub(crate) mod search;
pub(crate) mod walk;

use std::path::PathBuf;

use crate::simulation::engine::EngineError;
use crate::simulation::prepare_error::PrepareError;

/// An error that ends the search.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ConvergeError {
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The scene draws nothing, so there are no pixels to compare.
    #[error("{}: time.draw_every draws no image, and converge compares pixels: state it, or name --poses", .0.display())]
    NoImages(PathBuf),
    /// No image shows the craft.
    #[error("{}: no pixel of its images shows the craft, and converge compares pixels: mend [camera], or name --poses", .0.display())]
    NoPixels(PathBuf),
    /// The temperatures come from a file.
    #[error("{}: takes its temperatures from a file ([temperatures]), so no setting changes them", .0.display())]
    Given(PathBuf),
    /// No knob can be refined.
    #[error("{}: none of its settings can be refined", .0.display())]
    NoKnobs(PathBuf),
    /// The run with all finer settings failed, so nothing tells the error.
    #[error("{}: the run with all settings finer failed ({reason}), so there is nothing to compare with", path.display())]
    Finest { path: PathBuf, reason: String },
    /// The user pressed Ctrl-C.
    #[error("stopped")]
    Stopped,
}
