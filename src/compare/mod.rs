//! Compares one scene under three responses: instant, transition and network.
//!
//! `responses` sets the response of each material in each run. `runs` does the runs, step by step as `walk` says. `differences` compares them
//! with the network. `page` and `files` write the results.

pub(crate) mod differences;
pub(crate) mod files;
pub(crate) mod page;
pub(crate) mod record;
pub(crate) mod responses;
pub(crate) mod runs;
pub(crate) mod walk;

use std::path::PathBuf;

use crate::output::OutputError;
use crate::output::job::JobError;
use crate::simulation::engine::EngineError;
use crate::simulation::prepare_error::PrepareError;
use crate::thermal::fit::FitError;

/// The responses in display order. The last is the reference.
pub const RESPONSES: [&str; 3] = ["instant", "transition", "network"];
/// Index of the run without thermal memory.
pub const INSTANT: usize = 0;
/// Index of the run with transitions.
pub const TRANSITION: usize = 1;
/// Index of the run with the energy balance.
pub const NETWORK: usize = 2;

/// Remark for readers of a comparison of a scene that states no warm-up.
pub const PERIODIC_START: &str = "Each run starts from its own periodic state, because the scene states no warm-up: \
                                  warm_up_orbits = 0 keeps the cold start.";

/// An error that prevents a comparison.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The scene or its model.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// Materials lack values that a network needs.
    #[error(
        "{}: compare runs every material as a network, which needs more than the scene states of {lacks}. State it in the \
         [[material]] or in the table's entry; a material with response = 'instant' and without any of these keys is left \
         as it is in all three runs",
        path.display()
    )]
    Lacks {
        /// The scene file.
        path: PathBuf,
        /// Materials and their missing keys.
        lacks: String,
    },
    /// Every material is instant, so nothing would differ.
    #[error(
        "{}: every material has response = 'instant' and no thickness, density and specific_heat: there is no network to \
         compare with",
        .0.display()
    )]
    NothingToCompare(PathBuf),
    /// No transition fits the step response of a material.
    #[error("material '{material}': no transition fits its step response: {source}")]
    Fit {
        /// The material.
        material: String,
        /// The reason.
        source: FitError,
    },
    /// The best transition of a material does not follow its step response.
    #[error(
        "material '{material}': no transition fits its step response between {:.0} and {:.0} K: {reason}. State heating and cooling in \
         its [[material]]; they may stand beside response = 'network'",
        between[0],
        between[1]
    )]
    NoFit {
        /// The material.
        material: String,
        /// The temperatures of the step [K].
        between: [f64; 2],
        /// What is wrong.
        reason: String,
    },
    /// A run failed.
    #[error(transparent)]
    Job(#[from] JobError),
    /// The user pressed Ctrl-C.
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
