//! The values of a run's report, and `report.json`.

use serde::Serialize;

use super::OutputError;
use super::folder::Folder;
use super::plot::Plot;
use super::statistics::Spread;
use crate::simulation::check::Accuracy;
use crate::simulation::energy::EnergyBalance;

/// Everything that a run reports. Empty lists and absent options are not shown.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Report {
    /// Title: the scene's name.
    pub title: String,
    /// Version of isotherm.
    pub version: String,
    /// The command line.
    pub command_line: String,
    /// The scene file.
    pub scene: SourceFile,
    /// The other input files: model, material tables.
    pub inputs: Vec<SourceFile>,
    /// The computing device.
    pub device: Device,
    /// Speed of the run.
    pub speed: Speed,
    /// Error against the f64 reference. `None` if nothing was compared, as in a run of the reference itself.
    pub accuracy: Option<Accuracy>,
    /// Energy balance of the run. `None` if the scene does not keep it.
    pub energy: Option<EnergyBalance>,
    /// Size of the model.
    pub model: ModelSize,
    /// Buffers on the device.
    pub buffers: Vec<BufferSize>,
    /// Passes of a step with their times.
    pub passes: Vec<PassTime>,
    /// Settings of the scene by section, in file order.
    pub settings: Vec<SettingGroup>,
    /// Defaults that were used.
    pub assumptions: Vec<String>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// Effects that the scene switches off. They cost nothing.
    pub switched_off: Vec<String>,
    /// The drawn steps.
    pub frames: Vec<FrameEntry>,
    /// Pictures for the page.
    pub pictures: Vec<Picture>,
    /// Plots for the page.
    pub plots: Vec<PlotEntry>,
    /// All files of the run.
    pub files: Vec<FileEntry>,
    /// Whether the run stopped before its last step.
    pub interrupted: bool,
}

/// An input file.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SourceFile {
    /// `scene`, `model`, `materials`.
    pub kind: String,
    /// Path as given.
    pub path: String,
    /// SHA-256 of its bytes (hexadecimal).
    pub sha256: String,
}

/// A device and its driver.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Device {
    /// `llvmpipe (LLVM 15.0.6, 256 bits)`, or `cpu` for the f64 reference.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// Further facts: API version, relevant limits.
    pub details: Vec<(String, String)>,
}

/// Speed of the run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Speed {
    /// Steps, including the warm-up.
    pub steps: u64,
    /// Number of images.
    pub images: u64,
    /// Median device time of a thermal step [ns/(node step)].
    pub ns_per_node_step: Option<f64>,
    /// Median time of a thermal step [ms], with all network passes. It is the wall time if the processor integrates.
    pub step_ms: Option<f64>,
    /// Median wall time of the network in a step [ms], with loads, transfers and step control.
    pub network_wall_ms: Option<f64>,
    /// Median time of an image without writing files [ms].
    pub image_ms: Option<f64>,
    /// Wall time of the whole run with files [s].
    pub wall_s: f64,
}

/// Size of the model during the run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ModelSize {
    /// Number of thermal nodes.
    pub nodes: u64,
    /// Number of drawn triangles.
    pub triangles: u64,
    /// Area [m2].
    pub area_m2: f64,
    /// Number of nodes with each response: `transition`, 12345.
    pub nodes_by_response: Vec<(String, u64)>,
}

/// A buffer on the device.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct BufferSize {
    /// Its name.
    pub name: String,
    /// Size [bytes].
    pub bytes: u64,
}

/// Times of a pass, from timestamps on the device.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PassTime {
    /// Name of the pass.
    pub name: String,
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
        let Spread { median: median_ms, p10: p10_ms, p90: p90_ms, samples: count } = Spread::of(samples_ms)?;
        Some(Self { name: name.to_owned(), median_ms, p10_ms, p90_ms, count })
    }
}

/// A group of settings.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SettingGroup {
    /// `Orbit`, `Material white_paint`.
    pub title: String,
    /// Name and value with its unit.
    pub entries: Vec<(String, String)>,
}

/// A drawn step.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FrameEntry {
    /// Number of the step.
    pub step: u32,
    /// Time since the start [s].
    pub time_s: f64,
    /// EXR file, relative to the report.
    pub file: String,
    /// PNG file, relative to the report, if there is one.
    pub picture: Option<String>,
}

/// A picture on the page.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Picture {
    /// Caption.
    pub title: String,
    /// File, relative to the report.
    pub file: String,
    /// The PNG bytes. `report.json` has only the file name.
    #[serde(skip)]
    pub png: Vec<u8>,
}

/// A plot on the page.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PlotEntry {
    /// Title.
    pub title: String,
    /// File, relative to the report.
    pub file: String,
    /// The SVG document from [`super::plot::Plot::svg`]. `report.json` has only the file name.
    #[serde(skip)]
    pub svg: String,
}

/// Writes plots into the folder of a command.
///
/// # Errors
/// A file cannot be written.
pub fn write_plots(folder: &Folder, plots: &[PlotEntry]) -> Result<(), OutputError> {
    plots.iter().try_for_each(|plot| folder.write_bytes(&plot.file, plot.svg.as_bytes()))
}

impl PlotEntry {
    /// A plot with the file `plots/NAME.svg`.
    pub fn new(name: &str, title: &str, plot: &Plot) -> Result<Self, OutputError> {
        Ok(Self { title: title.to_owned(), file: format!("plots/{name}.svg"), svg: plot.svg()? })
    }
}

/// A file of the run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FileEntry {
    /// Path, relative to the report.
    pub path: String,
    /// Its contents.
    pub what: String,
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::output::folder::Folder;
    use crate::simulation::check::StepLengthError;
    use crate::simulation::energy::PartEnergy;

    fn pairs(list: &[(&str, &str)]) -> Vec<(String, String)> {
        list.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect()
    }

    /// A report with a value in every field.
    pub(crate) fn full() -> Report {
        let strings = |list: &[&str]| list.iter().map(|&text| text.to_owned()).collect::<Vec<_>>();
        let file = |kind: &str, path: &str| SourceFile {
            kind: kind.into(),
            path: path.into(),
            sha256: "9f86d081884c7d65".repeat(4),
        };
        let passes = [("solar_depth", 0.31), ("thermal_step", 1.82), ("radiance", 9.44), ("readback", 0.92)];
        Report {
            title: "Station, one orbit at beta 30°".into(),
            version: "0.1.0".into(),
            command_line: "isotherm run models/station.toml -o out/station".into(),
            scene: file("scene", "models/station.toml"),
            inputs: vec![file("model", "models/station.glb"), file("materials", "models/materials.toml")],
            device: Device {
                name: "llvmpipe (LLVM 15.0.6, 256 bits)".into(),
                driver: "Mesa 22.3.6".into(),
                details: pairs(&[("Vulkan", "1.3.230"), ("maxStorageBufferRange", "128 MiB")]),
            },
            speed: Speed {
                steps: 720,
                images: 36,
                ns_per_node_step: Some(3.64),
                step_ms: Some(1.82),
                network_wall_ms: Some(2.1),
                image_ms: Some(12.5),
                wall_s: 41.3,
            },
            accuracy: Some(Accuracy {
                nodes: 2048,
                of_nodes: 499_213,
                steps: 360,
                max_k: 1.13e-3,
                rms_k: 4.2e-5,
                worst_node: "node 48213, part Array_3, material solar_cell".into(),
                worst_step: 212,
                worst_time_s: 3286.0,
                step_length: Some(StepLengthError {
                    nodes: 1830,
                    max_k: 0.9,
                    rms_k: 0.02,
                    worst_node: "node 48213, part Array_3, material solar_cell".into(),
                    worst_time_s: 3286.0,
                }),
                notes: strings(&["12 nodes below 3 K in grazing sun are compared in absorbed flux: 2e-6 relative"]),
            }),
            energy: Some(EnergyBalance {
                all: PartEnergy {
                    part: "all".into(),
                    absorbed_j: 2.1e9,
                    emitted_j: 2.0e9,
                    stored_j: 1e8,
                    ..PartEnergy::default()
                },
                parts: vec![PartEnergy { part: "Array_3".into(), absorbed_j: 1.2e7, ..PartEnergy::default() }],
                closure: Some(3.1e-5),
            }),
            model: ModelSize {
                nodes: 499_213,
                triangles: 831_204,
                area_m2: 8_231.4,
                nodes_by_response: vec![("instant".into(), 20_123), ("transition".into(), 479_090)],
            },
            buffers: vec![
                BufferSize { name: "node state".into(), bytes: 7_987_408 },
                BufferSize { name: "triangles".into(), bytes: 9_974_448 },
            ],
            passes: passes
                .iter()
                .filter_map(|(name, ms)| PassTime::from_samples(name, &[ms * 0.95, *ms, ms * 1.2]))
                .collect(),
            settings: vec![
                SettingGroup {
                    title: "Orbit".into(),
                    entries: pairs(&[("altitude", "408 km"), ("period", "5580 s"), ("beta", "30°")]),
                },
                SettingGroup {
                    title: "Environment".into(),
                    entries: pairs(&[("solar constant", "1361 W/m²"), ("albedo", "0.3")]),
                },
                SettingGroup {
                    title: "Material solar_cell".into(),
                    entries: pairs(&[
                        ("absorptivity", "0.88"),
                        ("emissivity", "0.80"),
                        ("source", "Fortescue 11.3, GaAs cell"),
                    ]),
                },
            ],
            assumptions: strings(&["Planet radius is 6371 km (Earth), since the scene gives none."]),
            warnings: strings(&[
                "Altitude 408 km means a period of 5554 s, but the scene says 5580 s; both are used as given.",
            ]),
            switched_off: strings(&["self-shadowing", "joints", "networks", "sensor"]),
            frames: (0..36u32)
                .map(|i| FrameEntry {
                    step: i * 10,
                    time_s: f64::from(i) * 155.0,
                    file: format!("frames/step_{:06}.exr", i * 10),
                    picture: Some(format!("frames/step_{:06}.png", i * 10)),
                })
                .collect(),
            pictures: vec![Picture { title: "The orbit".into(), file: "contact_sheet.png".into(), png: vec![1, 2, 3] }],
            plots: vec![PlotEntry {
                title: "Materials".into(),
                file: "plots/materials.svg".into(),
                svg: "<svg></svg>".into(),
            }],
            files: vec![FileEntry { path: "series.csv".into(), what: "temperatures over time".into() }],
            interrupted: false,
        }
    }

    #[test]
    fn the_json_has_the_figures_and_not_the_pictures() {
        let root = tempfile::tempdir().unwrap();
        let folder = Folder::new(root.path(), &["report.json"]).prepare(false, &[]).unwrap();
        let mut report = full();
        report.speed.step_ms = Some(f64::NAN);
        folder.write_json("report.json", &report).unwrap();
        let json: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder.file("report.json")).unwrap()).unwrap();
        assert_eq!(json["accuracy"]["max_k"], 1.13e-3);
        assert_eq!(json["accuracy"]["step_length"]["max_k"], 0.9);
        assert_eq!(json["passes"][1]["name"], "thermal_step");
        assert_eq!(json["frames"][35]["file"], "frames/step_000350.exr");
        assert_eq!(json["model"]["nodes_by_response"][1][1], 479_090);
        assert_eq!(json["speed"]["step_ms"], serde_json::Value::Null);
        assert!(json["pictures"][0].get("png").is_none() && json["plots"][0].get("svg").is_none());
    }
}
