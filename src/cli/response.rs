//! `isotherm response`: how a temperature follows its targets.

use super::{CliError, response_fit};

/// How a temperature follows its targets.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    Fit(response_fit::Arguments),
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.command {
        Command::Fit(arguments) => response_fit::run(arguments),
    }
}
