//! `isotherm converge`: how far the settings of a scene are from convergence, and which are near enough.

use std::cell::RefCell;
use std::path::PathBuf;
use std::time::Instant;

use super::arguments::FolderArguments;
use super::columns::aligned;
use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::poses::draw_at_poses;
use super::prepare::{guard, prepare_scene};
use super::progress::{show_news, spinner, stop_flag, tell_work_here};
use super::reach::ReachArguments;
use crate::converge::files::{FILES, summary, verdict, write};
use crate::converge::search::{Search, check};
use crate::guard::finding::CheckEffort;
use crate::output::console::{answer, say};
use crate::output::folder::Folder;

/// Measure how far a scene's settings are from convergence, by finer runs that trust no estimate.
///
/// Each setting that the scene has is refined by itself, then all at once: edges of the mesh / 2, samples of light x 4 (spacing / 2) and the turn before
/// light is found anew / 4 with [shadows]; rays x 4, patches / 2, hold / 2 and the turn before light is computed anew / 4 with [exchange]; the step / 2; and
/// the accurate integrator of a network. The table has the change of the pixels by each setting, their difference from all settings finer, and the
/// cost of a step. Only pixels that show the same part in both runs count.
///
/// The settings within --within at the least cost are told, where the difference and the estimated error of the finest run meet it together. Settings that
/// cost less than the scene are not tried.
///
/// The command first tells how long it takes. Writes converge.csv, converge.svg and settings.toml, which replaces keys of the scene.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm converge models/cubesat.toml -o out/converge\n  \
isotherm converge models/cubesat.toml -o out/converge --force --within 0.2\n  \
isotherm converge models/station.toml -o out/station_converge --poses poses.csv")]
pub(crate) struct Arguments {
    /// Scene file (TOML; docs/scene.md says what it holds)
    scene: PathBuf,
    #[command(flatten)]
    folder: FolderArguments,
    /// Error that the settings may have [K rms over pixels]
    #[arg(long, value_name = "KELVIN", default_value_t = 0.5, value_parser = kelvin)]
    within: f64,
    /// Compare at these poses instead of the scene's images: a table in the camera's frame (CSV: time,x,y,z,qw,qx,qy,qz)
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

fn kelvin(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("must be a number above 0 [K]".to_owned()),
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let _on_track = tell_work_here();
    let mut scene = arguments.reach.scene(&arguments.scene)?;
    // Surface temperatures are compared, which no sensor changes.
    scene.sensor = None;
    if let Some(poses) = &arguments.poses {
        draw_at_poses(&mut scene, poses)?;
    }
    check(&scene)?;
    let began = Instant::now();
    let mut prepared = prepare_scene(scene.clone())?;
    guard(&mut prepared, CheckEffort::BRIEF);
    let preparing = began.elapsed();
    let folder = Folder::new(&arguments.folder.output, &FILES);
    folder.keep_inputs(&prepared.scene.files)?;
    let chosen = arguments.device.open()?;
    say!("device: {}", chosen.name());
    let folder = folder.prepare(arguments.folder.force, &prepared.scene.files)?;
    let stop = stop_flag();
    // Only one bar is shown at a time.
    let bar = RefCell::new(spinner("measuring"));
    let news = |news| show_news(&bar, news);
    let search = Search { target: &chosen, within: arguments.within, stop: &stop, news: &news };
    let converged = search.of(scene, &prepared, preparing);
    bar.borrow().finish_and_clear();
    let converged = converged.inspect_err(|_| folder.take_back())?;
    write(&folder, &converged)?;
    folder.finish()?;
    aligned(&summary(&converged), 3).iter().chain(&verdict(&converged)).for_each(|line| answer!("{line}"));
    answer!("table, plot and settings: {}", folder.root().display());
    check_validation(&chosen)
}
