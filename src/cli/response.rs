//! `isotherm response`: how a temperature follows its targets, and which function it follows them by.

use super::error::CliError;
use super::{response_fit, response_targets};

/// How a temperature follows its targets.
///
/// A node starts at rest at --initial; each step commands the target of that step. Prints step,temperature as CSV, the
/// initial temperature first. The steps are those that a scene's transition takes, computed on the device in f32 and
/// printed with 9 significant digits; --device cpu gives the f64 answer.
#[derive(clap::Args)]
#[command(after_help = response_targets::HELP, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    targets: response_targets::Targets,
}

#[derive(clap::Subcommand)]
enum Command {
    Fit(response_fit::Arguments),
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.command {
        Some(Command::Fit(arguments)) => response_fit::run(arguments),
        None => response_targets::run(&arguments.targets),
    }
}
