//! Finds by finer runs how far the settings of a scene are from convergence, and the cheapest settings that are near enough.
//!
//! `knobs` says how each setting is refined. `walk` takes a variant through the steps and images of the scene. `pixels` compares two runs. `search` runs
//! the variants and chooses. `files` writes the results. `finest` is a reference for other rooms.

pub(crate) mod files;
pub(crate) mod finest;
mod knobs;
pub(crate) mod pixels;
pub(crate) mod search;
pub(crate) mod walk;

use std::path::PathBuf;

use crate::simulation::engine::EngineError;
use crate::simulation::prepare_error::PrepareError;

/// What a search of several runs tells on its way.
pub(crate) enum RunNews {
    /// A sentence for the user.
    Says(String),
    /// A run begins, with this number of steps.
    Begins(String, u64),
    /// A step is done.
    Stepped,
}

/// An error that ends the search.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ConvergeError {
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The temperatures come from a file.
    #[error("{}: takes its temperatures from a file ([temperatures]), so no setting changes them", .0.display())]
    Given(PathBuf),
    /// The scene has no camera or draws nothing.
    #[error("{}: has no images, and converge compares pixels: state [camera] and time.draw_every, or name --poses", .0.display())]
    NoImages(PathBuf),
    /// No image shows the craft.
    #[error("{}: no pixel of its images shows the craft, and converge compares pixels: mend [camera], or name --poses", .0.display())]
    NoPixels(PathBuf),
    /// The run with all finer settings cannot be prepared, so nothing tells the error.
    #[error("{}: with all settings finer ({settings}) the scene cannot run, so there is nothing to compare with: {reason}", path.display())]
    Finest { path: PathBuf, settings: String, reason: String },
    /// The user pressed Ctrl-C.
    #[error("stopped")]
    Stopped,
}
