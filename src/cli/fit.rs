//! `isotherm fit`: the values of parameters that explain measurements.

use std::cell::RefCell;
use std::path::PathBuf;

use super::arguments::FolderArguments;
use super::columns::aligned;
use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::progress::{building_bar, show_news, show_stage, spinner, stop_flag};
use super::reach::ReachArguments;
use crate::fit::case::{FitCase, FitOrder};
use crate::fit::files::{FILES, summary, write};
use crate::output::console::{answer, say};
use crate::output::folder::Folder;
use crate::simulation::target::Target;

/// Fit parameters of a scene or of a network file to measurements: telemetry and images.
///
/// `isotherm sensitivity` reads the same file of parameters, and a fit also reads priors, the places of sensors and the rules of images (docs/fit.md). Finds the values by Levenberg-Marquardt in
/// logarithms, with a loss that glitches do not rule, and says which combinations the data fix and which they leave open.
///
/// Writes parameters.csv, correlation.csv, misfits.csv, residuals.csv, fit.json, fitted.toml (the values, to be used at once), measured.svg and residuals.svg. Ctrl-C keeps the best
/// values so far.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isotherm fit scene.toml --measured telemetry.csv --parameters parameters.toml -o out/fit\n  \
isotherm fit scene.toml --measured t.csv frames/*.exr --parameters parameters.toml -o out/fit\n  \
isotherm fit network.toml --measured telemetry.csv --parameters parameters.toml -o out/fit"
)]
pub(crate) struct Arguments {
    /// Scene file, or network file (TOML)
    model: PathBuf,
    /// Telemetry (CSV: time,sensor,temperature,sigma) and images (EXR of isotherm, or PNG of 16 bits)
    #[arg(long, value_name = "FILE", num_args = 1.., required = true)]
    measured: Vec<PathBuf>,
    /// Parameters, sensors and images (TOML; docs/fit.md says what it holds)
    #[arg(long, value_name = "FILE")]
    parameters: PathBuf,
    #[command(flatten)]
    folder: FolderArguments,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let order = FitOrder {
        model: &arguments.model,
        measured: &arguments.measured,
        parameters: &arguments.parameters,
        reach: arguments.reach.of(&arguments.model),
    };
    let stop = stop_flag();
    let building = building_bar();
    let case = FitCase::load(&order, &stop, &mut |stage| show_stage(&building, stage));
    building.finish_and_clear();
    let case = case?;
    case.notes().iter().for_each(|note| say!("{note}"));
    let inputs = case.files().to_vec();
    let folder = Folder::new(&arguments.folder.output, &FILES);
    folder.keep_inputs(&inputs)?;
    let target = if case.needs_device() { arguments.device.open()? } else { Target::Reference };
    say!("device: {}", target.name());
    let folder = folder.prepare(arguments.folder.force, &inputs)?;
    let bar = RefCell::new(spinner("fitting"));
    let fitted = case.solve(&target, &|news| show_news(&bar, news));
    bar.borrow().finish_and_clear();
    let fitted = fitted.inspect_err(|_| folder.take_back())?;
    write(&folder, &fitted)?;
    folder.finish()?;
    fitted.warning().iter().for_each(|warning| say!("warning: {warning}"));
    aligned(&summary(&fitted), 2).iter().for_each(|line| answer!("{line}"));
    fitted.sentences().iter().for_each(|sentence| answer!("{sentence}"));
    answer!("tables, values and plots: {}", folder.root().display());
    if fitted.is_stopped() {
        return Err(CliError::Stopped(folder.root().to_path_buf()));
    }
    check_validation(&target)
}
