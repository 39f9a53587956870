//! `isotherm view-factors`: the view factors between the surfaces of a scene, and to the planet and space.

use std::path::PathBuf;
use std::time::Instant;

use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::prepare::{guard, prepare_scene};
use super::reach::ReachArguments;
use crate::environment::{PlanetLoad, StepLoad};
use crate::exchange::between::{To, radiative_areas, view_factors};
use crate::exchange::cast::{Scenery, cast_rays};
use crate::exchange::step::Exchange;
use crate::gpu::effects::exchange::RESOURCES;
use crate::gpu::effects::exchange::tables::ExchangeTables;
use crate::guard::finding::CheckEffort;
use crate::output::console::say;
use crate::output::destination::{Destination, destinations};
use crate::output::exchange_pictures::{fish_eye, open_sky};
use crate::output::inputs::keep_inputs;
use crate::simulation::device_data::DeviceData;
use crate::simulation::exchange::{ExchangeCraft, describe};
use crate::simulation::prepare::Prepared;

/// Write the view factors between the parts of a scene.
///
/// [exchange] states the patches and rays. Without it they have its defaults.
///
/// The file has the columns from, to, view_factor and standard_error. Among `to` stand `space`, and `planet` as it is seen at time 0. The rows of a
/// part sum to 1. Rays are cast from every patch in the pose of
/// time 0, by the processor.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  isotherm view-factors models/station.toml -o factors.csv --gr gr.csv")]
pub(crate) struct Arguments {
    /// Scene
    #[arg(value_name = "SCENE.toml")]
    scene: PathBuf,
    /// File of the view factors, or - for standard output
    #[arg(short, long, value_name = "F.csv")]
    output: PathBuf,
    /// Tell patches instead of parts: part, face and number
    #[arg(long)]
    patches: bool,
    /// File of the radiative exchange areas [m2], all reflections counted: columns from, to, gr_m2
    #[arg(long, value_name = "GR.csv")]
    gr: Option<PathBuf>,
    /// Picture of the share of the sky that every surface sees
    #[arg(long, value_name = "SKY.png")]
    sky: Option<PathBuf>,
    /// Fish-eye picture of what a patch sees, see --patch
    #[arg(long, value_name = "SEEN.png", requires = "patch")]
    fish_eye: Option<PathBuf>,
    /// Number of the patch of --fish-eye, as --patches tells it
    #[arg(long, value_name = "N", requires = "fish_eye")]
    patch: Option<usize>,
    #[command(flatten)]
    device: DeviceArguments,
    #[command(flatten)]
    reach: ReachArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let mut scene = arguments.reach.scene(&arguments.scene)?;
    scene.exchange_by_default();
    let mut prepared = prepare_scene(scene)?;
    guard(&mut prepared, CheckEffort::NO_IMAGE);
    let Some(craft) = &prepared.exchange else {
        return Err(CliError::Usage(format!("{}: nothing exchanges heat", arguments.scene.display())));
    };
    let (gr, sky_path, fish_eye_path) = (&arguments.gr, &arguments.sky, &arguments.fish_eye);
    for path in [Some(&arguments.output), gr.as_ref(), sky_path.as_ref(), fish_eye_path.as_ref()].into_iter().flatten()
    {
        keep_inputs(path, &prepared.scene.files)?;
    }
    let patches = craft.patches.all.len();
    if let Some(patch) = arguments.patch.filter(|patch| *patch >= patches) {
        return Err(CliError::Usage(format!("--patch {patch}: the scene has the patches 0 to {}", patches - 1)));
    }
    let paths = [Some(&*arguments.output), gr.as_deref(), sky_path.as_deref(), fish_eye_path.as_deref()];
    let [factors, areas, sky_picture, picture] = destinations(paths)?;
    let load = sky(&prepared);
    let target = arguments.device.open()?;
    let (exchange, seconds) = found(craft, &load);
    tell(craft, &exchange);
    say!(
        "time: {:.2} s for {} rays, {:.2} s for view factors and exchange areas",
        seconds[0],
        patches * craft.settings.rays as usize,
        seconds[1]
    );
    say!("memory of a device in a run: {:.1} MiB", device_bytes(&prepared, &exchange) / 1_048_576.0);
    let (names, group) = groups(&prepared, craft, arguments.patches);
    let name = |to: To| match to {
        To::Group(group) => names[group].clone(),
        To::Planet => "planet".to_owned(),
        To::Space => "space".to_owned(),
    };
    let rows = view_factors(&exchange, &group, &load).into_iter().map(|factor| {
        [names[factor.from].clone(), name(factor.to), format!("{:.6}", factor.factor), format!("{:.6}", factor.error)]
    });
    let header = ["from", "to", "view_factor", "standard_error"].map(str::to_owned);
    factors.unwrap_or(Destination::StandardOutput).write_csv(std::iter::once(header).chain(rows))?;
    if let Some(areas) = areas {
        let rows = radiative_areas(&exchange, &group);
        let rows = rows.into_iter().map(|(from, to, area)| [names[from].clone(), name(to), format!("{area:.6e}")]);
        areas.write_csv(std::iter::once(["from", "to", "gr_m2"].map(str::to_owned)).chain(rows))?;
    }
    if let Some(picture) = sky_picture {
        picture.write_bytes(&open_sky(craft, &load.joints, &exchange)?)?;
    }
    if let (Some(picture), Some(patch)) = (picture, arguments.patch) {
        picture.write_bytes(&fish_eye(craft, &load.joints, patch)?)?;
    }
    check_validation(&target)
}

/// The exchange in the pose of a load, the time of the rays and the time of the rest [s].
fn found(craft: &ExchangeCraft, load: &StepLoad) -> (Exchange, [f64; 2]) {
    let began = Instant::now();
    let (surface, patches, rays) = (&craft.surface, &craft.patches, craft.settings.rays);
    let scenery = Scenery::new(surface, &load.joints);
    let ends = cast_rays(surface, patches, &scenery, rays, 0..patches.all.len() as u32);
    let cast_s = began.elapsed().as_secs_f64();
    let exchange = Exchange::new(surface, patches, &ends, &craft.settings);
    (exchange, [cast_s, began.elapsed().as_secs_f64() - cast_s])
}

/// Buffers of the exchange in a run on a device.
fn device_bytes(prepared: &Prepared, exchange: &Exchange) -> f64 {
    let tables = ExchangeTables::new(exchange, prepared.joints() > 1);
    let data = DeviceData::new(prepared).with_exchange(Some(tables));
    let plan = data.scene_data(prepared, None).plan();
    let of_exchange = plan.iter().filter(|planned| RESOURCES.contains(&planned.resource));
    of_exchange.map(|planned| planned.bytes as f64).sum()
}

/// The planet and the joints at time 0.
fn sky(prepared: &Prepared) -> StepLoad {
    let sky = prepared.loads.sky_model().sky(0.0);
    let planet = PlanetLoad {
        nadir: sky.nadir_direction,
        sunward: sky.nadir_direction.any_orthonormal_vector(),
        distance_ratio: sky.distance_ratio,
        planet_ir: 1.0,
        albedo_flux: 0.0,
        sun_zenith: sky.sun_zenith,
    };
    StepLoad { planet: Some(planet), ..prepared.loads.step_load(0.0, 0.0) }
}

fn groups(prepared: &Prepared, craft: &ExchangeCraft, patches: bool) -> (Vec<String>, Vec<usize>) {
    if !patches {
        let names = prepared.parts.clone();
        return (names, craft.patches.all.iter().map(|patch| patch.part as usize).collect());
    }
    let face = |back: bool| if back { "back" } else { "front" };
    let named = craft.patches.all.iter().enumerate();
    let names =
        named.map(|(number, patch)| format!("{}/{}/{number}", prepared.parts[patch.part as usize], face(patch.back)));
    (names.collect(), (0..craft.patches.all.len()).collect())
}

/// Prints the facts of an exchange, and a warning if rays end on inner faces.
fn tell(craft: &ExchangeCraft, exchange: &Exchange) {
    for (name, value) in describe(craft, exchange) {
        say!("{name}: {value}");
    }
    if exchange.factors.inside_share() > 0.0 {
        say!(
            "warning: rays end on the inner face of a skin, because the mesh is open or parts reach into each other; their light comes back to its own patch"
        );
    }
}
