//! Why an engine could not go on.

use crate::gpu::error::GpuError;

/// Why an engine could not go on.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A thermal network could not be integrated.
    #[error("the thermal network at {time} s: {reason}")]
    Network {
        /// Start of the step [s].
        time: f64,
        /// Why.
        reason: String,
    },
}
