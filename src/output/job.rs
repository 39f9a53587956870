//! Runs a scene: steps the engine, writes the results to the output folder, and writes the report.

use std::sync::atomic::AtomicBool;
use std::sync::mpsc::sync_channel;
use std::time::Instant;

use rayon::prelude::*;

use super::OutputError;
use super::colour::ColourScale;
use super::exr::{read_exr, write_exr};
use super::folder::{Folder, write_bytes};
use super::frame::{Frame, FrameHeader};
use super::frame_maker::FrameMaker;
use super::joints::JointSeries;
use super::picture::{Tile, contact_sheet, picture};
use super::report::{FrameEntry, Picture, PlotEntry, write_plots};
use super::series::{Series, SeriesRow};
use super::statistics::Groups;
use super::temperature_plots::{Eclipses, temperature_plots};
use crate::gpu::nodes::GROUP;
use crate::simulation::check::{Accuracy, Check};
use crate::simulation::engine::{Engine, EngineError};
use crate::simulation::network::StepCost;
use crate::simulation::periodic::Periodic;
use crate::simulation::prepare::Prepared;
use crate::simulation::{StepResult, run, start};
use crate::trace::Track;

/// Temperatures over time.
pub const SERIES: &str = "series.csv";
/// Positions of joints over time.
pub const JOINTS: &str = "joints.csv";
/// Small pictures of several steps.
const CONTACT_SHEET: &str = "contact_sheet.png";
/// The report as JSON.
pub const REPORT_JSON: &str = "report.json";
/// The report as a page.
pub const REPORT_HTML: &str = "report.html";
/// All files of a run.
pub const FILES: [&str; 8] =
    ["frames/step_*.exr", "frames/step_*.png", "plots/*.svg", SERIES, JOINTS, CONTACT_SHEET, REPORT_JSON, REPORT_HTML];

/// Most pictures on the contact sheet.
const MOST_TILES: usize = 12;
/// Width of a picture on the contact sheet [px].
const TILE_WIDTH: u32 = 320;
/// Most frames that wait for the writer.
const WAITING_FRAMES: usize = 2;

/// An error that ends a run early.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// The engine.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The output folder.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A temperature is not finite.
    #[error("step {step}: the temperature of part {part}, material {material} is not finite; please report the scene")]
    NotFinite {
        /// The first step where this happens.
        step: u32,
        /// Part of the first such node.
        part: String,
        /// Material of that node.
        material: String,
    },
}

/// A unit of progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Done {
    /// A warm-up step.
    WarmUp,
    /// A step.
    Step,
    /// A finished picture.
    Picture,
}

/// The results of a run.
pub struct Outcome {
    /// Whether all steps were done.
    pub complete: bool,
    /// Drawn frames.
    pub frames: Vec<FrameEntry>,
    /// Pictures for the report.
    pub pictures: Vec<Picture>,
    /// Plots for the report.
    pub plots: Vec<PlotEntry>,
    /// Error of the device against the f64 reference, if requested.
    pub accuracy: Option<Accuracy>,
    /// Convergence of a periodic warm-up, if requested.
    pub periodic: Option<Periodic>,
    /// Cost of the network in every step after the warm-up.
    pub network_costs: Vec<StepCost>,
    /// Wall time of the steps without start-up and pictures [s].
    pub stepping_s: f64,
}

/// Runs the scene and writes its files. `check` is the number of nodes that the f64 reference also steps.
pub fn run_into(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    folder: &Folder,
    check: Option<usize>,
    stop: &AtomicBool,
    progress: &(dyn Fn(Done) + Sync),
) -> Result<Outcome, JobError> {
    let trace = engine.trace();
    let mut check = check.map(|sample| Check::new(prepared, sample));
    let warms_up = trace.span(Track::Host, "settle and warm up");
    let periodic = start(prepared, engine, check.as_mut(), stop, &mut || progress(Done::WarmUp))?;
    drop(warms_up);

    let maker = prepared.scene.camera.as_ref().map(|camera| FrameMaker::new(prepared, camera, &engine.device_name()));
    let groups = NodeGroups::new(prepared)?;
    let names: Vec<String> = prepared.materials.iter().map(|material| material.name.clone()).collect();
    let probes: Vec<String> = prepared.scene.probes.iter().map(|probe| probe.name.clone()).collect();
    let mut series = Series::new(&prepared.parts, &names, &probes);

    let warm_up_steps = engine.network_costs().len();
    let began = Instant::now();
    let (complete, written) = std::thread::scope(|scope| {
        // A thread writes files while the next steps are computed.
        let (frames, waiting) = sync_channel::<(Frame, FrameHeader)>(WAITING_FRAMES);
        let files = trace.clone();
        let writer = scope.spawn(move || {
            let mut written = Vec::new();
            for (frame, header) in waiting {
                let _writes = files.span(Track::Writer, "write EXR");
                let file = format!("frames/step_{:06}.exr", frame.step);
                write_exr(&folder.file(&file), &frame, &header)?;
                let range = frame.range();
                written.push(WrittenFrame { step: frame.step, time: frame.time, file, range });
            }
            Ok::<_, OutputError>(written)
        });
        let mut consume = |mut result: StepResult| -> Result<(), JobError> {
            let _consumes = trace.span(Track::Host, "series and frame");
            if let Some(temperatures) = result.delivered.temperatures.take() {
                check_finite(prepared, result.step, &temperatures)?;
                series.push(groups.row(result.time, &temperatures, &prepared.probes)?)?;
            }
            if let Some(frame) = maker.as_ref().and_then(|maker| maker.frame(result)) {
                // The send fails if the writer failed. Its error is reported below.
                let _ = frames.send(frame);
            }
            progress(Done::Step);
            Ok(())
        };
        let complete = run(prepared, engine, check.as_mut(), stop, &mut consume);
        drop(frames);
        let written = writer.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        Ok::<_, JobError>((complete?, written))
    })?;
    let stepping_s = began.elapsed().as_secs_f64();

    let draws = trace.span(Track::Host, "series, pictures and plots");
    series.write(&folder.file(SERIES))?;
    let scale = match prepared.scene.colour_range {
        Some(range) => ColourScale::new(range),
        None => ColourScale::covering(written.iter().filter_map(|frame| frame.range)),
    };
    let (frames, pictures) = draw_pictures(prepared, folder, &written, &scale, progress)?;
    let joints = prepared.loads.joints().joints();
    let mut positions = JointSeries::new(joints.iter().map(|joint| (joint.name.clone(), joint.turns())));
    if !positions.is_empty() {
        for row in series.rows() {
            positions.push(row.time, &prepared.loads.joints_at(row.time).0);
        }
        positions.write(&folder.file(JOINTS))?;
    }
    let eclipses = eclipses(prepared);
    let mut plots = temperature_plots(&series, &eclipses)?;
    plots.extend(positions.plots(&eclipses)?);
    write_plots(folder, &plots)?;
    drop(draws);
    let accuracy = check.map(|check| check.accuracy(prepared));
    let network_costs = engine.network_costs()[warm_up_steps..].to_vec();
    Ok(Outcome { complete, frames, pictures, plots, accuracy, periodic, network_costs, stepping_s })
}

/// Refuses temperatures that are not finite. The error names the first such node.
pub(crate) fn check_finite(prepared: &Prepared, step: u32, temperatures: &[f32]) -> Result<(), JobError> {
    let nodes = &prepared.nodes;
    let broken = nodes.node_of_vertex.par_iter().find_first(|node| !temperatures[**node as usize].is_finite());
    match broken {
        None => Ok(()),
        Some(node) => {
            let group = *node as usize / GROUP;
            Err(JobError::NotFinite {
                step,
                part: prepared.parts[nodes.group_part[group] as usize].clone(),
                material: prepared.materials[nodes.group_material[group] as usize].name.clone(),
            })
        }
    }
}

struct WrittenFrame {
    step: u32,
    time: f64,
    file: String,
    range: Option<[f32; 2]>,
}

/// Nodes grouped by part, by material and all together, for the series.
pub(crate) struct NodeGroups {
    parts: Groups,
    materials: Groups,
    all: Groups,
    /// Device index of each vertex. Padding nodes have no vertex, so they do not affect minima.
    node_of_vertex: Vec<u32>,
}

impl NodeGroups {
    pub(crate) fn new(prepared: &Prepared) -> Result<Self, OutputError> {
        let nodes = &prepared.nodes;
        let node_of_vertex = nodes.node_of_vertex.clone();
        let areas: Vec<f64> = node_of_vertex.iter().map(|node| nodes.areas[*node as usize]).collect();
        let of =
            |groups: &[u32]| node_of_vertex.iter().map(|node| groups[*node as usize / GROUP]).collect::<Vec<u32>>();
        Ok(Self {
            parts: Groups::new(areas.clone(), of(&nodes.group_part), prepared.parts.len())?,
            materials: Groups::new(areas.clone(), of(&nodes.group_material), prepared.materials.len())?,
            all: Groups::all(areas),
            node_of_vertex,
        })
    }

    /// The series row of a step. `device` has the temperatures in device order [K], `probes` the nodes of the probes.
    pub(crate) fn row(&self, time: f64, device: &[f32], probes: &[usize]) -> Result<SeriesRow, OutputError> {
        let temperatures: Vec<f32> = self.node_of_vertex.par_iter().map(|node| device[*node as usize]).collect();
        Ok(SeriesRow {
            time,
            all: self.all.summaries(&temperatures)?.pop().flatten(),
            parts: self.parts.summaries(&temperatures)?,
            materials: self.materials.summaries(&temperatures)?,
            probes: probes.iter().map(|node| device[*node]).collect(),
        })
    }
}

/// Draws a PNG for each frame on one scale, and the contact sheet.
fn draw_pictures(
    prepared: &Prepared,
    folder: &Folder,
    written: &[WrittenFrame],
    scale: &ColourScale,
    progress: &(dyn Fn(Done) + Sync),
) -> Result<(Vec<FrameEntry>, Vec<Picture>), OutputError> {
    let name = &prepared.scene.name;
    let band = &prepared.scene.band;
    let band = format!("{:.4} to {:.4} um", band.lower * 1e6, band.upper * 1e6);
    let chosen = |index: usize| {
        let tiles = written.len().min(MOST_TILES);
        (0..tiles).any(|tile| tile * written.len() / tiles == index)
    };
    let drawn: Vec<(FrameEntry, Option<Tile>)> = written
        .par_iter()
        .enumerate()
        .map(|(index, one)| {
            let (frame, _) = read_exr(&folder.file(&one.file))?;
            let details = format!("step {}, t = {:.1} s, band {band}", one.step, one.time);
            let file = format!("frames/step_{:06}.png", one.step);
            write_bytes(&folder.file(&file), &picture(&frame, scale, name, &details)?.png()?)?;
            let caption = format!("t = {:.0} s", one.time);
            let tile = chosen(index).then(|| Tile::new(&frame, scale, &caption, TILE_WIDTH)).transpose()?;
            progress(Done::Picture);
            let entry = FrameEntry { step: one.step, time_s: one.time, file: one.file.clone(), picture: Some(file) };
            Ok((entry, tile))
        })
        .collect::<Result<_, OutputError>>()?;
    let (frames, tiles): (Vec<FrameEntry>, Vec<Option<Tile>>) = drawn.into_iter().unzip();
    let tiles: Vec<Tile> = tiles.into_iter().flatten().collect();
    if tiles.is_empty() {
        return Ok((frames, Vec::new()));
    }
    let details = format!("{} of {} images", tiles.len(), written.len());
    let png = contact_sheet(&tiles, 4, scale, name, &details).png()?;
    write_bytes(&folder.file(CONTACT_SHEET), &png)?;
    let title = "Surface temperature through the run".to_owned();
    let sheet = Picture { title, file: CONTACT_SHEET.to_owned(), png };
    Ok((frames, vec![sheet]))
}

/// Umbra and penumbra intervals, clipped to the run.
pub(crate) fn eclipses(prepared: &Prepared) -> Eclipses {
    let time = &prepared.scene.time;
    let end = f64::from(time.steps) * time.step;
    let sky = prepared.loads.sky_model();
    let mut borders = vec![0.0];
    borders.extend(sky.contacts(0.0, end));
    borders.push(end);
    let mut eclipses = Eclipses::default();
    if prepared.scene.environment.solar_constant.is_none() {
        return eclipses;
    }
    for pair in borders.windows(2) {
        let lit = sky.lit_fraction(0.5 * (pair[0] + pair[1]));
        if lit <= 0.0 {
            eclipses.umbra.push((pair[0], pair[1]));
        } else if lit < 1.0 {
            eclipses.penumbra.push((pair[0], pair[1]));
        }
    }
    eclipses
}
