//! Finds how temperatures depend on parameters of a scene, by differences of whole runs from their own periodic states (docs/numerics.md 10).
//!
//! `change` finds and changes the values of a parameter. `variant` runs a scene with changed values. `search` takes all runs and their differences, two
//! at a time (`side_by_side`). `files` writes the results. `sigma` adds up
//! what ranges of parameters do to a run, and `node_sigma` to its nodes.

pub(crate) mod change;
pub(crate) mod files;
pub(crate) mod node_sigma;
pub(crate) mod search;
mod side_by_side;
pub(crate) mod sigma;
pub(crate) mod variant;

use std::path::PathBuf;

use crate::output::OutputError;
use crate::scene::SceneError;
use crate::simulation::engine::EngineError;
use crate::simulation::prepare_error::PrepareError;

/// An error that ends the search.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SensitivityError {
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    #[error(transparent)]
    Engine(#[from] EngineError),
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A parameter that does not fit the scene.
    #[error(transparent)]
    Parameter(#[from] SceneError),
    /// The temperatures come from a file.
    #[error("{}: takes its temperatures from a file ([temperatures]), so no parameter changes them", .0.display())]
    Given(PathBuf),
    /// `[uncertainty]` without a range.
    #[error(
        "{}: [uncertainty] finds no range: state [[uncertainty.parameter]], or absorptivity_range or emissivity_range of a material", .0.display()
    )]
    NoRange(PathBuf),
    /// More images than memory would hold.
    #[error(
        "{}: [uncertainty] holds all images of a run at once, and {images} images of {pixels} pixels are too many: draw fewer or smaller ones", path.display()
    )]
    ManyPixels { path: PathBuf, images: usize, pixels: usize },
    /// The user pressed Ctrl-C.
    #[error("stopped")]
    Stopped,
}
