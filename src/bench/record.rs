//! What was measured, as plain values: `bench.json`.

use std::path::Path;

use serde::Serialize;

use super::hard::HardRow;
use super::integrators::Differences;
use crate::gpu::context::DeviceInfo;
use crate::output::OutputError;
use crate::output::folder::write_bytes;
use crate::output::report::PassTime;

/// Median and the range from the tenth to the ninetieth percentile.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// Tenth percentile.
    pub p10: f64,
    /// Ninetieth percentile.
    pub p90: f64,
    /// Samples.
    pub samples: u64,
}

impl Spread {
    /// Of samples; `None` without any.
    pub fn of(samples: &[f64]) -> Option<Self> {
        let PassTime { median_ms: median, p10_ms: p10, p90_ms: p90, count: samples, .. } =
            PassTime::from_samples("", samples)?;
        Some(Self { median, p10, p90, samples })
    }

    /// The same in another unit.
    pub fn scaled(self, factor: f64) -> Self {
        Self { median: factor * self.median, p10: factor * self.p10, p90: factor * self.p90, ..self }
    }
}

/// One run of `isotherm bench`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bench {
    /// Version of isotherm.
    pub version: String,
    /// The command as it was given.
    pub command_line: String,
    /// Whether it was built with optimisation for release.
    pub release: bool,
    /// Whether `--quick` left measurements out.
    pub quick: bool,
    /// Processors that the operating system offers.
    pub processors: usize,
    /// What was integrated, without what it took.
    pub cases: Vec<CaseSummary>,
    /// What was measured, device by device.
    pub devices: Vec<Measured>,
    /// How far other devices are from the first.
    pub drivers: Vec<DriverRow>,
    /// Wall time of everything [s].
    pub wall_s: f64,
}

/// A case of the integrators.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseSummary {
    /// Short name.
    pub key: String,
    /// What it is.
    pub title: String,
    /// Nodes.
    pub nodes: usize,
    /// Nodes among them that store no heat.
    pub arithmetic: usize,
    /// Linear and radiative conductors.
    pub conductors: usize,
    /// Frames.
    pub frames: usize,
    /// Length of a frame [s].
    pub frame_s: f64,
    /// Frame over the longest stable step of forward Euler.
    pub stiffness: f64,
    /// The same of the case in NUMERICS.md 3.
    pub published_stiffness: f64,
    /// Sub-steps a frame of RKL2 in f64 that the temperatures are held against.
    pub reference_sub_steps: u32,
    /// The error of that reference itself, estimated from half as many sub-steps.
    pub reference_error: Differences,
}

/// What was measured on one device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// Name.
    pub name: String,
    /// What the device says of itself; `None` for the f64 reference on the processor.
    pub info: Option<DeviceInfo>,
    /// Load averages of the machine over 1, 5 and 15 minutes before and after.
    pub load_average: [Option<[f64; 3]>; 2],
    /// Share of the processor time asked for meanwhile that other guests of the same host took.
    pub stolen: Option<f64>,
    /// What the device can do at best.
    pub limits: Option<Limits>,
    /// What a node costs.
    pub responses: Vec<Response>,
    /// Whole ticks of scenes, pass by pass.
    pub frames: Vec<FrameRow>,
    /// What each choice of a model costs and changes.
    pub models: Option<Models>,
    /// What integrators cost, and how wrong they are: a list for each case.
    pub integrators: Vec<Integrated>,
    /// The hard cases.
    pub hard: Vec<HardRow>,
}

/// What a device can do at best.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limits {
    /// Copies from one device buffer to another, each byte read and written.
    pub copies: Vec<Copied>,
    /// One empty dispatch from its recording until the host knows that it is done [us].
    pub submission_us: Option<Spread>,
    /// Each of many empty dispatches with barriers between [us].
    pub dispatch_us: Option<Spread>,
    /// Whether the device's own clock measured copies and dispatches.
    pub by_timestamps: bool,
}

impl Limits {
    /// The highest median rate at which copies move bytes [GB/s].
    pub fn bandwidth(&self) -> Option<f64> {
        let rates = self.copies.iter().filter_map(|copied| copied.gigabytes_per_second);
        rates.map(|rate| rate.median).reduce(f64::max)
    }
}

/// A copy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Copied {
    /// Bytes copied.
    pub bytes: u64,
    /// Bytes read and written over time [GB/s].
    pub gigabytes_per_second: Option<Spread>,
}

/// What a node costs under one response.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Response {
    /// The response and its function.
    pub response: String,
    /// Nodes.
    pub nodes: usize,
    /// Time of a step [ns a node]; of a network, of a stage.
    pub ns_a_node: Option<Spread>,
    /// Bytes that a node reads and writes in a step, each array counted once.
    pub bytes_a_node: f64,
    /// Those bytes over that time [GB/s].
    pub gigabytes_per_second: Option<f64>,
    /// Its share of the copy bandwidth that was measured in the same run.
    pub share_of_copy: Option<f64>,
    /// Why there is no time.
    pub failed: Option<String>,
}

/// Whole ticks of a scene at one density.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FrameRow {
    /// Name of the scene.
    pub scene: String,
    /// Longest edge of its triangles [m].
    pub longest_edge_m: f64,
    /// Whether the craft shadows itself.
    pub shadows: bool,
    /// Nodes.
    pub nodes: usize,
    /// Triangles.
    pub triangles: usize,
    /// Bytes on the device that grow with the nodes, for each node.
    pub bytes_a_node: f64,
    /// From the loaded scene to a device that is ready [s].
    pub start_up_s: f64,
    /// Length of a tick [s].
    pub tick_s: f64,
    /// Ticks that were measured.
    pub ticks: u32,
    /// Time of each pass in the ticks that it ran in.
    pub passes: Vec<Pass>,
    /// Time of a tick with its image on the host [ms].
    pub tick_ms: Option<Spread>,
    /// The longest of them [ms].
    pub worst_tick_ms: Option<f64>,
    /// Time of a tick without an image [ms].
    pub step_ms: Option<Spread>,
    /// Why there are no times.
    pub failed: Option<String>,
}

/// A device against another, on the same scene.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct DriverRow {
    /// The first, and the one that is held against it.
    pub devices: [String; 2],
    /// Name of the scene.
    pub scene: String,
    /// Nodes, padding included.
    pub nodes: usize,
    /// Root mean square over nodes [K].
    pub rms_k: f64,
    /// Largest [K].
    pub max_k: f64,
    /// Pixels that either drew.
    pub pixels: usize,
    /// Pixels that show another part or material.
    pub other_part: usize,
    /// Largest difference of radiance over radiance, where both show the same part.
    pub radiance_relative: f64,
    /// Why a device could not be compared.
    pub failed: Option<String>,
}

/// A pass of the frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pass {
    /// Name, its variants together.
    pub name: String,
    /// Time in a tick [ms]; as many samples as ticks that it ran in.
    pub ms: Spread,
}

/// Choices of a model on one scene.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Models {
    /// Name of the scene.
    pub scene: String,
    /// Nodes.
    pub nodes: usize,
    /// Length of a tick [s].
    pub tick_s: f64,
    /// Ticks that were compared.
    pub ticks: u32,
    /// The base first.
    pub choices: Vec<ChoiceRow>,
}

/// One choice.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ChoiceRow {
    /// What is chosen, or what is changed against the base.
    pub choice: String,
    /// Median time of the thermal, shadow and network passes of a tick by the device's clock [ms].
    pub step_ms: Option<f64>,
    /// How far temperatures and images are from the base's.
    pub from_base: Option<Moved>,
    /// How far they are from the network's.
    pub from_network: Option<Moved>,
    /// Of shadows by rays: what the base's shadows get wrong.
    pub wrong_shadows: Option<WrongShadows>,
    /// Why there are no numbers.
    pub failed: Option<String>,
}

/// What fast shadows get wrong of the nodes that face the Sun: those whose share of it is off by more than a half.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WrongShadows {
    /// Share of the nodes.
    pub nodes: f64,
    /// Share of their area.
    pub area: f64,
}

/// How far a run is from another.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Moved {
    /// Root mean square over area and ticks [K].
    pub rms_k: f64,
    /// Largest [K].
    pub max_k: f64,
    /// Root mean square over the craft's pixels [W m-2 sr-1].
    pub radiance_rms: f64,
    /// Mean radiance of the craft's pixels in the other run [W m-2 sr-1].
    pub radiance_mean: f64,
}

/// The runs of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Integrated {
    /// Short name of the case.
    pub case: String,
    /// One for every scheme.
    pub runs: Vec<Run>,
}

/// A scheme on a case.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Run {
    /// Method with sub-steps or tolerance.
    pub scheme: String,
    /// Method.
    pub family: String,
    /// `workgroup` where one takes all stages of a dispatch, `dispatches` where each stage is one, `f64` on the processor.
    pub path: String,
    /// Work of one run; fewer frames than the case has where it took too long.
    pub work: Option<Work>,
    /// Time of a frame by the device's clock [ms].
    pub device_ms: Option<Spread>,
    /// Time of a frame by the host's clock [ms].
    pub wall_ms: Option<Spread>,
    /// Difference from the reference at the ends of all frames.
    pub error: Option<Differences>,
    /// Why there are no numbers.
    pub failed: Option<String>,
}

impl Run {
    /// Time of a frame [ms]: the device's where it has a clock.
    pub fn time(&self) -> Option<Spread> {
        self.device_ms.or(self.wall_ms)
    }
}

/// Counts of work, rejected sub-steps included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Work {
    /// Frames.
    pub frames: u64,
    /// Stages, each an evaluation of all exchanges.
    pub stages: u64,
    /// Sub-steps.
    pub sub_steps: u64,
    /// Dispatches.
    pub dispatches: u64,
    /// Iterations of Newton's method and of conjugate gradients.
    pub iterations: u64,
}

/// The machine's load averages, where the operating system tells them.
pub fn load_average() -> Option<[f64; 3]> {
    let text = std::fs::read_to_string("/proc/loadavg").ok()?;
    let mut numbers = text.split_whitespace().map_while(|word| word.parse().ok());
    Some([numbers.next()?, numbers.next()?, numbers.next()?])
}

impl Bench {
    /// Writes `bench.json`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        let failed = |error: serde_json::Error| OutputError::write(path, error.into());
        let mut text = serde_json::to_vec_pretty(self).map_err(failed)?;
        text.push(b'\n');
        write_bytes(path, &text)
    }
}
