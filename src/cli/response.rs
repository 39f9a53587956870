//! `isotherm response`: how a temperature follows its targets.

use super::{CliError, response_targets};

/// How a temperature follows its targets.
///
/// A node starts at rest at --initial; each step commands the target of that step. Prints step,temperature as CSV, the
/// initial temperature first. The steps are those that a scene's transition takes, computed on the device in f32 and
/// printed with 9 significant digits; --device cpu gives the f64 answer.
#[derive(clap::Args)]
#[command(after_help = response_targets::HELP)]
pub struct Arguments {
    #[command(flatten)]
    targets: response_targets::Targets,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    response_targets::run(&arguments.targets)
}
