//! The command line: one file for each subcommand, and shared helpers.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use error::CliError;

mod bench;
mod compare;
mod device;
mod digits;
mod environment;
mod environment_plate;
mod error;
mod info;
mod network;
mod network_import;
mod network_report;
mod paper;
mod paper_orbits;
mod progress;
mod radiance;
mod render;
mod response;
mod response_fit;
mod response_targets;
mod run;

/// Simulate thermal-infrared images of spacecraft with thermal memory, on Vulkan.
#[derive(Parser)]
#[command(version, after_help = "Start with: isotherm run models/station.toml -o out/station")]
struct Program {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Run(run::Arguments),
    Render(render::Arguments),
    Compare(compare::Arguments),
    Info(info::Arguments),
    Radiance(radiance::Arguments),
    Response(response::Arguments),
    Network(network::Arguments),
    Environment(environment::Arguments),
    Paper(paper::Arguments),
    Bench(bench::Arguments),
}

/// Runs the program with the arguments of the process.
pub fn main() -> ExitCode {
    let result = match Program::parse().command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Render(arguments) => render::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Radiance(arguments) => radiance::run(&arguments),
        Command::Response(arguments) => response::run(&arguments),
        Command::Network(arguments) => network::run(&arguments),
        Command::Environment(arguments) => environment::run(&arguments),
        Command::Paper(arguments) => paper::run(&arguments),
        Command::Bench(arguments) => bench::run(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // The reader of the output closed the pipe, which is no error.
        Err(CliError::Stdout(error)) if error.kind() == std::io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
