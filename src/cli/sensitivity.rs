//! `isotherm sensitivity`: how temperatures depend on parameters of a scene.

use std::cell::RefCell;
use std::path::PathBuf;

use super::arguments::FolderArguments;
use super::columns::aligned;
use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::prepare::{guard, prepare_scene};
use super::progress::{show_news, spinner, stop_flag, tell_work_here};
use super::reach::ReachArguments;
use crate::converge::walk::kept_images;
use crate::guard::finding::CheckEffort;
use crate::output::console::{answer, say};
use crate::output::folder::Folder;
use crate::scene::read_parameters;
use crate::sensitivity::SensitivityError;
use crate::sensitivity::files::{FILES, summary, write};
use crate::sensitivity::search::{Search, check, draw_kept, settle};

/// Find how temperatures depend on parameters, by differences of whole runs from their own periodic states.
///
/// Each [[parameter]] of the file says which value is varied: absorptivity, emissivity, thickness, capacity or conductivity of materials, the effective emittance
/// of a blanket, a contact, a heater, the solar constant, the albedo or the planet's infrared; and the range in which the value is known. Each takes two runs:
/// up and down by its step. Runs share what a parameter does not touch: geometry, light, rays and view factors.
///
/// Writes sensitivity.csv (parts and probes over time), effects.csv (the largest effect over each range, in kelvin), tornado.svg, and for each drawn image an EXR
/// with a channel for each parameter. The table of effects is printed too.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isotherm sensitivity models/cubesat_conduction.toml --parameters parameters.toml -o out\n  \
        isotherm sensitivity models/station.toml --parameters models/station_parameters.toml -o out"
)]
pub(crate) struct Arguments {
    /// Scene file (TOML; docs/scene.md says what it holds)
    scene: PathBuf,
    /// The parameters (TOML; docs/scene.md says what it holds)
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
    let _on_track = tell_work_here();
    let mut scene = arguments.reach.scene(&arguments.scene)?;
    let parameters = read_parameters(&arguments.parameters).map_err(SensitivityError::Parameter)?;
    if let Some(assumption) = settle(&mut scene) {
        say!("assumed: {assumption}");
    }
    let mut prepared = prepare_scene(scene)?;
    guard(&mut prepared, CheckEffort::BRIEF);
    let values = check(&parameters, &prepared)?;
    let kept = kept_images(&prepared.scene, 2 * parameters.len());
    let kept = draw_kept(&mut prepared.scene, kept);
    let inputs: Vec<PathBuf> = prepared.scene.files.iter().chain([&arguments.parameters]).cloned().collect();
    let folder = Folder::new(&arguments.folder.output, &FILES);
    folder.keep_inputs(&inputs)?;
    let chosen = arguments.device.open()?;
    say!("device: {}", chosen.name());
    let folder = folder.prepare(arguments.folder.force, &inputs)?;
    let stop = stop_flag();
    let bar = RefCell::new(spinner("preparing"));
    let news = |news| show_news(&bar, news);
    let found = Search { target: &chosen, stop: &stop, news: &news, kept: &kept, nodes_every: None }
        .of(&prepared, parameters, values);
    bar.borrow().finish_and_clear();
    let found = found.inspect_err(|_| folder.take_back())?;
    write(&folder, &found)?;
    folder.finish()?;
    aligned(&summary(&found), 1).iter().for_each(|line| answer!("{line}"));
    answer!("effects are linear: the derivative at the scene's value times the range");
    answer!("tables, plot and images: {}", folder.root().display());
    check_validation(&chosen)
}
