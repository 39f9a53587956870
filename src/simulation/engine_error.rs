//! Errors of an engine during a run.

use crate::gpu::error::GpuError;
use crate::thermal::misfit::Misfit;

/// An error of an engine during a run.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// An error of the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A saved state of another scene.
    #[error("the saved state does not fit: {0}")]
    Saved(#[from] Misfit),
    /// A thermal network could not be integrated.
    #[error("the thermal network at {time} s: {reason}")]
    Network {
        /// Start of the step [s].
        time: f64,
        /// The cause.
        reason: String,
    },
    /// A node without a temperature at the end of an orbit.
    #[error("an orbit of the warm-up ended without a temperature of a node of the part '{part}'")]
    NoTemperature {
        /// The part.
        part: String,
    },
}
