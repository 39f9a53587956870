//! `isotherm view`: shows a scene on a page in the browser.

use std::net::{Ipv4Addr, TcpListener};
use std::path::PathBuf;

use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::prepare::{guard, prepare_scene};
use super::progress::{stop_flag, warm_up_bar};
use super::reach::ReachArguments;
use super::thermal_state;
use crate::guard::finding::CheckEffort;
use crate::output::console::{answer, say};
use crate::scene::{Draw, Motion};
use crate::simulation::facade::Simulation;
use crate::simulation::forecast::Forecast;
use crate::stop::{Stopped, until};
use crate::view::browser;
use crate::view::camera::camera;
use crate::view::session::ViewSession;

/// Show a scene on a page in the browser: turn the craft, play and scrub through time, read temperatures.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm view models/station.toml\n  \
isotherm view models/station.toml --port 8080 --no-browser\n  \
isotherm view models/station.toml --size 960x540 --from-state out/warm.state\n\n\
The page listens on 127.0.0.1 only. Ctrl-C ends it.")]
pub(crate) struct Arguments {
    /// Scene file (TOML, described in docs/scene.md)
    scene: PathBuf,
    /// Port on this computer; 0 takes a free one
    #[arg(long, value_name = "N", default_value_t = 0)]
    port: u16,
    /// Do not open the browser
    #[arg(long)]
    no_browser: bool,
    /// Size of the image in pixels [default: the scene's size, or a smaller one of the same shape with at most 640 x 480 pixels]
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Begin time 0 with a state of isotherm run --save-state, instead of a warm-up
    #[arg(long, value_name = "FILE")]
    from_state: Option<PathBuf>,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

/// Longest and shortest side of an image [px].
const SIDES: std::ops::RangeInclusive<u32> = 16..=4096;

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let wrong = || format!("it takes two numbers of pixels from {} to {}, such as 800x600", SIDES.start(), SIDES.end());
    let (width, height) = text.split_once('x').ok_or_else(wrong)?;
    let side = |text: &str| text.parse().ok().filter(|side| SIDES.contains(side)).ok_or_else(wrong);
    Ok([side(width)?, side(height)?])
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let mut scene = arguments.reach.scene(&arguments.scene)?;
    let has_camera = scene.camera.as_ref().is_some_and(|camera| camera.motion != Motion::Framed);
    let camera = camera(scene.camera.as_ref(), scene.sensor.is_some(), arguments.size).map_err(CliError::Usage)?;
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, arguments.port))
        .map_err(|error| CliError::Usage(format!("--port {}: {error}", arguments.port)))?;
    let address = listener.local_addr().map_err(|error| CliError::Usage(error.to_string()))?;
    scene.camera = Some(camera.clone());
    // Images show the ends of steps, also where the scene draws at other times.
    scene.time.draw = Draw::Every(1);
    let mut prepared = prepare_scene(scene.clone())?;
    guard(&mut prepared, CheckEffort::BRIEF);
    let target = arguments.device.open()?;
    let state = arguments.from_state.as_ref().map(|path| thermal_state::read(path, &prepared, &target)).transpose()?;
    say!("device: {}", target.name());
    let forecast = Forecast::of(&prepared);
    let stop = stop_flag();
    let stopped = |Stopped| CliError::StoppedBefore;
    let mut simulation = until(&stop, || Simulation::new(prepared, &target)).map_err(stopped)??;
    if let Some(state) = &state {
        simulation.restore_at(state, 0.0)?;
    }
    let bar = warm_up_bar(&if state.is_some() { forecast.without_warm_up() } else { forecast });
    let page = format!("http://{address}/");
    answer!("{page}");
    if !arguments.no_browser && !browser::open(&page) {
        say!("There is no desktop here: open this address in a browser. Ctrl-C ends the program.");
    }
    ViewSession { scene, target: target.clone(), simulation, camera, has_camera }.serve(
        listener,
        &stop,
        Box::new(move || bar.inc(1)),
    )?;
    check_validation(&target)
}

#[cfg(test)]
mod tests {
    use super::parse_size;

    #[test]
    fn a_size_is_two_numbers() {
        assert_eq!(parse_size("800x600"), Ok([800, 600]));
        for text in ["800", "800x", "x", "8x600", "800x600x3", "-800x600", "800x5000"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }
}
