//! Errors of data sets.

use std::path::PathBuf;

use crate::output::OutputError;
use crate::scene::SceneError;
use crate::simulation::facade_error::SimulationError;

/// Why a data set is not made.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// SPEC or scene can not be used.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// SPEC and scene do not fit together.
    #[error("{}: {message}", path.display())]
    Spec {
        /// The SPEC file.
        path: PathBuf,
        /// The fault, in words.
        message: String,
    },
    /// The scene of an orbit can not be used.
    #[error("orbit {orbit}: {reason}")]
    Orbit {
        /// Number of the orbit.
        orbit: u64,
        /// The fault, in words.
        reason: String,
    },
    /// No attempt at an image was accepted.
    #[error(
        "image {image} of orbit {orbit}: no sample after {attempts} attempts: {reasons}; widen the distributions, [reject] or attempts"
    )]
    NoSample {
        /// Number of the image.
        image: u64,
        /// Number of the orbit.
        orbit: u64,
        /// Number of the attempts.
        attempts: u32,
        /// How many were rejected, and why.
        reasons: String,
    },
    /// A step or an image failed.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The runs of the uncertainty failed.
    #[error("{0}")]
    Uncertainty(String),
    /// A file can not be written or read.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The folder holds another data set.
    #[error("{} holds a data set with another {what}; name another folder, or begin anew with --force", folder.display())]
    Other {
        /// The folder.
        folder: PathBuf,
        /// What differs.
        what: String,
    },
    /// The folder holds orbits of this shard already.
    #[error("{} holds {count} orbits of this shard already; go on with --resume, or begin anew with --force", folder.display())]
    Begun {
        /// The folder.
        folder: PathBuf,
        /// Number of the orbits.
        count: usize,
    },
    /// The folder holds no data set.
    #[error("{} holds no data set: {reason}", folder.display())]
    None {
        /// The folder.
        folder: PathBuf,
        /// The missing thing, in words.
        reason: String,
    },
    /// A data set that fails its verification.
    #[error("{} is not as it was written (faults: {count}): {first}", folder.display())]
    Damaged {
        /// The folder.
        folder: PathBuf,
        /// Number of the faults.
        count: usize,
        /// The first of them.
        first: String,
    },
    /// A signal ended it.
    #[error("stopped; what was finished is in {}, and --resume goes on with it", .0.display())]
    Stopped(PathBuf),
    /// A signal ended a command that writes only at its end.
    #[error("stopped; nothing was written")]
    StoppedBefore,
}

impl DatasetError {
    /// Whether the user can mend it.
    pub fn is_of_the_user(&self) -> bool {
        match self {
            Self::Simulation(error) => error.is_of_the_user(),
            Self::Output(error) => error.is_about_the_folder(),
            Self::Stopped(_) | Self::StoppedBefore | Self::Damaged { .. } => false,
            _ => true,
        }
    }
}
