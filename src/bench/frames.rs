//! Measures whole steps of a scene with images, pass by pass, at several node densities, with and without shadows.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;

use crate::gpu::context::Context;
use crate::output::statistics::Percentiles;
use crate::scene::{Camera, Scene};
use crate::simulation::device_data::DeviceData;
use crate::simulation::device_engine::DeviceEngine;
use crate::simulation::engine::{Engine, EngineError, EngineStep, Order};
use crate::simulation::pose_at;
use crate::simulation::prepare::Prepared;
use crate::simulation::surroundings::surroundings_at;

/// Longest triangle edges [m].
pub(crate) const EDGES: [f64; 4] = [2.0, 1.0, 0.5, 0.25];
/// Size of the images [px].
pub(crate) const IMAGE: [u32; 2] = [640, 512];
/// Target length of a step [s], as in a loop at 10 Hz.
const STEP_S: f64 = 0.1;
/// Temperature at which networks start [K].
const UNIFORM: f64 = 290.0;
/// Unmeasured steps that compile the passes.
const WARM_UP: u32 = 3;

/// Measurements of a scene at one density.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FrameRow {
    pub(crate) scene: String,
    /// Longest triangle edge [m].
    pub(crate) longest_edge_m: f64,
    pub(crate) shadows: bool,
    pub(crate) nodes: usize,
    pub(crate) triangles: usize,
    /// Device memory that grows with the nodes [bytes per node].
    pub(crate) bytes_a_node: f64,
    /// Time from the loaded scene to a ready device [s].
    pub(crate) start_up_s: f64,
    /// Length of a step [s].
    pub(crate) step_s: f64,
    /// Number of measured steps.
    pub(crate) steps: u32,
    /// Time of each pass in the steps that include it.
    pub(crate) passes: Vec<PassSpread>,
    /// Time of a step with its image on the host [ms].
    pub(crate) whole_step_ms: Option<Percentiles>,
    /// The longest step with an image [ms].
    pub(crate) worst_step_ms: Option<f64>,
    /// Time of a step without an image [ms].
    pub(crate) step_ms: Option<Percentiles>,
    /// The reason if there are no times.
    pub(crate) failed: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct PassSpread {
    /// Name of the pass without its variant.
    pub(crate) name: String,
    /// Time in a step [ms]. Only steps that include the pass count.
    pub(crate) ms: Percentiles,
}

/// The amount of measurement.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrameEffort {
    /// Number of steps with an image.
    pub(crate) steps: u32,
    /// Most nodes. Larger densities are left out.
    pub(crate) most_nodes: usize,
}

/// Measures the scene at one longest edge [m]. The row states the reason if that fails.
pub(crate) fn measure(
    context: &Arc<Context>,
    scene: &Scene,
    edge: f64,
    shadows: bool,
    effort: FrameEffort,
) -> FrameRow {
    let row = FrameRow { failed: None, ..left_out(scene, edge, shadows, "") };
    match measured(context, scene, row.clone(), effort) {
        Ok(row) => row,
        Err(reason) => FrameRow { failed: Some(reason), ..row },
    }
}

pub(crate) fn left_out(scene: &Scene, edge: f64, shadows: bool, reason: &str) -> FrameRow {
    FrameRow {
        scene: scene.name.clone(),
        longest_edge_m: edge,
        shadows,
        failed: Some(reason.to_owned()),
        ..FrameRow::default()
    }
}

/// The scene with the longest edge, shadows and image size of a row.
fn changed(scene: &Scene, row: &FrameRow) -> Scene {
    let mut scene = scene.clone();
    // The tables of the sensor have the size of the scene's own image.
    scene.sensor = None;
    scene.density.model.max = Some(row.longest_edge_m);
    scene.shadows = row.shadows.then(|| scene.shadows.unwrap_or_default());
    if let Some(camera) = &mut scene.camera {
        resize(camera, IMAGE);
    }
    scene
}

/// Changes the image size [px], keeps the horizontal field of view, and takes one sample of a pixel, as all measurements do.
pub(super) fn resize(camera: &mut Camera, [width, height]: [u32; 2]) {
    let scale = f64::from(width) / f64::from(camera.width);
    camera.lens.focal = camera.lens.focal.map(|focal| focal * scale);
    (camera.width, camera.height) = (width, height);
    camera.lens.centre = [f64::from(width) / 2.0, f64::from(height) / 2.0];
    camera.samples = 1;
}

fn measured(context: &Arc<Context>, scene: &Scene, row: FrameRow, effort: FrameEffort) -> Result<FrameRow, String> {
    let scene = changed(scene, &row);
    let began = Instant::now();
    let prepared = Prepared::from_scene(scene, &mut |_| {}).map_err(|error| error.to_string())?;
    let nodes = prepared.nodes.count;
    if nodes > effort.most_nodes {
        return Err(format!("{nodes} nodes: left out above {}", effort.most_nodes));
    }
    let camera = prepared.scene.require_camera().map_err(|error| error.to_string())?.clone();
    let mut engine = DeviceEngine::new(context, &prepared, Some(&camera)).map_err(|error| error.to_string())?;
    let step = prepared.scene.time.step;
    // A power of two times a step needs no rounding in clocks.
    let share = 0.5f64.powi((step / STEP_S).log2().round() as i32);
    let length = share * step;
    match prepared.network {
        // The steady state of a million nodes takes minutes, and times of steps do not depend on it.
        Some(_) => engine.settle_at(UNIFORM, prepared.nodes.vertex_of_node.len()),
        None => engine.settle(&prepared.loads.step_load(0.0, length), 0.0),
    }
    .map_err(|error| error.to_string())?;
    let start_up = began.elapsed().as_secs_f64();

    let mut run = FrameRun { prepared: &prepared, engine: &mut engine, share, next: 0, samples_taken: BTreeMap::new() };
    let drawn = run.steps(effort.steps, true).map_err(|error| error.to_string())?;
    let undrawn = run.steps(effort.steps, false).map_err(|error| error.to_string())?;

    let device = DeviceData::new(&prepared);
    let plan = device.scene_data(&prepared, Some(&camera)).plan();
    let grows: u64 =
        plan.iter().filter(|planned| planned.resource.grows_with_nodes()).map(|planned| planned.bytes).sum();
    Ok(FrameRow {
        nodes,
        triangles: prepared.triangles.len(),
        bytes_a_node: grows as f64 / nodes.max(1) as f64,
        start_up_s: start_up,
        step_s: length,
        steps: effort.steps,
        passes: drawn.passes(),
        whole_step_ms: Percentiles::of(&drawn.wall),
        worst_step_ms: drawn.wall.iter().copied().reduce(f64::max),
        step_ms: Percentiles::of(&undrawn.wall),
        ..row
    })
}

/// The state of the stepping.
struct FrameRun<'a> {
    prepared: &'a Prepared,
    engine: &'a mut dyn Engine,
    /// Length of a measured step as a share of the scene's step.
    share: f64,
    /// Number of the next step.
    next: u32,
    /// Number of times of each pass already counted.
    samples_taken: BTreeMap<String, usize>,
}

/// The measured times of steps.
#[derive(Default)]
struct Times {
    /// Time between deliveries [ms].
    wall: Vec<f64>,
    /// Device time of each pass in the steps that include it [ms].
    passes: BTreeMap<String, Vec<f64>>,
}

impl FrameRun<'_> {
    /// Does steps and, if wanted, images. The host prepares a step while the device computes the previous one.
    fn steps(&mut self, count: u32, draw: bool) -> Result<Times, EngineError> {
        let length = self.share * self.prepared.scene.time.step;
        let mut times = Times::default();
        let mut last = Instant::now();
        for number in 0..=count + WARM_UP {
            if number < count + WARM_UP {
                let start = f64::from(self.next) * length;
                let load = self.prepared.loads.step_load(start, start + length);
                let pose = if draw { pose_at(self.prepared, start + length) } else { None };
                let joints = self.prepared.loads.joints_at(start + length).1;
                let surroundings = pose.and_then(|pose| surroundings_at(self.prepared, start + length, &pose));
                let order = Order { pose, joints: &joints, surroundings, ..Order::default() };
                self.engine.submit(Some(EngineStep { load: &load, steps: self.share, start, length }), order)?;
                self.next += 1;
            }
            if number > 0 {
                self.engine.deliver()?;
                let now = Instant::now();
                let passes = self.new_times();
                if number > WARM_UP {
                    times.wall.push(now.duration_since(last).as_secs_f64() * 1e3);
                    passes.into_iter().for_each(|(name, ms)| times.passes.entry(name).or_default().push(ms));
                }
                last = now;
            }
        }
        Ok(times)
    }

    /// Time of each pass since the last call [ms]. Variants and ranges are added.
    fn new_times(&mut self) -> BTreeMap<String, f64> {
        let mut sums = BTreeMap::new();
        for (name, samples) in self.engine.pass_times().into_iter().flatten() {
            let taken = self.samples_taken.entry(name.clone()).or_default();
            if *taken < samples.len() {
                let pass = name.split('.').next().unwrap_or(name).to_owned();
                *sums.entry(pass).or_insert(0.0) += samples[*taken..].iter().sum::<f64>();
                *taken = samples.len();
            }
        }
        sums
    }
}

impl Times {
    fn passes(&self) -> Vec<PassSpread> {
        let median = |(name, samples): (&String, &Vec<f64>)| {
            Some(PassSpread { name: name.clone(), ms: Percentiles::of(samples)? })
        };
        self.passes.iter().filter_map(median).collect()
    }
}
