//! Finds the values of parameters that explain measurements: telemetry and images of a scene, or telemetry of a network file (docs/fit.md).
//!
//! `case` reads what a fit needs. `scene_model` and `network_model` compute what was measured. `least_squares` finds the values, `posterior` how well they are known, and `words` says
//! which combinations the data leave open. `result` holds all of it, and `files`, `plots` and `rules` write it.

pub(crate) mod case;
pub(crate) mod files;
mod images;
mod least_squares;
mod loss;
mod measurements;
mod network_model;
mod plots;
mod posterior;
mod prior;
pub(crate) mod result;
mod rules;
mod scene_model;
mod telemetry;
mod words;

use std::path::PathBuf;

use crate::output::OutputError;
use crate::scene::SceneError;
use crate::sensitivity::SensitivityError;
use crate::simulation::engine::EngineError;
use crate::simulation::facade_error::SimulationError;
use crate::simulation::prepare_error::PrepareError;

/// An error that ends a fit.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FittingError {
    /// An error in an input file.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The scene cannot be prepared.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// A call of the engine fails.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// A scene in which nothing can be fitted, or a place without a temperature.
    #[error("{0}")]
    Run(String),
    /// The user ended it before there was a result.
    #[error("stopped; nothing was written")]
    Stopped,
    /// A file that cannot be read or written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A measured file that does not fit the model.
    #[error("{}: {reason}", path.display())]
    Measured {
        /// The file.
        path: PathBuf,
        /// The reason and the remedy.
        reason: String,
    },
    /// The data and the priors leave a combination of parameters open.
    #[error("{}: the fit is singular: {reason}", path.display())]
    Singular {
        /// The file of parameters.
        path: PathBuf,
        /// The combination in words, and the remedy.
        reason: String,
    },
}

impl From<FittingError> for SimulationError {
    fn from(error: FittingError) -> Self {
        match error {
            FittingError::Scene(error) => Self::Prepare(error.into()),
            FittingError::Prepare(error) => Self::Prepare(error),
            FittingError::Engine(error) => Self::Engine(error),
            other => Self::Fit(other.to_string()),
        }
    }
}

impl From<SensitivityError> for FittingError {
    fn from(error: SensitivityError) -> Self {
        match error {
            SensitivityError::Prepare(error) => Self::Prepare(error),
            SensitivityError::Parameter(error) => Self::Scene(error),
            SensitivityError::Engine(error) => Self::Engine(error),
            SensitivityError::Output(error) => Self::Output(error),
            SensitivityError::Stopped => Self::Stopped,
            other => Self::Run(other.to_string()),
        }
    }
}
