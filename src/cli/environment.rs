//! `isotherm environment`: Sun and planet loads along a trajectory or on one plate.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::environment_plate;
use super::error::CliError;
use super::progress::progress_bar;
use super::reach::ReachArguments;
use crate::environment::Orbit;
use crate::environment::Sky;
use crate::environment::albedo::albedo_factor;
use crate::environment::sky::{Boundary, EclipseEvent, SkyModel};
use crate::environment::view_factor::{ApparentRadius, plate_view_factor};
use crate::output::OutputError;
use crate::output::console::{answer, say};
use crate::output::destination::{Destination, destinations, has_neighbours};
use crate::output::finite::finite;
use crate::output::inputs::keep_inputs;
use crate::scene::{AXES, SkyScene};

const EXAMPLES: &str = "\
Examples:
  isotherm environment models/iss_orbit.toml -o env.csv
  isotherm environment plate --altitude 408e3 --nadir-angle 90 --sun-zenith 60 --json

A scene needs [time], [orbit], [attitude] and [environment] only
(docs/scene.md). env.csv has a row for each step, 0 included, of the instant.
Vectors are unit vectors in the body frame, fluxes those that fall on the six
faces of a cube (+X -X +Y -Y +Z -Z), whatever they absorb:
  time_s, utc             since time 0; UTC is empty for a circular orbit
  x_m, y_m, z_m           craft from the planet's centre, inertial frame (GCRF)
  sun_x .., planet_x ..   directions to the Sun and to the planet's centre
  sun_distance_m          from the craft
  lit_fraction            share of the Sun's disc that the planet leaves visible
  solar_flux_w_m2         sunlight at this distance, eclipse left aside
  solar_+X_w_m2 ..        sunlight on each face, times the lit fraction
  planet_ir_+X_w_m2 ..    planet infrared on each face
  albedo_+X_w_m2 ..       reflected sunlight on each face, by the exact integral
What the scene's [environment] leaves out is 0. env.events.csv beside it has
time_s, utc, boundary (penumbra, umbra) and event (entry, exit). If env.csv is
no regular file, the eclipses are messages on standard error.";

/// Write Sun, planet and eclipses along a scene's trajectory, or the planet loads on one plate.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true, after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Scene file (TOML, described in docs/scene.md)
    #[arg(required = true)]
    scene: Option<PathBuf>,
    /// CSV to write, or - for standard output; env.csv also gets its eclipses in env.events.csv
    #[arg(short, long, value_name = "CSV", required = true)]
    output: Option<PathBuf>,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(subcommand)]
    command: Option<EnvironmentCommand>,
}

#[derive(clap::Subcommand)]
enum EnvironmentCommand {
    Plate(environment_plate::Arguments),
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    match arguments {
        Arguments { command: Some(EnvironmentCommand::Plate(arguments)), .. } => environment_plate::run(arguments),
        Arguments { scene: Some(scene), output: Some(output), .. } => scene_environment(scene, output, arguments.reach),
        _ => Err(CliError::Usage("state a scene file and -o env.csv, or plate".to_owned())),
    }
}

fn scene_environment(path: &Path, output: &Path, reach: ReachArguments) -> Result<(), CliError> {
    let scene = SkyScene::load(path, &reach.of(path)).map_err(|error| CliError::Usage(error.to_string()))?;
    for assumption in &scene.assumptions {
        say!("assumed: {assumption}");
    }
    let wrong = |error| CliError::Usage(format!("{}: {error}", path.display()));
    let sky = SkyModel::new(&scene.orbit, &scene.attitude, &scene.environment).map_err(wrong)?;
    let end = f64::from(scene.time.steps) * scene.time.step;
    sky.check(0.0, end).map_err(wrong)?;
    let events_path = has_neighbours(output)?.then(|| beside(output));
    let outputs = [Some(output), events_path.as_deref()];
    for output in outputs.into_iter().flatten() {
        keep_inputs(output, &scene.files)?;
    }
    let [series, contacts] = destinations(outputs)?;
    let series = series.unwrap_or(Destination::StandardOutput);
    let times = (0..=scene.time.steps).map(|step| f64::from(step) * scene.time.step);
    let bar = progress_bar(u64::from(scene.time.steps) + 1, "steps");
    let rows = times.map(|time| {
        bar.inc(1);
        row(&scene, &sky, time)
    });
    series.write_checked_csv(std::iter::once(Ok(header())).chain(rows))?;
    bar.finish_and_clear();
    let events = sky.events(0.0, end);
    let event = |EclipseEvent { time, boundary, entry }: &EclipseEvent| {
        let boundary = match boundary {
            Boundary::Penumbra => "penumbra",
            Boundary::Umbra => "umbra",
        };
        let event = if *entry { "entry" } else { "exit" };
        [format!("{time:.4}"), utc(&scene.orbit, *time), boundary.to_owned(), event.to_owned()]
    };
    let head = ["time_s", "utc", "boundary", "event"].map(str::to_owned);
    match &contacts {
        Some(contacts) => contacts.write_csv(std::iter::once(head).chain(events.iter().map(event)))?,
        None => events.iter().map(event).for_each(|event| say!("eclipse: {}", event.join(", "))),
    }
    let place = |path: Option<&Path>| path.map_or_else(|| "the messages".to_owned(), |path| path.display().to_string());
    answer!(
        "{} steps in {}, {} contacts of eclipses in {}",
        scene.time.steps,
        if series == Destination::StandardOutput { "standard output".to_owned() } else { place(Some(output)) },
        events.len(),
        place(events_path.as_deref())
    );
    Ok(())
}

/// `env.events.csv` for `env.csv`.
fn beside(output: &Path) -> PathBuf {
    let stem = output.file_stem().unwrap_or(output.as_os_str()).to_string_lossy().into_owned();
    output.with_file_name(format!("{stem}.events.csv"))
}

fn utc(orbit: &Orbit, time: f64) -> String {
    orbit.trajectory().map_or(String::new(), |trajectory| trajectory.utc(time))
}

fn header() -> Vec<String> {
    let plain = "time_s,utc,x_m,y_m,z_m,sun_x,sun_y,sun_z,planet_x,planet_y,planet_z,sun_distance_m,lit_fraction,solar_flux_w_m2";
    let of_faces = |what: &'static str| AXES.iter().map(move |(face, _)| format!("{what}_{face}_w_m2"));
    let faces = ["solar", "planet_ir", "albedo"].into_iter().flat_map(of_faces);
    plain.split(',').map(str::to_owned).chain(faces).collect()
}

fn row(scene: &SkyScene, sky: &SkyModel, time: f64) -> Result<Vec<String>, OutputError> {
    let now = sky.sky(time);
    let (position, sun) = sky.point(time).map_or((DVec3::NAN, DVec3::NAN), |place| (place.position, place.sun));
    let environment = &scene.environment;
    let solar = environment.solar_constant.unwrap_or(0.0) * now.solar_scale;
    let radius = ApparentRadius::new(now.distance_ratio);
    let faces = AXES.map(|(_, normal)| {
        let direct = solar * now.lit_fraction * normal.dot(now.sun_direction).max(0.0);
        let view = plate_view_factor(normal.dot(now.nadir_direction), radius);
        let albedo = environment.albedo.map_or(0.0, |albedo| albedo * solar * factor(&now, normal));
        [direct, environment.planet_ir.unwrap_or(0.0) * view, albedo]
    });
    let vectors = [position, now.sun_direction, now.nadir_direction].into_iter().flat_map(|vector| vector.to_array());
    let scalars = [(sun - position).length(), now.lit_fraction, solar];
    for value in vectors.chain(scalars).chain(faces.into_iter().flatten()) {
        finite(value, || format!("a number at time {time} s"))?;
    }
    let mut cells = vec![shortest(time), utc(&scene.orbit, time)];
    cells.extend(position.to_array().map(|value| format!("{value:.4}")));
    cells.extend(now.sun_direction.to_array().map(|value| format!("{value:.10}")));
    cells.extend(now.nadir_direction.to_array().map(|value| format!("{value:.10}")));
    cells.push(format!("{:.1}", (sun - position).length()));
    cells.push(format!("{:.8}", now.lit_fraction));
    cells.push(format!("{solar:.6}"));
    for which in 0..3 {
        cells.extend(faces.iter().map(|fluxes| format!("{:.6}", fluxes[which])));
    }
    Ok(cells)
}

/// A time without rounding digits.
fn shortest(time: f64) -> String {
    ((time * 1e9).round() / 1e9).to_string()
}

/// Albedo load on a face, as a share of albedo x solar flux. `normal` is in the body frame.
fn factor(sky: &Sky, normal: DVec3) -> f64 {
    let nadir = sky.nadir_direction;
    let sunward = sky.sun_direction - nadir * nadir.dot(sky.sun_direction);
    let x_axis = sunward.try_normalize().unwrap_or_else(|| nadir.any_orthonormal_vector());
    let direction = DVec3::new(normal.dot(x_axis), normal.dot(nadir.cross(x_axis)), normal.dot(nadir));
    albedo_factor(direction.normalize(), sky.distance_ratio, sky.sun_zenith)
}
