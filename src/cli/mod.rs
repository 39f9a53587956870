//! The command line: one file for each subcommand, and shared helpers.

use std::io::ErrorKind;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use error::CliError;
use memory::parse_memory;

use crate::host::set_memory_budget;
use crate::output::OutputError;
use crate::output::console::{finish, say};

mod arguments;
mod bench;
mod check;
mod columns;
mod compare;
mod converge;
mod dataset;
mod device;
mod digits;
mod environment;
mod environment_plate;
mod error;
mod fit;
mod info;
mod info_network;
mod info_scene;
mod materials;
mod memory;
mod network;
mod network_export;
mod network_import;
mod network_report;
mod pace;
mod paper;
mod paper_orbits;
mod poses;
mod prepare;
mod progress;
mod radiance;
mod reach;
mod render;
mod response;
mod response_fit;
mod response_targets;
mod resume;
mod run;
mod run_report;
mod sensitivity;
mod serve;
mod thermal_state;
mod time;
mod uncertainty;
mod view;
mod view_factors;

const AFTER_HELP: &str = "\
Start with: isotherm run models/station.toml -o out/station

Where an option names one output file, - is standard output. Devices, pipes and
sockets are written, never replaced, links are followed, and a regular file
appears whole or not at all.";

/// Simulate thermal-infrared images of spacecraft with thermal memory, on Vulkan.
#[derive(Parser)]
#[command(version, after_help = AFTER_HELP)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
    /// Most memory that the process may take, such as 4GiB. A larger request ends with an error [default: three quarters of the free memory]
    #[arg(long, global = true, value_name = "SIZE", value_parser = parse_memory)]
    max_memory: Option<u64>,
}

#[derive(Subcommand)]
enum Command {
    Run(run::Arguments),
    Render(render::Arguments),
    View(view::Arguments),
    Compare(compare::Arguments),
    Converge(converge::Arguments),
    Sensitivity(sensitivity::Arguments),
    Fit(fit::Arguments),
    Check(check::Arguments),
    Info(info::Arguments),
    Materials(materials::Arguments),
    Radiance(radiance::Arguments),
    Response(response::Arguments),
    Network(network::Arguments),
    Environment(environment::Arguments),
    ViewFactors(view_factors::Arguments),
    Paper(paper::Arguments),
    Bench(bench::Arguments),
    Serve(serve::Arguments),
    Dataset(Box<dataset::Arguments>),
}

/// Runs the program with the arguments of the process.
pub fn main() -> ExitCode {
    let program = match CommandLine::try_parse() {
        Ok(program) => program,
        Err(error) => return usage(&error),
    };
    program.max_memory.into_iter().for_each(set_memory_budget);
    progress::watch_signals();
    let result = match program.command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Render(arguments) => render::run(&arguments),
        Command::View(arguments) => view::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Converge(arguments) => converge::run(&arguments),
        Command::Sensitivity(arguments) => sensitivity::run(&arguments),
        Command::Fit(arguments) => fit::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Materials(arguments) => materials::run(&arguments),
        Command::Radiance(arguments) => radiance::run(&arguments),
        Command::Response(arguments) => response::run(&arguments),
        Command::Network(arguments) => network::run(&arguments),
        Command::Environment(arguments) => environment::run(&arguments),
        Command::ViewFactors(arguments) => view_factors::run(&arguments),
        Command::Paper(arguments) => paper::run(&arguments),
        Command::Bench(arguments) => bench::run(&arguments),
        Command::Serve(arguments) => serve::run(&arguments),
        Command::Dataset(arguments) => dataset::run(&arguments),
    };
    exit(result)
}

/// Tells an error, and chooses the exit code.
fn exit(result: Result<(), CliError>) -> ExitCode {
    match result.and_then(|()| Ok(finish().map_err(OutputError::StandardOutput)?)) {
        Ok(()) => ExitCode::SUCCESS,
        // The reader of the output has seen enough, which is no error.
        Err(CliError::Output(OutputError::StandardOutput(error))) if error.kind() == ErrorKind::BrokenPipe => {
            ExitCode::SUCCESS
        }
        Err(error) => {
            match &error {
                CliError::Prepare(error) => error.each().iter().for_each(|one| say!("error: {one}")),
                _ => say!("error: {error}"),
            }
            ExitCode::from(error.exit_code())
        }
    }
}

/// Prints the help or version that the user asked for, or the fault in the arguments.
fn usage(error: &clap::Error) -> ExitCode {
    let printed = match arguments::hold_hidden() {
        // The message repeats arguments. The colours of the message hold escape characters too, so they are left out.
        true => {
            say!("{}", error.render());
            Ok(())
        }
        false => error.print(),
    };
    match error.use_stderr() {
        true => ExitCode::from(2),
        false => exit(printed.map_err(|error| OutputError::StandardOutput(error).into())),
    }
}
