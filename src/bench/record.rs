//! What was measured, as plain values: `bench.json`.

use serde::Serialize;

use super::drivers::DriverRow;
use super::frames::FrameRow;
use super::hard::HardRow;
use super::integrators::Integrated;
use super::limits::Limits;
use super::models::Models;
use super::responses::ResponseRow;
use super::truth::CaseSummary;
use crate::gpu::context::DeviceInfo;

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

/// What was measured on one device.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
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
    pub responses: Vec<ResponseRow>,
    /// Whole steps of scenes, pass by pass.
    pub frames: Vec<FrameRow>,
    /// What each choice of a model costs and changes.
    pub models: Option<Models>,
    /// What integrators cost, and how wrong they are: a list for each case.
    pub integrators: Vec<Integrated>,
    /// The hard cases.
    pub hard: Vec<HardRow>,
}

/// The machine's load averages, where the operating system tells them.
pub fn load_average() -> Option<[f64; 3]> {
    let text = std::fs::read_to_string("/proc/loadavg").ok()?;
    let mut numbers = text.split_whitespace().map_while(|word| word.parse().ok());
    Some([numbers.next()?, numbers.next()?, numbers.next()?])
}
