//! `isotherm serve`: images and temperatures for simulators in other programs.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::ValueEnum;

use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::progress::stop_flag;
use super::reach::ReachArguments;
use super::thermal_state;
use super::time::parse_time;
use crate::guard;
use crate::guard::finding::CheckEffort;
use crate::output::console::{answer, say};
use crate::server::connection::Patience;
use crate::server::error::ServerError;
use crate::server::listen::{Server, Talk, bind, serve};
use crate::server::log::Log;
use crate::server::picture::{DEFAULT_RANGE, PictureKind, PictureStyle};
use crate::server::scenes::Scenes;
use crate::server::{surrender, telemetry, vizard};

/// Serve images to a simulator that speaks to an image server already, or temperatures to any simulator
///
/// Basilisk scripts speak the protocol `vizard`, scripts of the SurRender client `surrender`. The scripts stay as they are. docs/serve.md says what they
/// must contain, what the pictures show and what is refused. `telemetry` is lines of JSON (docs/telemetry.md).
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm serve models/station.toml --protocol vizard\n  \
isotherm serve target=models/station.toml chaser=craft.toml --protocol vizard --picture apparent16\n  \
isotherm serve models/station.toml --protocol surrender --listen 127.0.0.1:5151 --log requests.log\n  \
isotherm serve models/cubesat_conduction.toml --protocol telemetry")]
pub(crate) struct Arguments {
    /// Scene files. Clients name a scene by its path, its file name with or without ending, or by NAME
    #[arg(required = true, value_name = "[NAME=]SCENE")]
    scenes: Vec<PathBuf>,
    /// What the client speaks
    #[arg(long, value_enum, value_name = "NAME")]
    protocol: Protocol,
    /// Where to listen. Port 0 takes a free one, which is printed [default: 127.0.0.1:5556 for vizard, 127.0.0.1:5151 for surrender, 127.0.0.1:5577 for telemetry]
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<SocketAddr>,
    /// Listen also at an address that other machines reach. The protocols have no authentication: whoever reaches the port may use it
    #[arg(long)]
    allow_remote: bool,
    /// What a picture of `vizard` shows
    #[arg(long, value_enum, default_value = "apparent", value_name = "NAME")]
    picture: PictureKind,
    /// Temperatures of black and white of `--picture apparent` [K] [default: output.colour_range of the scene, or 150,400]
    #[arg(long, value_name = "LOW,HIGH", value_parser = parse_range)]
    range: Option<[f64; 2]>,
    /// Time of the scene's own orbit at which a session of `surrender` begins [s]
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = parse_time)]
    time: f64,
    /// Begin each craft with a state of `--save-state`, whatever its time. It must fit every scene that is served
    #[arg(long, value_name = "FILE")]
    from_state: Option<PathBuf>,
    /// Begin each craft after the warm-up of its scene on the scene's own orbit, instead of in balance at the client's first place
    #[arg(long, conflicts_with = "from_state")]
    warm_up: bool,
    /// Append a line for every request to a file, or - for standard error
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

/// Names of the protocols.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Protocol {
    /// ZeroMQ and protobuf: Basilisk's vizInterface
    Vizard,
    /// TCP: the client of SurRender 8
    Surrender,
    /// TCP: lines of JSON with temperatures, heat flows and the push of light, without images
    Telemetry,
}

impl Protocol {
    fn port(self) -> u16 {
        match self {
            Self::Vizard => vizard::PORT,
            Self::Surrender => surrender::PORT,
            Self::Telemetry => telemetry::PORT,
        }
    }

    fn talk(self) -> Talk {
        match self {
            Self::Vizard => vizard::talk_vizard,
            Self::Surrender => surrender::talk_surrender,
            Self::Telemetry => telemetry::session::talk_telemetry,
        }
    }
}

fn parse_range(text: &str) -> Result<[f64; 2], String> {
    let numbers =
        text.split_once(',').and_then(|(low, high)| Some([low.trim().parse().ok()?, high.trim().parse().ok()?]));
    match numbers {
        Some([low, high]) if 0.0 <= low && low < high && high <= 1e4 => Ok([low, high]),
        _ => Err("it takes two temperatures in kelvin, the lower first, such as 200,350".to_owned()),
    }
}

/// Name and path of an argument. A path with `=` and no name is written `./a=b.toml`.
fn named(argument: &Path) -> (Option<&str>, &Path) {
    match argument.to_str().and_then(|text| text.split_once('=')) {
        Some((name, path)) if !name.is_empty() && !name.contains(['/', '\\']) => (Some(name), Path::new(path)),
        _ => (None, argument),
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let local = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), arguments.protocol.port());
    let listener = bind(arguments.listen.unwrap_or(local), arguments.allow_remote)?;
    let address = listener.local_addr().map_err(|error| ServerError::Listen(local, error))?;
    let (mut scenes, mut prepared) = (Scenes::default(), Vec::new());
    for argument in &arguments.scenes {
        let (name, path) = named(argument);
        let mut scene = arguments.reach.scene(path)?;
        if arguments.picture == PictureKind::Sensor && scene.sensor.is_none() {
            return Err(ServerError::NoSensor(path.to_path_buf()).into());
        }
        scene.show_planet();
        for assumption in &scene.assumptions {
            say!("assumed: {}: {assumption}", path.display());
        }
        let no_range = arguments.range.is_none() && scene.colour_range.is_none();
        if arguments.protocol == Protocol::Vizard && arguments.picture == PictureKind::Apparent && no_range {
            let [low, high] = DEFAULT_RANGE;
            say!("assumed: {}: black is {low} K and white is {high} K (--range is absent)", path.display());
        }
        if std::mem::take(&mut scene.images.error) {
            say!(
                "warning: {}: no protocol has a place for T_error, so output.error has no effect here",
                path.display()
            );
        }
        if std::mem::take(&mut scene.images.budget) {
            say!(
                "warning: {}: no protocol has a place for a budget, so output.budget has no effect here",
                path.display()
            );
        }
        if scene.uncertainty.take().is_some() {
            say!(
                "warning: {}: no protocol has a place for T_sigma, so [uncertainty] has no effect here",
                path.display()
            );
        }
        let added = scenes.add(name, path, scene)?;
        // A client states its own camera.
        for warning in guard::warnings(&added, CheckEffort::NO_IMAGE) {
            say!("warning: {}: {warning}", path.display());
        }
        prepared.push(added);
    }
    let target = arguments.device.open()?;
    let mut state = None;
    if let Some(path) = &arguments.from_state {
        for prepared in prepared {
            state = Some(Arc::new(thermal_state::read(path, &prepared, &target)?));
            scenes.keep_casts(&prepared);
        }
    }
    let log = Log::open(arguments.log.as_deref())?;
    let picture = PictureStyle { kind: arguments.picture, range: arguments.range };
    let stop = stop_flag();
    say!("device: {}; scenes: {}", target.name(), scenes.known());
    if !address.ip().is_loopback() {
        say!("warning: other machines reach {address}, and the protocol has no authentication");
    }
    answer!("listening on {address}");
    let (time, patience) = (arguments.time, Patience::default());
    let server = Server { target, scenes, picture, time, state, warm_up: arguments.warm_up, patience, log };
    serve(&server, &listener, arguments.protocol.talk(), &stop);
    check_validation(&server.target)
}
