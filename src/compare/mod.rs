//! One scene under three responses: without memory, with profiles in temperature, and by its energy balance.
//!
//! [`responses`] says how each material moves in each run, [`runs`] makes the runs, [`differences`] holds them against the
//! network, [`page`] and [`files`] show what was found.

pub(crate) mod differences;
pub(crate) mod files;
pub(crate) mod page;
pub(crate) mod record;
pub(crate) mod responses;
pub(crate) mod runs;

use std::path::PathBuf;

use crate::output::OutputError;
use crate::output::job::JobError;
use crate::simulation::engine::EngineError;
use crate::simulation::prepare_error::PrepareError;
use crate::thermal::fit::FitError;

/// The responses, in the order in which they are shown; the last is what the others are held against.
pub const RESPONSES: [&str; 3] = ["instant", "transition", "network"];
/// The run without memory.
pub const INSTANT: usize = 0;
/// The run with profiles in temperature.
pub const TRANSITION: usize = 1;
/// The run by the energy balance.
pub const NETWORK: usize = 2;

/// What keeps a scene from being compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The scene or its model.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// Materials without what a network needs.
    #[error(
        "{}: compare runs every material as a network, which needs more than the scene states of {lacks}. State it in the \
         [[material]] or in the table's entry; a material with response = 'instant' and without any of these keys is left \
         as it is in all three runs",
        path.display()
    )]
    Lacks {
        /// The scene file.
        path: PathBuf,
        /// Materials and keys.
        lacks: String,
    },
    /// Nothing would differ.
    #[error(
        "{}: every material has response = 'instant' and no thickness, density and specific_heat: there is no network to \
         compare with",
        .0.display()
    )]
    NothingToCompare(PathBuf),
    /// A material whose step response has no fit.
    #[error("material '{material}': no transition fits its step response: {source}")]
    Fit {
        /// The material.
        material: String,
        /// Why.
        source: FitError,
    },
    /// A run.
    #[error(transparent)]
    Job(#[from] JobError),
    /// Ctrl-C.
    #[error("stopped")]
    Stopped,
}

impl From<EngineError> for CompareError {
    fn from(error: EngineError) -> Self {
        Self::Job(error.into())
    }
}

impl From<OutputError> for CompareError {
    fn from(error: OutputError) -> Self {
        Self::Job(error.into())
    }
}
