//! `isotherm response`: the response of a temperature to targets, and fits of response functions.

use super::error::CliError;
use super::{response_fit, response_targets};

/// Print the response of a temperature to targets.
///
/// A node starts at rest at --initial. Each step commands the target of that step. The CSV has the columns
/// step,temperature and starts with the initial temperature. A transition in a scene takes the same steps. The device computes in f32, and --device
/// cpu computes in f64. The CSV has 9 significant digits.
#[derive(clap::Args)]
#[command(after_help = response_targets::HELP, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Option<ResponseCommand>,
    #[command(flatten)]
    targets: response_targets::Targets,
}

#[derive(clap::Subcommand)]
enum ResponseCommand {
    Fit(response_fit::Arguments),
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.command {
        Some(ResponseCommand::Fit(arguments)) => response_fit::run(arguments),
        None => response_targets::run(&arguments.targets),
    }
}
