//! `isotherm render`: draws one image of a scene.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::progress::{progress_bar, stop_flag};
use super::reach::ReachArguments;
use super::run::{prepare_with_progress, say_size};
use crate::output::console::{self, answer, say};
use crate::output::destination::{Destination, destinations};
use crate::output::exr::encode;
use crate::output::frame_maker::FrameMaker;
use crate::output::inputs::keep_inputs;
use crate::output::sensor_files::SensorFiles;
use crate::simulation;
use crate::simulation::device_data::DeviceData;
use crate::simulation::forecast::{Forecast, Rate};

/// Render one image after stepping the scene to its time.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  isotherm render models/station.toml --time 1200 -o station.exr")]
pub struct Arguments {
    /// Scene file (TOML, described in docs/scene.md)
    scene: PathBuf,
    /// Time since the start [s]; the last step is shorter if this is no multiple of the scene's step
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    time: f64,
    /// Image to write, or - for standard output: float32 EXR with radiance, temperature, depth, part and material
    #[arg(short, long, value_name = "FILE.exr")]
    output: PathBuf,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    if !(arguments.time >= 0.0 && arguments.time.is_finite()) {
        return Err(CliError::Usage(format!("--time is finite and not below 0 s, not {}", arguments.time)));
    }
    let [output] = destinations([Some(&*arguments.output)])?;
    let output = output.unwrap_or(Destination::StandardOutput);
    if output == Destination::StandardOutput && console::is_seen() {
        return Err(CliError::Usage("an image is no text for a terminal: name a file, or redirect it".to_owned()));
    }
    let prepared = prepare_with_progress(&arguments.scene, arguments.reach)?;
    keep_inputs(&arguments.output, &prepared.scene.files)?;
    prepared.cover(arguments.time)?;
    let camera = prepared.scene.require_camera().map_err(simulation::prepare_error::PrepareError::from)?.clone();
    let steps = u64::from(prepared.warm_up_steps()) + (arguments.time / prepared.scene.time.step) as u64;
    let chosen = arguments.device.open()?;
    let stop = stop_flag();
    say!("device: {}", chosen.name());
    say_size(&prepared, &DeviceData::new(&prepared).scene_data(&prepared, Some(&camera)).plan(), &chosen);
    let still =
        Forecast { steps: (arguments.time / prepared.scene.time.step).ceil() as u64, ..Forecast::of(&prepared) };
    say!("{}", still.of_one_image().sentence(Rate::of(&chosen)));
    let mut engine = chosen.engine(&prepared, Some(&camera))?;
    let bar = progress_bar(steps, "stepping");
    let periodic = simulation::start(&prepared, &mut *engine, None, &stop, &mut || bar.inc(1))?;
    let still = simulation::still(&prepared, &mut *engine, arguments.time, &stop, &mut || bar.inc(1))?;
    bar.finish_and_clear();
    let result = match still {
        Some(result) if !stop.load(Ordering::Relaxed) => result,
        _ => return Err(CliError::StoppedBefore),
    };
    if let Some(warning) = periodic.and_then(|periodic| periodic.warning("")) {
        say!("warning: {warning}");
    }
    let maker = FrameMaker::new(&prepared, &camera, &engine.device_name());
    let mut result = result;
    let readings = result.delivered.pixels.as_mut().and_then(|pixels| pixels.readings.take());
    if let Some((frame, header)) = maker.frame(result)? {
        output.write_bytes(&encode(&frame, &header)?)?;
        if let Some((files, readings)) = SensorFiles::new(&prepared.scene).zip(readings) {
            if output == Destination::StandardOutput {
                say!("the sensor's files are left out, because the image goes to standard output");
            } else {
                let stem = arguments.output.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                for (ending, bytes) in files.of(&stem, &frame, &readings)? {
                    let path = arguments.output.with_file_name(format!("{stem}{ending}"));
                    keep_inputs(&path, &prepared.scene.files)?;
                    for destination in destinations([Some(&*path)])?.into_iter().flatten() {
                        destination.write_bytes(&bytes)?;
                    }
                }
            }
        }
        if output != Destination::StandardOutput {
            answer!("{}", arguments.output.display());
        }
    }
    check_validation(&chosen)
}
