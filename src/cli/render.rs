//! `isotherm render`: draws one image of a scene, or one for each pose of a table.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::ProgressBar;

use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::poses::draw_at_poses;
use super::prepare::{guard, prepare_scene, prepare_with_progress, say_size};
use super::progress::{progress_bar, stop_flag, warm_up_bar};
use super::reach::ReachArguments;
use super::thermal_state;
use super::time::parse_time;
use super::uncertainty::{sigma_at, sigma_of};
use crate::guard::finding::CheckEffort;
use crate::output::console::{self, answer, say};
use crate::output::destination::{Destination, STANDARD_OUTPUT, destinations};
use crate::output::exr::encode;
use crate::output::folder::Folder;
use crate::output::frame_maker::FrameMaker;
use crate::output::inputs::keep_inputs;
use crate::output::pose_images::{FILES, write_pose_images};
use crate::output::sensor_files::{SensorFiles, sensed_scenes};
use crate::simulation;
use crate::simulation::device_data::DeviceData;
use crate::simulation::engine::Engine;
use crate::simulation::facade::Simulation;
use crate::simulation::forecast::Forecast;
use crate::simulation::pose::Pose;
use crate::simulation::prepare::Prepared;
use crate::simulation::prepare_error::PrepareError;
use crate::simulation::target::Target;
use crate::simulation::thermal_state::ThermalState;
use crate::stop::{Stopped, until};

/// Render one image after stepping the scene to its time, or one image for each pose of a table.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm render models/station.toml --time 1200 -o station.exr\n  \
isotherm render models/station.toml --poses poses.csv -o out/poses\n  \
isotherm render models/station.toml --poses poses.csv -o out/poses --from-state out/warm.state")]
pub(crate) struct Arguments {
    /// Scene file (TOML, described in docs/scene.md)
    scene: PathBuf,
    /// Time since the start [s]; the last step is shorter if this is no multiple of the scene's step
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = parse_time, required_unless_present = "poses")]
    time: Option<f64>,
    /// Table of poses in the camera's frame (CSV: time,x,y,z,qw,qx,qy,qz), one image for each row. Times may be equal. The scene is stepped once
    #[arg(long, value_name = "FILE", conflicts_with = "time")]
    poses: Option<PathBuf>,
    /// Image to write, or - for standard output: float32 EXR with radiance, temperature, depth, part and material. With --poses it is a folder, which
    /// must be empty or absent without --force
    #[arg(short, long, value_name = "FILE.exr|DIR")]
    output: PathBuf,
    /// With --poses: replace the files that isotherm wrote into the output folder, and keep all others
    #[arg(long, requires = "poses")]
    force: bool,
    /// Begin time 0 with a state of isotherm run --save-state, instead of a warm-up
    #[arg(long, value_name = "FILE")]
    from_state: Option<PathBuf>,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    match (&arguments.poses, arguments.time) {
        (Some(poses), _) => render_poses(arguments, poses),
        (None, time) => render_one(arguments, time.unwrap_or(0.0)),
    }
}

impl Arguments {
    /// The state of `--from-state`. One that does not fit is refused before anything is written.
    fn state(&self, prepared: &Prepared, chosen: &Target) -> Result<Option<ThermalState>, CliError> {
        self.from_state.as_ref().map(|path| thermal_state::read(path, prepared, chosen)).transpose()
    }
}

/// Brings the engine to time 0: from a state, or by the warm-up.
fn begin(
    state: Option<&ThermalState>,
    prepared: &Prepared,
    engine: &mut dyn Engine,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
) -> Result<(), CliError> {
    if let Some(state) = state {
        state.begin(engine, None)?;
        return Ok(());
    }
    let periodic = simulation::start(prepared, engine, None, stop, progress)?;
    if let Some(warning) = periodic.and_then(|periodic| periodic.warning("")) {
        say!("warning: {warning}");
    }
    Ok(())
}

/// Draws an image for each pose of a table.
fn render_poses(arguments: &Arguments, poses: &Path) -> Result<(), CliError> {
    if arguments.output == Path::new(STANDARD_OUTPUT) {
        return Err(CliError::Usage(
            "standard output takes one file, and --poses writes a folder: name a folder".to_owned(),
        ));
    }
    let mut scene = arguments.reach.scene(&arguments.scene)?;
    draw_at_poses(&mut scene, poses)?;
    let mut prepared = prepare_scene(scene)?;
    guard(&mut prepared, CheckEffort::BRIEF);
    let camera = prepared.scene.require_camera().map_err(PrepareError::from)?.clone();
    let folder = Folder::new(&arguments.output, &FILES);
    let inputs: Vec<PathBuf> = prepared.scene.files.iter().chain(&arguments.from_state).cloned().collect();
    folder.keep_inputs(&inputs)?;
    let chosen = arguments.device.open()?;
    let state = arguments.state(&prepared, &chosen)?;
    let stop = stop_flag();
    let stopped = |Stopped| CliError::StoppedBefore;
    say!("device: {}", chosen.name());
    say_size(&prepared, &DeviceData::new(&prepared).scene_data(&prepared, Some(&camera)).plan(), &chosen);
    let forecast = Forecast::of(&prepared);
    let forecast = if arguments.from_state.is_some() { forecast.without_warm_up() } else { forecast };
    say!("{}", forecast.sentence());
    let sigma = sigma_of(&prepared, &chosen, &stop)?;
    let mut engine = until(&stop, || chosen.engine(&prepared, Some(&camera))).map_err(stopped)??;
    let folder = folder.prepare(arguments.force, &inputs)?;
    let bars = [warm_up_bar(&forecast), progress_bar(forecast.images, "images")];
    let begun = until(&stop, || begin(state.as_ref(), &prepared, &mut *engine, &stop, &mut || bars[0].inc(1)));
    begun.map_err(|Stopped| CliError::Stopped(arguments.output.clone()))??;
    let errors = state.as_ref().and_then(|state| state.errors.as_ref());
    let known = (errors, sigma.as_ref());
    let complete = write_pose_images(&prepared, &mut *engine, &folder, known, &stop, &mut || bars[1].inc(1));
    bars.iter().for_each(ProgressBar::finish_and_clear);
    if !complete? || stop.load(Ordering::Relaxed) {
        return Err(CliError::Stopped(arguments.output.clone()));
    }
    folder.finish()?;
    answer!("{} images in {}", forecast.images, arguments.output.display());
    check_validation(&chosen)
}

fn render_one(arguments: &Arguments, time: f64) -> Result<(), CliError> {
    let [output] = destinations([Some(&*arguments.output)])?;
    let output = output.unwrap_or(Destination::StandardOutput);
    if output == Destination::StandardOutput && console::is_seen() {
        return Err(CliError::Usage("an image is no text for a terminal: name a file, or redirect it".to_owned()));
    }
    let mut prepared = prepare_with_progress(&arguments.scene, arguments.reach)?;
    keep_inputs(&arguments.output, &prepared.scene.files)?;
    prepared.cover(time)?;
    let camera = prepared.scene.require_camera().map_err(PrepareError::from)?.clone();
    camera.check_times(std::iter::once(time)).map_err(PrepareError::from)?;
    guard(&mut prepared, CheckEffort { at: Some(time), ..CheckEffort::BRIEF });
    let steps = (time / prepared.scene.time.step).ceil() as u64;
    let chosen = arguments.device.open()?;
    let state = arguments.state(&prepared, &chosen)?;
    let stop = stop_flag();
    let stopped = |Stopped| CliError::StoppedBefore;
    say!("device: {}", chosen.name());
    say_size(&prepared, &DeviceData::new(&prepared).scene_data(&prepared, Some(&camera)).plan(), &chosen);
    let still = Forecast { steps, ..Forecast::of(&prepared) };
    let still = if arguments.from_state.is_some() { still.without_warm_up() } else { still };
    say!("{}", still.of_one_image().sentence());
    let sigma = sigma_at(time, &prepared, &chosen, &stop)?;
    let mut simulation = until(&stop, || Simulation::new(prepared, &chosen)).map_err(stopped)??;
    let bars = [warm_up_bar(&still), progress_bar(steps, "stepping")];
    match &state {
        Some(state) => simulation.restore_at(state, 0.0)?,
        None => {
            until(&stop, || simulation.begin_with(&stop, &mut || bars[0].inc(1))).map_err(stopped)??;
        }
    }
    if let Some(warning) = simulation.periodic().and_then(|periodic| periodic.warning("")) {
        say!("warning: {warning}");
    }
    bars[0].finish_and_clear();
    let there = simulation.step_to_with(time, &stop, &mut || bars[1].inc(1))?;
    bars[1].finish_and_clear();
    if !there {
        return Err(CliError::StoppedBefore);
    }
    let mut image = until(&stop, || simulation.image(&camera, &Pose::OfCamera)).map_err(stopped)??;
    let prepared = simulation.prepared();
    let step = (time / prepared.scene.time.step + 1e-9) as u32;
    let maker = FrameMaker::new(prepared, &simulation.device_name());
    let header = maker.header(&image, step, None)?;
    sigma.inspect(|sigma| sigma.add_only_to(&mut image));
    output.write_bytes(&encode(&image, &header)?)?;
    let sensed = sensed_scenes(&prepared.scene);
    for files in SensorFiles::all(&sensed) {
        if output == Destination::StandardOutput {
            say!("the sensor's files are left out, because the image goes to standard output");
            break;
        }
        let stem = files.stem(&arguments.output.file_stem().unwrap_or_default().to_string_lossy());
        for (ending, bytes) in files.of(&stem, &image, step)? {
            let path = arguments.output.with_file_name(format!("{stem}{ending}"));
            keep_inputs(&path, &prepared.scene.files)?;
            for destination in destinations([Some(&*path)])?.into_iter().flatten() {
                destination.write_bytes(&bytes)?;
            }
        }
    }
    if output != Destination::StandardOutput {
        answer!("{}", arguments.output.display());
    }
    check_validation(&chosen)
}
