//! `isotherm environment`: what Sun and planet do to a craft along its trajectory, or to one plate.

use super::{CliError, environment_plate};

/// Sun, planet and eclipses along a scene's trajectory, or what one plate receives from the planet.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(clap::Subcommand)]
enum Command {
    Plate(environment_plate::Arguments),
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.command {
        Some(Command::Plate(arguments)) => environment_plate::run(arguments),
        None => Err(CliError::Usage("state a scene file, or plate".to_owned())),
    }
}
