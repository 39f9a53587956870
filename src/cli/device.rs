//! The `--device` argument of every command.

use clap::Args;

use super::error::CliError;
use crate::gpu::error::GpuError;
use crate::simulation::target::Target;

#[derive(Args)]
pub(super) struct DeviceArguments {
    /// Vulkan device whose name contains NAME, or `cpu` for the f64 reference [default: the best device present]
    #[arg(long, value_name = "NAME")]
    pub(super) device: Option<String>,
}

impl DeviceArguments {
    /// Opens the device. `ISOTHERM_VALIDATION=1` switches the validation layer on.
    pub(super) fn open(&self) -> Result<Target, GpuError> {
        Target::open(self.device.as_deref())
    }
}

/// Fails if the validation layer reported anything.
pub(super) fn check_validation(target: &Target) -> Result<(), CliError> {
    match target.device().map(|context| context.validation_messages()) {
        Some(messages) if !messages.is_empty() => Err(CliError::Validation(messages.join("\n"))),
        _ => Ok(()),
    }
}
