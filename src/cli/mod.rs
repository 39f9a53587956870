//! The command line: one file per subcommand, and what they share.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::{Args, Parser, Subcommand};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::compare::CompareError;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::output::OutputError;
use crate::output::job::JobError;
use crate::simulation::prepare_error::{PrepareError, Stage};
use crate::thermal::brightness::BrightnessError;

mod bench;
mod compare;
mod environment;
mod environment_plate;
mod info;
mod network;
mod network_import;
mod network_report;
mod paper;
mod paper_orbits;
mod radiance;
mod render;
mod response;
mod response_fit;
mod response_targets;
mod run;

/// Thermal-infrared images of spacecraft with a thermal memory, on Vulkan.
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

/// Where to compute.
#[derive(Args)]
struct DeviceArguments {
    /// Vulkan device whose name contains NAME, or `cpu` for the f64 reference [default: the best device present]
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
}

/// Who computes.
enum Chosen {
    Device(Arc<Context>),
    Reference,
}

impl DeviceArguments {
    /// Opens the device; with `ISOTHERM_VALIDATION=1` in the environment under the validation layer.
    fn open(&self) -> Result<Chosen, GpuError> {
        if self.device.as_deref().is_some_and(|name| name.eq_ignore_ascii_case("cpu")) {
            return Ok(Chosen::Reference);
        }
        let validate = std::env::var_os("ISOTHERM_VALIDATION").is_some_and(|value| value == "1");
        let context = Context::open(self.device.as_deref(), validate)?;
        Ok(Chosen::Device(context))
    }
}

impl Chosen {
    fn name(&self) -> String {
        match self {
            Self::Device(context) => context.info.name.clone(),
            Self::Reference => "cpu (f64 reference)".to_owned(),
        }
    }

    /// Fails where the validation layer had something to say.
    fn check_validation(&self) -> Result<(), CliError> {
        match self {
            Self::Device(context) => {
                let messages = context.validation_messages();
                if messages.is_empty() { Ok(()) } else { Err(CliError::Validation(messages.join("\n"))) }
            }
            Self::Reference => Ok(()),
        }
    }
}

/// Whatever ends a command early.
#[derive(Debug, thiserror::Error)]
enum CliError {
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Job(#[from] JobError),
    #[error(transparent)]
    Brightness(#[from] BrightnessError),
    #[error(transparent)]
    Compare(CompareError),
    #[error("{0}")]
    Usage(String),
    #[error("{0}")]
    Solver(String),
    #[error("the validation layer reports:\n{0}")]
    Validation(String),
    #[error("stopped; what was finished is in {0}")]
    Stopped(PathBuf),
    #[error("stopped; nothing was written")]
    StoppedBefore,
    #[error("writing to standard output: {0}")]
    Stdout(#[from] std::io::Error),
}

impl From<CompareError> for CliError {
    fn from(error: CompareError) -> Self {
        match error {
            CompareError::Prepare(error) => Self::Prepare(error),
            CompareError::Job(error) => Self::Job(error),
            CompareError::Stopped => Self::StoppedBefore,
            other => Self::Compare(other),
        }
    }
}

impl From<std::convert::Infallible> for CliError {
    fn from(never: std::convert::Infallible) -> Self {
        match never {}
    }
}

impl CliError {
    /// 2 for what the user can mend, 1 for what failed.
    fn exit_code(&self) -> u8 {
        match self {
            Self::Prepare(_) | Self::Brightness(_) | Self::Compare(_) | Self::Usage(_) => 2,
            Self::Gpu(error) | Self::Job(JobError::Gpu(error)) => {
                if matches!(error, GpuError::Call { .. } | GpuError::Allocation { .. }) { 1 } else { 2 }
            }
            Self::Output(error) | Self::Job(JobError::Output(error)) => {
                if error.is_about_the_folder() {
                    2
                } else {
                    1
                }
            }
            Self::Job(JobError::NotFinite { .. })
            | Self::Validation(_)
            | Self::Solver(_)
            | Self::Stopped(_)
            | Self::StoppedBefore
            | Self::Stdout(_) => 1,
        }
    }
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
        // Whoever reads our output has seen enough.
        Err(CliError::Stdout(error)) if error.kind() == std::io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

/// A bar on standard error; nothing where that is no terminal.
fn progress_bar(length: u64, what: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    let style = ProgressStyle::with_template("{msg:>12} [{bar:40}] {pos}/{len} {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("=> ");
    bar.set_style(style);
    bar.set_message(what.to_owned());
    bar
}

/// Shows how far the building of a scene is.
fn building_bar() -> ProgressBar {
    progress_bar(Stage::COUNT, "building")
}

/// Moves the bar of `building_bar`.
fn show_stage(bar: &ProgressBar, stage: Stage) {
    bar.set_message(stage.to_string());
    bar.set_position(stage.number());
}

/// A counter on standard error, for work whose end is not known beforehand.
fn spinner(what: &str) -> ProgressBar {
    let bar = ProgressBar::new_spinner();
    let style = ProgressStyle::with_template("{msg:>12} {spinner} {human_pos}")
        .unwrap_or_else(|_| ProgressStyle::default_spinner());
    bar.set_style(style);
    bar.set_message(what.to_owned());
    bar.enable_steady_tick(Duration::from_millis(120));
    bar
}

/// A flag that the first Ctrl-C sets; the second ends the process at once.
fn stop_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&flag);
    // Where no handler can be set, Ctrl-C ends the process; files appear whole or not at all in any case.
    let _ = ctrlc::set_handler(move || {
        if seen.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        eprintln!("\nstopping after this step; Ctrl-C again ends at once");
    });
    flag
}

/// Nine significant digits, enough to tell any two f32 apart; scientific where plain digits would be long.
fn nine_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor() as i32;
    if (-5..9).contains(&exponent) {
        format!("{value:.*}", (8 - exponent).max(0) as usize)
    } else {
        format!("{value:.8e}")
    }
}

#[cfg(test)]
mod tests {
    use super::nine_digits;

    #[test]
    fn numbers_have_nine_significant_digits() {
        assert_eq!(nine_digits(54.933_461_23), "54.9334612");
        assert_eq!(nine_digits(0.000_123_456_789_12), "0.000123456789");
        assert_eq!(nine_digits(1.5e-30), "1.50000000e-30");
        assert_eq!(nine_digits(0.0), "0");
    }
}
