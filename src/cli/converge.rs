//! `isotherm converge`: how far the settings of a scene are from convergence, and which are near enough.

use std::cell::RefCell;
use std::path::PathBuf;

use indicatif::ProgressBar;

use super::arguments::{command_line, folder};
use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::prepare::say_notes;
use super::progress::{building_bar, progress_bar, show_stage, stop_flag};
use super::reach::ReachArguments;
use crate::converge::ConvergeError;
use crate::converge::files::{FILES, PAGE, summary, verdict, write};
use crate::converge::search::{ConvergeNews, Search};
use crate::environment::trajectory::Trajectory;
use crate::output::console::{answer, say};
use crate::output::folder::Folder;
use crate::scene::work::too_late;
use crate::scene::{Draw, Motion, Poses, Scene, read_poses};
use crate::simulation::prepare::Prepared;
use crate::simulation::prepare_error::PrepareError;

/// Measure how far a scene's settings are from convergence, by finer runs that trust no estimate.
///
/// One setting at a time is refined, as far as the scene has it: edges of the mesh / 2, samples of light x 4, turn before light is found anew / 4, and for
/// radiation between surfaces rays x 4, patches / 2, hold 0, turn before rays are cast anew / 4; then the step / 2 and the accurate integrator. A setting that
/// still changes the images is refined up to three times. Then all are refined at once: the difference is the error of the scene. The cheapest settings
/// within --within are run to verify them. Only pixels that show the same part in both runs count.
///
/// The command first tells how long it takes. Writes converge.csv, converge.svg, converge.html and settings.toml, the settings to paste into the scene.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm converge models/cubesat.toml -o out/converge\n  \
isotherm converge models/cubesat.toml -o out/converge --force --within 0.2\n  \
isotherm converge models/station.toml -o out/converge --poses poses.csv")]
pub(crate) struct Arguments {
    /// Scene file (TOML; docs/scene.md says what it holds)
    scene: PathBuf,
    /// Output folder. Without --force it must be empty or absent
    #[arg(short, long, value_name = "DIR", value_parser = folder())]
    output: PathBuf,
    /// Error that the settings may have [K rms over pixels]
    #[arg(long, value_name = "KELVIN", default_value_t = 0.5, value_parser = kelvin)]
    within: f64,
    /// Compare at these poses instead of the scene's images: a table in the camera's frame (CSV: time,x,y,z,qw,qx,qy,qz)
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,
    /// Replace the files that isotherm wrote into the output folder, and keep all others. It refuses a file that was changed since
    #[arg(long)]
    force: bool,
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
    let scene = scene(arguments)?;
    let bar = building_bar();
    let prepared = Prepared::from_scene(scene.clone(), &mut |stage| show_stage(&bar, stage));
    bar.finish_and_clear();
    let prepared = prepared?;
    say_notes(&prepared);
    let folder = Folder::new(&arguments.output, &FILES);
    folder.keep_inputs(&prepared.scene.files)?;
    let chosen = arguments.device.open()?;
    say!("device: {}", chosen.name());
    let folder = folder.prepare(arguments.force, &prepared.scene.files)?;
    let stop = stop_flag();
    let bar: RefCell<Option<ProgressBar>> = RefCell::new(None);
    // Predicted and done milliseconds.
    let work = RefCell::new([0.0f64; 2]);
    let news = |news: ConvergeNews<'_>| {
        match news {
            ConvergeNews::Says(text) => say!("{text}"),
            ConvergeNews::Ahead(ms) => work.borrow_mut()[0] += ms,
            ConvergeNews::Done(ms) => work.borrow_mut()[1] += ms,
            ConvergeNews::Begins(name) => say!("run: {name}"),
        }
        let [ahead, done] = *work.borrow();
        if ahead > 0.0 {
            let mut bar = bar.borrow_mut();
            let bar = bar.get_or_insert_with(|| progress_bar(0, "work [ms]"));
            bar.set_length(ahead as u64);
            bar.set_position(done.min(ahead) as u64);
        }
    };
    let search = Search { target: &chosen, within: arguments.within, stop: &stop, news: &news };
    let found = search.of(scene, &prepared);
    if let Some(bar) = bar.borrow().as_ref() {
        bar.finish_and_clear();
    }
    let found = found.inspect_err(|_| folder.take_back())?;
    write(&folder, &found, &command_line())?;
    folder.finish()?;
    for warning in &found.warnings {
        say!("warning: {warning}");
    }
    print_table(&summary(&found));
    verdict(&found).iter().for_each(|line| answer!("{line}"));
    answer!("report: {}", folder.file(PAGE).display());
    check_validation(&chosen)
}

/// The scene, with the poses where they are given. Surface temperatures are compared, which no sensor changes.
fn scene(arguments: &Arguments) -> Result<Scene, CliError> {
    let mut scene = arguments.reach.scene(&arguments.scene)?;
    scene.sensor = None;
    if scene.temperatures.is_some() {
        return Err(ConvergeError::Given(arguments.scene.clone()).into());
    }
    if let Some(poses) = &arguments.poses {
        scene.require_camera().map_err(PrepareError::from)?;
        let start = scene.orbit.trajectory().map(Trajectory::start).or(scene.time.start);
        let Poses { times, poses: listed } = read_poses(poses, start).map_err(PrepareError::from)?;
        let last = times.iter().copied().fold(0.0, f64::max);
        if let Some(reason) = too_late(last, scene.time.step, &scene.orbit) {
            return Err(PrepareError::Late { path: poses.clone(), reason }.into());
        }
        scene.files.push(poses.clone());
        scene.time.steps = ((last / scene.time.step - 1e-9).ceil() as u32).max(1);
        scene.time.draw = Draw::Times(times);
        if let Some(camera) = &mut scene.camera {
            camera.motion = Motion::Listed(listed.into());
        }
    }
    if scene.camera.is_none() || scene.time.draw == Draw::None {
        return Err(ConvergeError::NoImages(arguments.scene.clone()).into());
    }
    Ok(scene)
}

fn print_table(rows: &[Vec<String>]) {
    let columns = rows.first().map_or(0, Vec::len);
    let widths: Vec<usize> =
        (0..columns).map(|c| rows.iter().map(|row| row[c].chars().count()).max().unwrap_or(0)).collect();
    for row in rows {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}"));
        answer!("{}", cells.collect::<Vec<_>>().join("  ").trim_end());
    }
}
