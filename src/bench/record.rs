//! All results as plain values: `bench.json`.

use serde::Serialize;

use super::drivers::DriverRow;
use super::frames::FrameRow;
use super::frontier::Frontier;
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
    /// The command line.
    pub command_line: String,
    /// Whether it is an optimised release build.
    pub release: bool,
    /// Whether `--quick` left measurements out.
    pub quick: bool,
    /// Number of processors.
    pub processors: usize,
    /// The integrated cases.
    pub cases: Vec<CaseSummary>,
    /// Measurements of each device.
    pub devices: Vec<DeviceMeasurements>,
    /// Differences of other devices from the first.
    pub drivers: Vec<DriverRow>,
    /// Wall time of everything [s].
    pub wall_s: f64,
}

/// Measurements of one device.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct DeviceMeasurements {
    /// Name.
    pub name: String,
    /// Device information. `None` for the f64 reference on the processor.
    pub info: Option<DeviceInfo>,
    /// Load averages of the machine over 1, 5 and 15 minutes, before and after.
    pub load_average: [Option<[f64; 3]>; 2],
    /// Share of processor time that other guests of the host took.
    pub stolen: Option<f64>,
    /// Limits of the device.
    pub limits: Option<Limits>,
    /// Cost of a node.
    pub responses: Vec<ResponseRow>,
    /// Whole steps of scenes, pass by pass.
    pub frames: Vec<FrameRow>,
    /// Cost and effect of each model choice.
    pub models: Option<Models>,
    /// Cost and error of each response, with and without shadows.
    pub frontier: Frontier,
    /// Cost and error of integrators, for each case.
    pub integrators: Vec<Integrated>,
    /// The hard cases.
    pub hard: Vec<HardRow>,
}

/// The machine's load averages, if the operating system provides them.
pub(crate) fn load_average() -> Option<[f64; 3]> {
    let text = std::fs::read_to_string("/proc/loadavg").ok()?;
    let mut numbers = text.split_whitespace().map_while(|word| word.parse().ok());
    Some([numbers.next()?, numbers.next()?, numbers.next()?])
}
