//! The values of a run's report, and `report.json`.

use serde::Serialize;

use super::OutputError;
use super::folder::Folder;
use super::plot::Plot;
use super::statistics::Percentiles;
use crate::simulation::check::Accuracy;
use crate::simulation::energy::EnergyBalance;

/// Everything that a run reports. Empty lists and absent options are not shown.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct Report {
    #[serde(flatten)]
    pub(crate) source: ReportSource,
    pub(crate) device: ReportDevice,
    pub(crate) speed: Speed,
    /// Error against the f64 reference. `None` if nothing was compared, as in a run of the reference itself.
    pub(crate) accuracy: Option<Accuracy>,
    /// Energy balance of the run. `None` if the scene does not keep it.
    pub(crate) energy: Option<EnergyBalance>,
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
        let file = |kind: &str, path: &str| InputFile {
            kind: kind.into(),
            path: path.into(),
            sha256: "9f86d081884c7d65".repeat(4),
        };
        let passes = [("solar_depth", 0.31), ("thermal_step", 1.82), ("radiance", 9.44), ("readback", 0.92)];
        Report {
            source: ReportSource {
                title: "Station, one orbit at beta 30°".into(),
                version: "0.1.0".into(),
                command_line: "isotherm run models/station.toml -o out/station".into(),
                scene: file("scene", "models/station.toml"),
                inputs: vec![file("model", "models/station.glb"), file("materials", "models/materials.toml")],
            },
            device: ReportDevice {
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
            accuracy: Some(full_accuracy()),
            energy: Some(full_energy()),
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
            settings: full_settings(),
            assumptions: strings(&["Planet radius is 6371 km (Earth), since the scene gives none."]),
            warnings: strings(&[
                "Altitude 408 km means a period of 5554 s, but the scene says 5580 s; both are used as given.",
            ]),
            switched_off: strings(&["self-shadowing", "joints", "networks", "sensor"]),
            results: ReportFiles {
                frames: (0..36u32)
                    .map(|i| FrameEntry {
                        step: i * 10,
                        time_s: f64::from(i) * 155.0,
                        file: format!("frames/step_{:06}.exr", i * 10),
                        picture: Some(format!("frames/step_{:06}.png", i * 10)),
                    })
                    .collect(),
                pictures: vec![ReportPicture {
                    title: "The orbit".into(),
                    file: "contact_sheet.png".into(),
                    png: vec![1, 2, 3],
                }],
                plots: vec![PlotEntry {
                    title: "Materials".into(),
                    file: "plots/materials.svg".into(),
                    svg: "<svg></svg>".into(),
                }],
                files: vec![FileEntry { path: "series.csv".into(), what: "temperatures over time".into() }],
            },
            interrupted: false,
        }
    }

    fn strings(list: &[&str]) -> Vec<String> {
        list.iter().map(|&text| text.to_owned()).collect()
    }

    fn full_accuracy() -> Accuracy {
        Accuracy {
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
        }
    }

    fn full_energy() -> EnergyBalance {
        EnergyBalance {
            all: PartEnergy {
                part: "all".into(),
                absorbed_j: 2.1e9,
                emitted_j: 2.0e9,
                stored_j: 1e8,
                ..PartEnergy::default()
            },
            parts: vec![PartEnergy { part: "Array_3".into(), absorbed_j: 1.2e7, ..PartEnergy::default() }],
            closure: Some(3.1e-5),
        }
    }

    fn full_settings() -> Vec<SettingGroup> {
        vec![
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
        ]
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
