//! The commands `run` and `render` of the built program: their files, equal when repeated, and alike on every engine.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use isotherm::Image;
use isotherm::internals::read_exr;
use serde_json::Value;

use super::craft::{Folder, SCENE, scene_with};
use super::device::Worst;
use super::program::{end, isotherm, refusal, stderr, succeed};

/// Every file below a folder, by relative path, without isotherm's own records.
pub fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(&next).expect("a folder") {
            let path: PathBuf = entry.expect("an entry").path();
            if path.ends_with(".isotherm") {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("below the folder").to_string_lossy().into_owned();
                found.insert(name, std::fs::read(path).expect("a file"));
            }
        }
    }
    found
}

const FILES: [&str; 15] = [
    "contact_sheet.png",
    "frames/step_000000.exr",
    "frames/step_000000.png",
    "frames/step_000004.exr",
    "frames/step_000004.png",
    "frames/step_000008.exr",
    "frames/step_000008.png",
    "frames/step_000012.exr",
    "frames/step_000012.png",
    "plots/materials.svg",
    "plots/parts.svg",
    "plots/probes.svg",
    "report.html",
    "report.json",
    "series.csv",
];

pub fn report(files: &BTreeMap<String, Vec<u8>>) -> Value {
    serde_json::from_slice(&files["report.json"]).expect("JSON")
}

#[test]
fn a_run_leaves_everything_and_twice_the_same() {
    let folder = Folder::new(SCENE);
    let [one, two] = ["one", "deeper/two"].map(|name| {
        succeed(folder.0.path(), &["run", "scene.toml", "-o", name]);
        files(&folder.path(name))
    });
    assert_eq!(one.keys().collect::<Vec<_>>(), FILES);
    for (name, bytes) in &one {
        // The report contains times.
        assert!(name.starts_with("report.") || *bytes == two[name], "{name} differs from run to run");
    }
    let warmer = scene_with(&[("planet_ir = 237", "planet_ir = 237.01")]);
    folder.write("scene.toml", &warmer);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "three"]);
    let three = files(&folder.path("three"));
    for name in ["frames/step_000012.exr", "series.csv"] {
        assert!(one[name] != three[name], "another scene must show in {name}");
    }

    let report = report(&one);
    assert_eq!(report["interrupted"], false);
    assert_eq!((&report["speed"]["steps"], &report["speed"]["images"]), (&12.into(), &4.into()));
    let frames = report["frames"].as_array().expect("a list");
    assert_eq!(frames.len(), 4);
    // The camera looks down past the craft, 48 deg from the planet's centre, whose disc has a radius of 70 deg and is behind most of the image.
    let share = frames[0]["planet_share"].as_f64().expect("a number");
    assert!((0.9..=1.0).contains(&share), "{share}");
    let turn: Vec<f64> = serde_json::from_value(frames[0]["camera_turn"].clone()).expect("four numbers");
    assert!((turn.iter().map(|part| part * part).sum::<f64>() - 1.0).abs() < 1e-12, "{turn:?}");
    assert!(report["accuracy"]["max_k"].as_f64().expect("a number") < 2e-3, "{}", report["accuracy"]);
    assert_eq!(report["accuracy"]["steps"], 13);
    let passes: Vec<&str> =
        report["passes"].as_array().expect("a list").iter().filter_map(|p| p["name"].as_str()).collect();
    for pass in ["radiance", "thermal_step.merge.sun.planet_ir.albedo", "read radiance"] {
        assert!(passes.contains(&pass), "{passes:?}");
    }
    let page = String::from_utf8(one["report.html"].clone()).expect("text");
    // An SVG names its namespace, but nothing fetches it.
    let page = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!page.contains("http"), "the page opens without a network");
    assert!(page.contains("data:image/png;base64,") && page.contains("<svg"), "with its pictures inside");
    assert!(page.contains("range [m]") && page.contains("planet in the view [%]"), "with the pose of each image");

    let series = String::from_utf8(one["series.csv"].clone()).expect("text");
    let lines: Vec<&str> = series.lines().collect();
    assert_eq!(lines.len(), 14, "a head, the initial state and twelve steps");
    assert!(lines[0].starts_with("time,part:body:min,part:body:mean,part:body:max,"));
    assert!(lines[0].ends_with("all:min,all:mean,all:max,probe:tip"));
    assert!(lines[13].starts_with("720,") && lines.iter().all(|line| line.split(',').count() == 26));
}

#[test]
fn a_frame_tells_what_it_is() {
    let folder = Folder::new(SCENE);
    succeed(folder.0.path(), &["render", "scene.toml", "--time", "240", "-o", "image.exr"]);
    let bytes = std::fs::read(folder.path("image.exr")).expect("the image");
    // OpenEXR ends names and types with a zero byte.
    for attribute in [
        "isotherm_band_um\0v2d\0",
        "isotherm_units_L\0string\0",
        "isotherm_units_T\0string\0",
        "isotherm_units_Z\0string\0",
        "emissiveUnits\0string\0",
        "isotherm_time_s\0double\0",
        "isotherm_camera_focal_px\0v2d\0",
        "isotherm_camera_centre_px\0v2d\0",
        "isotherm_camera_position_m\0v3d\0",
        "isotherm_frame_from_camera_wxyz\0string\0",
        "isotherm_camera_from_body\0m44d\0",
        "isotherm_scene_sha256\0string\0",
        "isotherm_device\0string\0",
        "isotherm_version\0string\0",
        "isotherm_parts\0stringvector\0",
        "isotherm_materials\0stringvector\0",
    ] {
        let found = bytes.windows(attribute.len()).any(|window| window == attribute.as_bytes());
        assert!(found, "{attribute:?}");
    }
    let (frame, header) = read_exr(&folder.path("image.exr")).expect("a frame");
    assert_eq!((frame.camera.width, frame.camera.height, frame.time), (96, 72, 240.0));
    assert_eq!((header.band.lower, header.band.upper), (8e-6, 14e-6));
    assert_eq!(header.parts, ["body", "wing_port", "wing_starboard", "mast"]);
    assert_eq!(header.materials, ["skin", "cells", "mast"]);
    assert_eq!(header.version, env!("CARGO_PKG_VERSION"));
    assert_eq!(header.scene_sha256.len(), 64);
    // 45 deg across 96 pixels.
    assert!((frame.camera.lens.focal[0] - 48.0 / 22.5_f64.to_radians().tan()).abs() < 1e-9);
    // The pose maps the target of the camera to its axis.
    let ahead = frame.camera_from_body.transform_point3(glam::DVec3::ZERO);
    assert!(ahead.truncate().length() < 1e-9 && (ahead.z - (6.5_f64 * 6.5 + 25.0 + 7.5 * 7.5).sqrt()).abs() < 1e-9);
}

fn frame(path: &Path) -> Image {
    read_exr(path).expect("a frame").0
}

#[test]
#[ignore = "long: tools/test --all"]
fn render_gives_the_frame_of_the_run_at_that_time() {
    let folder = Folder::new(SCENE);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "out"]);
    for (time, step) in [("0", 0), ("240", 4), ("720", 12)] {
        succeed(folder.0.path(), &["render", "scene.toml", "--time", time, "-o", "image.exr"]);
        let [still, run] = [folder.path("image.exr"), folder.path(&format!("out/frames/step_{step:06}.exr"))]
            .map(|path| std::fs::read(path).expect("an image"));
        assert!(still == run, "the image at {time} s is that of step {step}, to the byte");
    }
    // The middle of a step needs a shorter last step. The craft warms and cools steadily, so it must lie between.
    let [before, between, after] = ["240", "270", "300"].map(|time| {
        succeed(folder.0.path(), &["render", "scene.toml", "--time", time, "-o", "image.exr"]);
        frame(&folder.path("image.exr"))
    });
    assert_eq!((between.time, before.time), (270.0, 240.0));
    let mut moved = 0;
    for (index, part) in between.part.iter().enumerate() {
        // The box warms or cools steadily over a minute.
        let ends = [before.temperature[index], after.temperature[index]];
        if *part == 1 && (ends[0] - ends[1]).abs() > 0.1 {
            let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            assert!((low..=high).contains(&between.temperature[index]), "{ends:?} {}", between.temperature[index]);
            moved += 1;
        }
    }
    assert!(moved > 100, "{moved} pixels move");
}

#[test]
fn the_reference_agrees_with_the_device() {
    let folder = Folder::new(SCENE);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "device"]);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "cpu", "--device", "CPU"]);
    let [device, cpu] = ["device", "cpu"].map(|name| files(&folder.path(name)));
    assert_eq!(device.keys().collect::<Vec<_>>(), cpu.keys().collect::<Vec<_>>());
    assert!(report(&cpu)["accuracy"].is_null(), "the reference is not compared with itself");
    assert_eq!(report(&cpu)["device"]["name"], "cpu (f64 reference)");
    let rows = |files: &BTreeMap<String, Vec<u8>>| -> Vec<f64> {
        let text = String::from_utf8(files["series.csv"].clone()).expect("text");
        text.lines()
            .skip(1)
            .flat_map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect::<Vec<_>>())
            .collect()
    };
    let cell = |index: usize| format!("row {}, column {}", index / 26, index % 26);
    Worst::of(&rows(&device), &rows(&cpu), cell).within(2e-3, "K", "series.csv");
    let mut radiance = Worst::none();
    let (mut labels, mut shown) = (0, 0);
    for step in [0, 4, 8, 12] {
        let [device, cpu] =
            ["device", "cpu"].map(|name| frame(&folder.path(&format!("{name}/frames/step_{step:06}.exr"))));
        for (index, part) in cpu.part.iter().enumerate() {
            shown += usize::from(*part > 0);
            labels += usize::from(*part != device.part[index]);
            if *part > 0 && device.part[index] == *part && cpu.radiance[index] > 0.0 {
                let ratio = f64::from(device.radiance[index]) / f64::from(cpu.radiance[index]);
                radiance.see(ratio, 1.0, || format!("pixel {index} of step {step}"));
            }
        }
    }
    radiance.within(1e-4, "relative", "radiance of all frames");
    assert!(labels * 200 < shown, "{labels} of {shown} labels differ");
}

#[test]
fn an_existing_folder_is_not_touched() {
    let folder = Folder::new(SCENE);
    std::fs::create_dir_all(folder.path("out/frames")).expect("a folder");
    folder.write("out/frames/step_000000.exr", "the user's own");
    let before = files(&folder.path("out"));
    let refused = |arguments: &[&str]| {
        let (code, line) = refusal(&end(isotherm(folder.0.path(), arguments)));
        assert_eq!(code, Some(2), "{line}");
        line
    };
    let line = refused(&["run", "scene.toml", "-o", "out"]);
    assert!(line.contains("out is not empty") && line.contains("--force"), "{line}");
    let line = refused(&["run", "scene.toml", "-o", "out", "--force"]);
    assert!(line.contains("out has files, but no manifest"), "{line}");
    assert_eq!(files(&folder.path("out")), before);

    succeed(folder.0.path(), &["run", "scene.toml", "-o", "own"]);
    let first = files(&folder.path("own"));
    for name in ["notes.txt", "plots/mine.svg", "frames/step_mine.exr"] {
        folder.write(&format!("own/{name}"), "mine");
    }
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "own", "--force"]);
    let after = files(&folder.path("own"));
    assert!(["notes.txt", "plots/mine.svg", "frames/step_mine.exr"].iter().all(|name| after[*name] == b"mine"));
    assert!(first["series.csv"] == after["series.csv"] && after.len() == FILES.len() + 3);
    // A file that was changed is named before anything is removed.
    folder.write("own/plots/parts.svg", "drawn over");
    let before = files(&folder.path("own"));
    let line = refused(&["run", "scene.toml", "-o", "own", "--force"]);
    assert!(line.contains("own/plots/parts.svg is not as isotherm left it; move it away"), "{line}");
    assert_eq!(files(&folder.path("own")), before);
}

/// llvmpipe takes the number of its threads from `LP_NUM_THREADS`. With sixteen on a few cores workgroups run in another order each time. Other drivers
/// have no such setting, and then the test says that a run repeats.
#[test]
#[ignore = "long: tools/test --all"]
fn the_threads_of_the_driver_change_no_bit() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let mut scene = std::fs::read_to_string(models.join("station.toml")).expect("the station of models/");
    for (from, to) in [
        ("[exchange]\npatch_edge = 8.0\nrays = 512\n", ""),
        ("[shadows]\n", ""),
        ("steps = 360\n", "steps = 2\n"),
        ("warm_up = \"periodic\"\nwarm_up_tolerance = 0.05\nwarm_up_orbits = 40\n", ""),
        ("draw_every = 10\n", "draw_every = 1\n"),
        ("width = 1024\nheight = 768\n", "width = 256\nheight = 192\n"),
    ] {
        assert!(scene.contains(from), "the scene has no '{from}'");
        scene = scene.replace(from, to);
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("scene.toml"), scene).expect("a scene");
    std::fs::copy(models.join("station.glb"), folder.path().join("station.glb")).expect("a model");
    let [one, sixteen] = ["1", "16"].map(|threads| {
        let mut command = isotherm(folder.path(), &["run", "scene.toml", "-o", threads]);
        command.env("LP_NUM_THREADS", threads);
        let output = end(command);
        assert!(output.status.success(), "{}", stderr(&output));
        files(&folder.path().join(threads))
    });
    assert!(one.keys().eq(sixteen.keys()));
    for (name, bytes) in one.iter().filter(|(name, _)| !name.starts_with("report.")) {
        assert!(*bytes == sixteen[name], "{name} differs");
    }
}

#[test]
#[ignore = "long: tools/test --all"]
fn as_many_nodes_as_asked_are_checked_and_the_error_stands_beside_the_speed() {
    let folder = Folder::new(SCENE);
    let said = succeed(folder.0.path(), &["run", "--check", "scene.toml", "-o", "usual"]);
    assert!(said.contains("against the f64 reference: largest difference") && said.contains("ns a node"), "{said}");
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "few", "--check=20"]);
    let nodes = |name: &str| report(&files(&folder.path(name)))["accuracy"]["nodes"].as_u64().expect("a number");
    assert_eq!(nodes("few"), 20);
    assert!(nodes("usual") > 20, "all nodes of the craft, or 256");
    let (code, said) = refusal(&end(isotherm(folder.0.path(), &["run", "scene.toml", "-o", "none", "--check=0"])));
    assert!(code == Some(2) && said.contains("--check"), "{said}");
}

/// A folder named `-` was made, where every other command writes to standard output.
#[test]
fn a_folder_can_not_go_to_standard_output() {
    let folder = Folder::new(SCENE);
    for command in [&["run", "scene.toml"][..], &["compare", "scene.toml"], &["paper"], &["bench"]] {
        let output = end(isotherm(folder.0.path(), &[command, &["-o", "-"]].concat()));
        assert_eq!(output.status.code(), Some(2), "{command:?}");
        assert!(stderr(&output).contains("name a folder, such as out/run"), "{}", stderr(&output));
        assert!(!folder.path("-").exists(), "{command:?}");
    }
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "./-", "--device", "cpu"]);
    assert!(folder.path("-/series.csv").exists());
}
