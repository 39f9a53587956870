//! `isotherm paper`: reproduces the figures of the paper and compares its numbers.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use super::arguments::FolderArguments;
use super::device::{DeviceArguments, check_validation};
use super::digits::nine_digits;
use super::error::CliError;
use super::paper_orbits;
use super::prepare::{guard, prepare_with_progress};
use super::progress::{progress_bar, stop_flag};
use super::reach::ReachArguments;
use super::time::parse_time;
use crate::gpu::error::GpuError;
use crate::guard::finding::CheckEffort;
use crate::output::OutputError;
use crate::output::colour::ColourScale;
use crate::output::console::{answer, say};
use crate::output::finite::finite;
use crate::output::folder::Folder;
use crate::output::frame_maker::FrameMaker;
use crate::output::picture::beside;
use crate::paper::files::{CHECKS, FIGURE_7, INDEX, own_files, plot_name, series_name};
use crate::paper::orbit_figures;
use crate::paper::page::PaperPage;
use crate::paper::visible::{CraftMesh, draw};
use crate::paper::{checks, scenario, transitions};
use crate::simulation;
use crate::simulation::prepare::Prepared;
use crate::simulation::prepare_error::PrepareError;
use crate::simulation::target::Target;
use crate::simulation::viewpoint::raster_view;

/// Scene of figure 7 and its model.
const STATION: [(&str, &[u8]); 2] = [
    ("station_transition.toml", include_bytes!("../../models/station_transition.toml")),
    ("station.glb", include_bytes!("../../models/station.glb")),
];

/// Reproduce figures 2 to 7 of the paper, and compare its numbers with the results of isotherm.
///
/// The paper is Vural, Martin, Dunstan and Sanchez-Gestido, "Real-time rasterization simulation of TIR images", 2023.
/// Figures 2 to 4 show its cube in orbit, solved as a thermal network: SVG, with a CSV (step and a column for each
/// line) for each panel. Figures 5 and 6 show ten transitions: SVG, with a CSV (step,temperature) for each. Figure 7
/// shows a station in visible light and in false-colour temperature: PNG. The command also writes checks.csv
/// (statement,expected,computed,difference,agrees) and index.html, which needs no internet.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm paper -o out/paper\n  \
isotherm paper -o out/paper --force --device cpu\n  \
isotherm paper -o out/paper --scene models/station_transition.toml --time 1200")]
pub(crate) struct Arguments {
    #[command(flatten)]
    folder: FolderArguments,
    /// Scene for figure 7 [default: the station of models/station_transition.toml, which the program carries]
    #[arg(long, value_name = "SCENE.toml")]
    scene: Option<PathBuf>,
    /// Time of figure 7 since the start of the scene [s]
    #[arg(long, value_name = "SECONDS", default_value = "5000", value_parser = parse_time, allow_negative_numbers = true)]
    time: f64,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let mut prepared = match &arguments.scene {
        Some(scene) => prepare_with_progress(scene, arguments.reach)?,
        None => station(arguments.reach)?,
    };
    prepared.scene.require_camera().map_err(PrepareError::from)?;
    prepared.cover(arguments.time)?;
    guard(&mut prepared, CheckEffort { at: Some(arguments.time), ..CheckEffort::BRIEF });
    let chosen = arguments.device.open()?;
    let device = chosen.name();
    say!("device: {device}");
    let folder =
        Folder::new(&arguments.folder.output, &own_files()).prepare(arguments.folder.force, &prepared.scene.files)?;

    let (orbits, work) = paper_orbits::compute(&arguments.folder.output)?;
    let statements = scenario::checks(&orbits);
    let mut assumed = orbits.assumed();
    assumed.push(work);
    for line in &assumed {
        say!("{line}");
    }
    let mut plots = Vec::new();
    for figure in orbit_figures::figures(&orbits, &Target::Reference.name())? {
        for table in &figure.tables {
            folder.write_checked_csv(table.file, rows(&table.columns, table.rows.iter().map(Vec::as_slice)))?;
        }
        folder.write_bytes(&plot_name(figure.number), figure.svg.as_bytes())?;
        plots.push((figure.number, figure.svg));
    }

    let computed = transitions::compute(|transition, initial, targets| {
        let after = chosen.respond(transition, initial, targets)?;
        Ok::<_, GpuError>(std::iter::once(initial).chain(after).collect())
    })?;
    let mut values = Vec::new();
    for one in &computed {
        let temperatures = one.quadratic.iter().map(std::slice::from_ref);
        folder.write_checked_csv(&series_name(&one.jump), rows(&["temperature".to_owned()], temperatures))?;
        values.extend(one.checks());
    }
    for figure in [5, 6] {
        let svg = transitions::figure(figure, &computed, &device)?;
        folder.write_bytes(&plot_name(figure), svg.as_bytes())?;
        plots.push((figure, svg));
    }
    let Some((png, caption)) = figure_7(&chosen, &prepared, arguments.time)? else {
        return Err(CliError::Stopped(arguments.folder.output.clone()));
    };
    folder.write_bytes(FIGURE_7, &png)?;
    let all: Vec<checks::PaperCheck> = values.iter().chain(&statements).cloned().collect();
    checks::write(&folder, CHECKS, &all)?;
    let page = PaperPage {
        device: &device,
        plots: &plots,
        picture: (&png, &caption),
        transitions: &values,
        scenario: &statements,
        assumed: &assumed,
    };
    folder.write_bytes(INDEX, page.html().as_bytes())?;

    for (what, checks) in [("figures 5 and 6", &values), ("the scenario", &statements)] {
        let agree = checks.iter().filter(|check| check.agrees()).count();
        answer!("{what}: {agree} of {} numbers agree", checks.len());
    }
    answer!("page: {}", folder.file(INDEX).display());
    check_validation(&chosen)
}

/// The station that the program carries. A scene is read from files, so it becomes files for as long as it takes to prepare it.
fn station(reach: ReachArguments) -> Result<Prepared, CliError> {
    let failed =
        |error| CliError::Usage(format!("the station's files cannot be written to the temporary folder: {error}"));
    let folder = tempfile::tempdir().map_err(failed)?;
    for (name, bytes) in STATION {
        std::fs::write(folder.path().join(name), bytes).map_err(failed)?;
    }
    prepare_with_progress(&folder.path().join(STATION[0].0), reach)
}

/// The rows of a table: the step and its temperatures, which must be finite.
fn rows<'a>(
    columns: &'a [String],
    temperatures: impl Iterator<Item = &'a [f64]> + 'a,
) -> impl Iterator<Item = Result<Vec<String>, OutputError>> + 'a {
    let head = std::iter::once("step".to_owned()).chain(columns.iter().cloned()).collect();
    let row = move |(step, row): (usize, &'a [f64])| {
        let cell = |(value, column): (&f64, &String)| {
            Ok(nine_digits(finite(*value, || format!("step {step}: the column '{column}'"))?))
        };
        std::iter::once(Ok(step.to_string())).chain(row.iter().zip(columns).map(cell)).collect()
    };
    std::iter::once(Ok(head)).chain(temperatures.enumerate().map(row))
}

/// The PNG of figure 7 and its caption. `None` after Ctrl-C.
fn figure_7(chosen: &Target, prepared: &Prepared, time: f64) -> Result<Option<(Vec<u8>, String)>, CliError> {
    let camera = prepared.scene.require_camera().map_err(PrepareError::from)?;
    let mut engine = chosen.engine(prepared, Some(camera))?;
    let stop = stop_flag();
    let steps = u64::from(prepared.warm_up_steps()) + (time / prepared.scene.time.step) as u64;
    let bar = progress_bar(steps, "figure 7");
    simulation::start(prepared, &mut *engine, None, &stop, &mut || bar.inc(1))?;
    let still = simulation::still(prepared, &mut *engine, time, &stop, &mut || bar.inc(1))?;
    bar.finish_and_clear();
    let Some(result) = still.filter(|_| !stop.load(Ordering::Relaxed)) else { return Ok(None) };
    let Some(pose) = result.pose else { return Ok(None) };
    let maker = FrameMaker::new(prepared, &engine.device_name());
    let Some((frame, _)) = maker.frame(result)? else { return Ok(None) };

    let sky = prepared.loads.sky_model().sky(time);
    let sunlight = if prepared.scene.environment.solar_constant.is_some() { sky.lit_fraction } else { 0.0 };
    let nodes = prepared.nodes_at(time);
    let craft = CraftMesh { nodes: &nodes, triangles: &prepared.triangles, materials: &prepared.materials };
    let visible = draw(&craft, &raster_view(camera, &pose), sky.sun_direction, sunlight);
    let scale = prepared.scene.colour_range.map_or_else(|| ColourScale::covering(frame.range()), ColourScale::new);
    let title = format!("Figure 7: {} in visible light and in temperature", prepared.scene.name);
    let details = format!("t = {time} s, on {}", engine.device_name());
    let shading = match sunlight {
        1.0 => "visible: Lambert, the Sun and 5 % from everywhere; grey = 1 - solar absorptivity; no cast shadows",
        0.0 => "visible: there is no sunlight at this time, only 5 % of it from everywhere",
        _ => "visible: Lambert, the Sun partly hidden by the planet and 5 % from everywhere; no cast shadows",
    };
    let png = beside((&visible, shading), (&frame, "false-colour temperature"), &scale, &title, &details)?.png()?;
    let caption = format!("{title}; {shading}");
    Ok(Some((png, caption)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_holds_finite_numbers_only() {
        let columns = ["mean".to_owned(), "facing the Sun".to_owned()];
        let table = |last: f64| {
            let values = [[300.0, 310.0], [301.0, last]];
            rows(&columns, values.iter().map(<[f64; 2]>::as_slice)).collect::<Result<Vec<_>, _>>()
        };
        assert_eq!(table(311.0).unwrap().len(), 3);
        let error = table(f64::NAN).unwrap_err().to_string();
        assert!(error.contains("step 1: the column 'facing the Sun' is NaN"), "{error}");
    }
}
