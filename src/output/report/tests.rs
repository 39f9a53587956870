//! Tests of `report`, and what other tests take from them.

use super::*;
use crate::output::folder::Folder;
use crate::simulation::check::StepLengthError;
use crate::simulation::energy::PartEnergy;
use crate::simulation::uncertainty::PixelError;
use crate::thermal::budget::CHANNELS;
use crate::trace::TimeSpent;

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
            memory_b: [None; 2],
            wall_s: 41.3,
            time: TimeAccount {
                wall_s: 41.3,
                named_s: 40.9,
                works: vec![
                    TimeSpent {
                        thread: "host: loop",
                        depth: 0,
                        work: "steps".into(),
                        wall_s: 40.0,
                        processor_s: 77.2,
                        count: 1,
                    },
                    TimeSpent {
                        thread: "host: loop",
                        depth: 1,
                        work: "waiting for the device".into(),
                        wall_s: 31.5,
                        processor_s: 60.1,
                        count: 720,
                    },
                ],
            },
        },
        findings: ReportFindings {
            sigma: None,
            pixel_error: Some(PixelError { rms_k: 1.5, p99_k: 6.25, max_k: 12.5, pixels: 76_800, images: 36 }),
            accuracy: Some(full_accuracy()),
            energy: Some(full_energy()),
            budgets: vec![PartBudget {
                part: "body".into(),
                mean_w_per_m2: CHANNELS.into_iter().zip([90.5, 11.0, 22.0, 3.0, -4.0, 0.0, 0.0, -122.5]).collect(),
            }],
        },
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
                    camera_m: [0.0, 3.0, 4.0],
                    camera_turn: [1.0, 0.0, 0.0, 0.0],
                    planet_off_axis_deg: Some(126.87),
                    planet_share: Some(0.4),
                    at_end_of_range: false,
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
            measure: "twice the difference in f64 to steps of half the length".into(),
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
        parts_left_out: 0,
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
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.file("report.json")).unwrap()).unwrap();
    assert_eq!(json["pixel_error"]["rms_k"], 1.5);
    assert_eq!(json["accuracy"]["max_k"], 1.13e-3);
    assert_eq!(json["accuracy"]["step_length"]["max_k"], 0.9);
    assert_eq!(json["passes"][1]["name"], "thermal_step");
    assert_eq!(json["frames"][35]["file"], "frames/step_000350.exr");
    assert_eq!(json["model"]["nodes_by_response"][1][1], 479_090);
    assert_eq!(json["speed"]["step_ms"], serde_json::Value::Null);
    assert!(json["pictures"][0].get("png").is_none() && json["plots"][0].get("svg").is_none());
}
