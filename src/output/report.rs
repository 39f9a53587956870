//! The values of a run's report, and `report.json`.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::Serialize;

use super::OutputError;
use super::folder::Folder;
use super::plot::Plot;
use super::sigma::SigmaReport;
use super::statistics::Percentiles;
use crate::simulation::check::Accuracy;
use crate::simulation::energy::EnergyBalance;
use crate::simulation::uncertainty::PixelError;
use crate::trace::TimeAccount;

/// How a scene asks for the error of every pixel.
pub(crate) const HOW_TO_ASK: &str = "state error = true in [output], and images have it as the channel T_error";

/// Everything that a run reports. Empty lists and absent options are not shown.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct Report {
    #[serde(flatten)]
    pub(crate) source: ReportSource,
    pub(crate) device: ReportDevice,
    pub(crate) speed: Speed,
    #[serde(flatten)]
    pub(crate) findings: ReportFindings,
    pub(crate) model: ModelSize,
    pub(crate) buffers: Vec<BufferSize>,
    pub(crate) passes: Vec<PassTime>,
    /// Settings of the scene by section, in file order.
    pub(crate) settings: Vec<SettingGroup>,
    /// Defaults that were used.
    pub(crate) assumptions: Vec<String>,
    pub(crate) warnings: Vec<String>,
    /// Effects that the scene switches off, which cost nothing.
    pub(crate) switched_off: Vec<String>,
    #[serde(flatten)]
    pub(crate) results: ReportFiles,
    /// Whether the run stopped before its last step.
    pub(crate) interrupted: bool,
}

/// The errors and the heat of a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct ReportFindings {
    /// Stated error of the temperatures of the visible pixels. `None` if the scene does not ask for it.
    pub(crate) pixel_error: Option<PixelError>,
    /// Rounding and implementation: the difference from the f64 reference, which shares every approximation. `None` if nothing was compared, as in a run of the
    /// reference itself.
    pub(crate) accuracy: Option<Accuracy>,
    /// Energy balance of the run. `None` if the scene does not keep it.
    pub(crate) energy: Option<EnergyBalance>,
    /// Mean budget of each part. Empty if the scene does not ask for it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) budgets: Vec<PartBudget>,
    /// Uncertainty by the ranges of parameters. `None` if the scene does not ask for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) sigma: Option<SigmaReport>,
}

/// Budget of a part, in the mean over the time of a run and over the area of the part.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct PartBudget {
    /// Name of the part.
    pub(crate) part: String,
    /// Gain by each cause [W/m2].
    pub(crate) mean_w_per_m2: BTreeMap<&'static str, f64>,
}

/// The program, the command and the files that a run started from.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct ReportSource {
    /// Title: the scene's name.
    pub(crate) title: String,
    pub(crate) version: String,
    pub(crate) command_line: String,
    pub(crate) scene: InputFile,
    /// The other input files: model, material tables.
    pub(crate) inputs: Vec<InputFile>,
}

/// The files that a run wrote.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct ReportFiles {
    pub(crate) frames: Vec<FrameEntry>,
    pub(crate) pictures: Vec<ReportPicture>,
    pub(crate) plots: Vec<PlotEntry>,
    pub(crate) files: Vec<FileEntry>,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct InputFile {
    /// `scene`, `model`, `materials`.
    pub(crate) kind: String,
    /// Path as given.
    pub(crate) path: String,
    /// SHA-256 of its bytes (hexadecimal).
    pub(crate) sha256: String,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct ReportDevice {
    /// `llvmpipe (LLVM 15.0.6, 256 bits)`, or `cpu` for the f64 reference.
    pub(crate) name: String,
    /// Driver and its version.
    pub(crate) driver: String,
    /// Further facts: API version, relevant limits.
    pub(crate) details: Vec<(String, String)>,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct Speed {
    /// Steps, including the warm-up.
    pub(crate) steps: u64,
    pub(crate) images: u64,
    /// Median device time of a thermal step [ns/(node step)].
    pub(crate) ns_per_node_step: Option<f64>,
    /// Median time of a thermal step [ms], with all network passes. If the processor integrates, the time is wall time.
    pub(crate) step_ms: Option<f64>,
    /// Median wall time of the network in a step [ms], with loads, transfers and step control.
    pub(crate) network_wall_ms: Option<f64>,
    /// Median time of an image without writing files [ms].
    pub(crate) image_ms: Option<f64>,
    /// Wall time of the whole run with files [s].
    pub(crate) wall_s: f64,
    /// Memory of the process at its peak [B]: as it was forecast, and as it was. `None` where the system does not tell it.
    pub(crate) memory_b: [Option<u64>; 2],
    /// Where it went.
    pub(crate) time: TimeAccount,
}

/// Size of the model during the run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct ModelSize {
    pub(crate) nodes: u64,
    /// Number of drawn triangles.
    pub(crate) triangles: u64,
    /// Area [m2].
    pub(crate) area_m2: f64,
    /// Number of nodes with each response: `transition`, 12345.
    pub(crate) nodes_by_response: Vec<(String, u64)>,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct BufferSize {
    pub(crate) name: String,
    /// Size [bytes].
    pub(crate) bytes: u64,
}

/// Times of a pass, from timestamps on the device.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PassTime {
    pub(crate) name: String,
    /// Median [ms].
    pub median_ms: f64,
    /// Tenth percentile [ms].
    pub p10_ms: f64,
    /// Ninetieth percentile [ms].
    pub p90_ms: f64,
    /// Number of samples.
    pub count: u64,
}

impl PassTime {
    /// From samples [ms]. `None` without samples.
    pub fn from_samples(name: &str, samples_ms: &[f64]) -> Option<Self> {
        let Percentiles { median: median_ms, p10: p10_ms, p90: p90_ms, samples: count } = Percentiles::of(samples_ms)?;
        Some(Self { name: name.to_owned(), median_ms, p10_ms, p90_ms, count })
    }
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct SettingGroup {
    /// `Orbit`, `Material white_paint`.
    pub(crate) title: String,
    /// Name and value with its unit.
    pub(crate) entries: Vec<(String, String)>,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct FrameEntry {
    pub(crate) step: u32,
    /// Time since the start [s].
    pub(crate) time_s: f64,
    /// EXR file, relative to the report.
    pub(crate) file: String,
    /// PNG file, relative to the report, if there is one.
    pub(crate) picture: Option<String>,
    /// Place of the camera in the body frame [m].
    pub(crate) camera_m: [f64; 3],
    /// Turn that takes the body frame into the camera's axes, as a quaternion w, x, y, z.
    pub(crate) camera_turn: [f64; 4],
    /// Angle between the camera's axis and the direction to the planet's centre [deg].
    pub(crate) planet_off_axis_deg: Option<f64>,
    /// Share of the image before which the planet stands, with what the craft hides of it.
    pub(crate) planet_share: Option<f64>,
    /// Whether all pixels of the craft are at an end of the range of a sensor.
    pub(crate) at_end_of_range: bool,
}

impl FrameEntry {
    /// Distance from the camera to the origin of the body frame [m].
    pub(crate) fn range(&self) -> f64 {
        DVec3::from(self.camera_m).length()
    }
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct ReportPicture {
    /// Caption.
    pub(crate) title: String,
    /// File, relative to the report.
    pub(crate) file: String,
    /// The PNG bytes. `report.json` has only the file name.
    #[serde(skip)]
    pub(crate) png: Vec<u8>,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct PlotEntry {
    pub(crate) title: String,
    /// File, relative to the report.
    pub(crate) file: String,
    /// The SVG document from [`super::plot::Plot::svg`]. `report.json` has only the file name.
    #[serde(skip)]
    pub(crate) svg: String,
}

/// Writes plots into the folder of a command.
///
/// # Errors
/// A file cannot be written.
pub(crate) fn write_plots(folder: &Folder, plots: &[PlotEntry]) -> Result<(), OutputError> {
    plots.iter().try_for_each(|plot| folder.write_bytes(&plot.file, plot.svg.as_bytes()))
}

impl PlotEntry {
    /// A plot with the file `plots/NAME.svg`.
    pub(crate) fn new(name: &str, title: &str, plot: &Plot) -> Result<Self, OutputError> {
        Ok(Self { title: title.to_owned(), file: format!("plots/{name}.svg"), svg: plot.svg()? })
    }
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct FileEntry {
    /// Path, relative to the report.
    pub(crate) path: String,
    /// Contents of the file, in words.
    pub(crate) what: String,
}

#[cfg(test)]
pub(crate) mod tests;
