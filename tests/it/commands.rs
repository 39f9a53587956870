//! The commands `info` and `radiance` of the built program, and the errors of every command.

use std::path::Path;

use isotherm::internals::{Band, band_radiance_exact};
use serde_json::Value;

use super::craft::{AREA, Folder, SCENE, scene_with};
use super::program::{end, isotherm, json, refusal, stderr, succeed};

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().expect("an object").keys().map(String::as_str).collect()
}

fn names(value: &Value, key: &str) -> Vec<String> {
    let list = value.as_array().expect("a list").iter();
    list.filter_map(|entry| entry[key].as_str().map(str::to_owned)).collect()
}

#[test]
fn info_of_devices() {
    let folder = Folder::new(SCENE);
    let text = succeed(folder.0.path(), &["info"]);
    let value = json(folder.0.path(), &["info", "--json"]);
    let devices = value["devices"].as_array().expect("a list");
    assert!(!devices.is_empty() && text.contains(devices[0]["name"].as_str().expect("a name")));
    assert!(text.contains("cpu") && text.contains("--device cpu"), "{text}");
    assert!(devices[0]["max_storage_buffer_range"].as_u64() >= Some(1 << 27), "what Vulkan 1.3 guarantees");
    assert_eq!(devices[0]["lacks"], Value::Array(Vec::new()));
}

#[test]
fn info_of_a_model_has_these_keys() {
    let folder = Folder::new(SCENE);
    let value = json(folder.0.path(), &["info", "made.glb", "--json"]);
    // The keys of the JSON are fixed.
    let promised = ["triangles", "vertices", "nodes", "area_m2", "bounds_m", "materials", "parts", "skipped"];
    assert_eq!(keys(&value), promised);
    assert_eq!((&value["triangles"], &value["nodes"]), (&18.into(), &4.into()));
    assert!((value["area_m2"].as_f64().expect("a number") / AREA - 1.0).abs() < 1e-7);
    assert_eq!(value["bounds_m"], serde_json::json!([[-1.0, -5.5, -3.0], [1.0, 5.5, 1.0]]));
    assert_eq!(names(&value["materials"], "name"), ["skin", "cells", "mast"]);
    assert_eq!(names(&value["parts"], "name"), ["body", "wing_port", "wing_starboard", "mast"]);
    assert_eq!(keys(&value["materials"][0]), ["name", "triangles", "area_m2"]);
    assert_eq!(value["materials"][1]["triangles"], 4);
    assert_eq!(value["skipped"], Value::Array(Vec::new()));
    let text = succeed(folder.0.path(), &["info", "made.glb"]);
    assert!(text.contains("18") && text.contains("normals computed"), "{text}");
}

/// The scene that `info MODEL --scene` prints can be run as it is.
#[test]
fn info_makes_a_scene_of_a_model() {
    let folder = Folder::new(SCENE);
    let scene = succeed(folder.0.path(), &["info", "made.glb", "--scene"]);
    folder.write("begun.toml", &scene);
    let checked = json(folder.0.path(), &["check", "begun.toml", "--json"]);
    assert_eq!(scene.matches("[[material]]").count(), 3, "{scene}");
    // As the tutorial begins: without exchange, cavities see nothing but space.
    assert!(scene.contains("[exchange]") && scene.contains("response = \"network\""), "{scene}");
    let quick = scene.replace("steps = 96", "steps = 1").replace("draw_every = 24", "draw_every = 1");
    folder.write("begun.toml", &quick.replace("warm_up", "# warm_up"));
    succeed(folder.0.path(), &["run", "begun.toml", "-o", "out"]);
    assert!(folder.path("out/frames/step_000001.exr").exists(), "{checked}");
}

/// The sphere has surfaces in balance alone, whose step has no pass of its own.
#[test]
fn no_printed_number_is_a_negative_zero() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let out = tempfile::tempdir().expect("a folder");
    let folder = out.path().join("out");
    let printed = succeed(&models, &["run", "sphere.toml", "-o", folder.to_str().expect("a path")]);
    let page = std::fs::read_to_string(folder.join("report.html")).expect("a report");
    for text in [printed, page] {
        assert!(!text.contains("-0.0 ") && !text.contains("-0.00") && !text.contains(">-0<"), "{text}");
    }
}

/// Passes, buffers and switched-off effects of a scene, as `info` prints them.
fn frame_of(scene: &str) -> (Value, Vec<String>, Vec<String>) {
    let folder = Folder::new(scene);
    let value = json(folder.0.path(), &["info", "scene.toml", "--json"]);
    let (passes, buffers) = (names(&value["frame"], "pass"), names(&value["buffers"], "name"));
    (value, passes, buffers)
}

#[test]
fn info_of_a_scene_and_what_is_absent_from_it() {
    let (value, passes, buffers) = frame_of(SCENE);
    let expected = [
        "thermal_step.instant.sun.planet_ir.albedo",
        "thermal_step.merge.sun.planet_ir.albedo",
        "thermal_step.merge.sun.planet_ir.albedo.both_sides",
        "absorbed_heat.comp",
        "absorbed_heat.target",
        "cull",
        "radiance",
        "read radiance",
        "read identity",
        "read temperatures",
    ];
    assert_eq!(passes, expected);
    assert!((value["area_m2"].as_f64().expect("a number") / AREA - 1.0).abs() < 1e-7, "areas sum to the mesh's");
    let by_response = value["nodes_by_response"].as_array().expect("a list");
    let sum: u64 = by_response.iter().filter_map(|entry| entry["nodes"].as_u64()).sum();
    assert_eq!(value["nodes"], sum);
    assert_eq!(
        names(&value["nodes_by_response"], "response"),
        ["instant", "transition (merge, power)", "transition (merge, power), both sides"]
    );
    let barriers = value["frame"].as_array().expect("a list").iter().filter(|step| step.get("barriers").is_some());
    assert!(barriers.count() >= 4);
    let bytes: u64 =
        value["buffers"].as_array().expect("a list").iter().filter_map(|entry| entry["bytes"].as_u64()).sum();
    assert_eq!(value["bytes"], bytes);
    let off = value["switched_off"].to_string();
    for word in ["self-shadowing", "joints in motion", "network", "reflected radiance", "sensor"] {
        assert!(off.contains(word), "{off}");
    }
    assert!(!off.contains("albedo") && !off.contains("Sun"), "{off}");
    for buffer in ["AlbedoValues", "Target", "Span", "Elapsed", "NormalX", "RadianceImage", "Triangles"] {
        assert!(buffers.iter().any(|name| name == buffer), "{buffer} of {buffers:?}");
    }

    let without = |changes: &[(&str, &str)], off: &str, pass: &str, gone: &[&str]| {
        let (value, passes, buffers) = frame_of(&scene_with(changes));
        assert!(value["switched_off"].to_string().contains(off), "{off}: {}", value["switched_off"]);
        assert!(!passes.iter().any(|name| name.contains(pass)), "{pass} of {passes:?}");
        assert!(!buffers.iter().any(|name| gone.contains(&name.as_str())), "{gone:?} of {buffers:?}");
    };
    without(&[("albedo = 0.3\n", "")], "albedo", "albedo", &["AlbedoValues"]);
    without(&[("planet_ir = 237\n", "")], "planet infrared", "planet_ir", &[]);
    without(&[("solar_constant = 1361\nalbedo = 0.3\n", "")], "Sun", "sun", &["AlbedoValues"]);
    without(&[("background_temperature = 2.7\n", "")], "background", "nothing", &[]);
    let images = ["RadianceImage", "IdentityImage", "DepthImage", "RadianceReadback", "Triangles", "PositionX"];
    without(&[("draw_every = 4", "draw_every = 0")], "sensor", "radiance", &images);
    without(&[("solar_constant = 1361\nalbedo = 0.3\nplanet_ir = 237\n", "")], "Sun", "sun", &["NormalX", "NormalZ"]);
    let transitions = SCENE
        .lines()
        .filter(|line| !["response", "retarget", "heating", "cooling"].iter().any(|key| line.starts_with(key)));
    let instant = transitions.map(|line| {
        if line.starts_with("sides") { format!("{line}\nresponse = \"instant\"\n") } else { format!("{line}\n") }
    });
    let (_, passes, buffers) = frame_of(&instant.collect::<String>());
    assert!(!passes.iter().any(|name| name.contains("merge")), "{passes:?}");
    assert!(!buffers.iter().any(|name| ["Target", "Span", "Elapsed"].contains(&name.as_str())), "{buffers:?}");
}

/// The rows of a CSV of two columns.
fn rows(text: &str, head: &str) -> Vec<(String, String)> {
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some(head));
    let pair = |line: &str| line.split_once(',').map(|(one, other)| (one.to_owned(), other.to_owned()));
    lines.map(|line| pair(line).expect("two columns")).collect()
}

#[test]
fn radiance_prints_csv() {
    let folder = Folder::new(SCENE);
    let at = folder.0.path();
    let forward = "temperature,radiance";
    let found = rows(&succeed(at, &["radiance", "--band", "8:14", "300", "267.5", "180", "2.7", "1e3"]), forward);
    assert_eq!(found.iter().map(|(t, _)| t.as_str()).collect::<Vec<_>>(), ["300", "267.5", "180", "2.7", "1000"]);
    for (temperature, radiance) in &found {
        let exact = band_radiance_exact(Band { lower: 8e-6, upper: 14e-6 }, temperature.parse().expect("a number"));
        let found: f64 = radiance.parse().expect("a number");
        assert!(
            (found - exact).abs() <= 2e-5 * exact || exact < 1e-38,
            "{radiance} at {temperature} K against {exact}"
        );
        let digits = radiance.chars().filter(char::is_ascii_digit).count();
        assert!(radiance == "0" || digits >= 9, "{radiance} has nine significant digits");
    }
    assert_eq!(found[3].1, "0", "2.7 K shines with nothing in f32");
    assert_eq!(rows(&succeed(at, &["radiance", "300"]), forward)[0], found[0], "8 to 14 um is the default");
    let cpu = rows(&succeed(at, &["radiance", "300", "--device", "cpu"]), forward);
    // docs/numerics.md 5.
    assert!(cpu[0].1.starts_with("54.93346"), "{cpu:?}");
    let shifted = rows(&succeed(at, &["radiance", "--band=8.001:14", "300"]), forward);
    assert!(shifted[0].1 != found[0].1, "the band counts");

    let inverse =
        rows(&succeed(at, &["radiance", "--band", "3:5", "--inverse", "1.5", "2.5e-9"]), "radiance,temperature");
    for (radiance, temperature) in inverse {
        let exact = band_radiance_exact(Band { lower: 3e-6, upper: 5e-6 }, temperature.parse().expect("a number"));
        let given: f64 = radiance.parse().expect("a number");
        assert!((exact / given - 1.0).abs() < 1e-4, "{temperature} K for {radiance}");
    }
    let output = end(isotherm(at, &["radiance", "300"]));
    assert!(stderr(&output).starts_with("device: "), "the device is named: {}", stderr(&output));
}

/// The scene without albedo, whose tables take most of the loading time.
fn quick() -> String {
    scene_with(&[("albedo = 0.3\n", "")])
}

/// Runs a command that must fail with exit code 2 and leave no files. Returns its message.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let list = || {
        let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
        entries.collect::<std::collections::BTreeSet<_>>()
    };
    let before = list();
    let output = end(isotherm(folder, arguments));
    let (code, line) = refusal(&output);
    assert_eq!(code, Some(2), "{arguments:?}: {}", stderr(&output));
    assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
    assert_eq!(list(), before, "{arguments:?} left something behind");
    assert!(!line.is_empty(), "{arguments:?}: {}", stderr(&output));
    line
}

#[test]
fn what_a_user_can_mend_is_refused_with_2() {
    let folder = Folder::new(&quick());
    folder.write("typo.toml", &scene_with(&[("albedo = 0.3", "albdo = 0.3")]));
    folder.write("black.toml", &scene_with(&[("emissivity = 0.83", "emissivity = -0.83")]));
    folder.write("absent.toml", &scene_with(&[("made.glb", "unmade.glb")]));
    folder.write("unmatched.toml", &scene_with(&[("match = \"mast\"", "match = \"masts\"")]));
    folder.write("broken.glb", "glTF");
    folder.write("empty.glb", "");
    folder.write("unnamed", "glTF\u{2}");
    folder.write("afile", "");
    let at = folder.0.path();
    let says = |arguments: &[&str], words: &[&str]| {
        let line = refused(at, arguments);
        for word in words {
            assert!(line.contains(word), "{arguments:?} says '{line}' without '{word}'");
        }
    };
    says(&["run", "typo.toml", "-o", "out"], &["typo.toml:20", "environment.albdo", "did you mean 'albedo'"]);
    says(&["run", "black.toml", "-o", "out"], &["black.toml:", "emissivity", "-0.83"]);
    says(&["run", "absent.toml", "-o", "out"], &["unmade.glb"]);
    says(&["run", "unmatched.toml", "-o", "out"], &["mast"]);
    says(&["run", "nowhere.toml", "-o", "out"], &["nowhere.toml"]);
    says(&["info", "nowhere.toml"], &["nowhere.toml"]);
    says(&["info", "nowhere.glb"], &["nowhere.glb"]);
    says(&["info", "broken.glb", "--json"], &["broken.glb"]);
    says(&["info", "empty.glb"], &["empty.glb: the file is empty"]);
    let model = [
        "is a model, and a scene is a TOML file",
        "path = \"made.glb\" under [model]",
        "isotherm info made.glb --scene",
    ];
    says(&["run", "made.glb", "-o", "out"], &model);
    says(&["check", "made.glb"], &model);
    says(&["run", "empty.glb", "-o", "out"], &["empty.glb: is a model"]);
    says(&["run", "unnamed", "-o", "out"], &["unnamed: is a model"]);
    says(&["network", "made.glb"], &["made.glb: cannot be read: it is not UTF-8 text, but a model (glTF)"]);
    says(&["run", "scene.toml", "-o", "out", "--device", "abacus"], &["abacus", "there are: '"]);
    says(&["render", "scene.toml", "--time", "60", "-o", "a.exr", "--device", "abacus"], &["abacus"]);
    says(&["radiance", "300", "--device", "abacus"], &["abacus"]);
    says(&["run", "scene.toml", "-o", "afile"], &["afile is a file"]);
    says(&["run", "scene.toml", "-o", "afile/below"], &["afile/below"]);
    says(&["render", "scene.toml", "--time", "60", "-o", "nowhere/a.exr"], &["nowhere"]);
    says(&["render", "scene.toml", "--time", "-1", "-o", "a.exr"], &["--time", "-1"]);
    says(&["render", "scene.toml", "--time", "nan", "-o", "a.exr"], &["--time"]);
    says(&["radiance", "--band", "14:8", "300"], &["1 to 50 micrometres"]);
    says(&["radiance", "--band", "0.5:8", "300"], &["1 to 50 micrometres"]);
    says(&["radiance", "--", "-3"], &["within 0 and 20000 K", "-3"]);
    says(&["radiance", "nan"], &["finite"]);
    says(&["radiance", "--inverse", "0"], &["positive"]);
    says(&["radiance", "--inverse", "1e-40"], &["below", "11.31 K"]);
    says(&["run", "scene.toml"], &["required arguments"]);
    says(&["rum", "scene.toml"], &["unrecognized subcommand"]);
    // Nobody can write to this folder, not even root.
    #[cfg(target_os = "linux")]
    says(&["run", "scene.toml", "-o", "/proc/isotherm"], &["/proc/isotherm"]);
    #[cfg(target_os = "linux")]
    says(&["render", "scene.toml", "--time", "60", "-o", "/proc/a.exr"], &["/proc"]);
}

#[test]
fn without_a_driver_it_says_what_to_install() {
    let folder = Folder::new(&quick());
    let at = folder.0.path();
    let blind = |arguments: &[&str]| {
        let mut command = isotherm(at, arguments);
        // Old loaders use one name, new loaders the other.
        command.env("VK_ICD_FILENAMES", "/nonexistent").env("VK_DRIVER_FILES", "/nonexistent");
        end(command)
    };
    for arguments in [
        &["run", "scene.toml", "-o", "out"][..],
        &["render", "scene.toml", "--time", "60", "-o", "a.exr"],
        &["info"],
        &["radiance", "300"],
    ] {
        let (code, line) = refusal(&blind(arguments));
        assert_eq!(code, Some(2), "{arguments:?}");
        assert!(line.contains("apt-get install mesa-vulkan-drivers") && line.contains("--device cpu"), "{line}");
        assert!(line.contains("/nonexistent can not be read"), "{line}");
    }
    assert!(!folder.path("out").exists() && !folder.path("a.exr").exists());
    // Some commands need no device.
    for arguments in [
        &["radiance", "300", "--device", "cpu"][..],
        &["render", "scene.toml", "--time", "60", "-o", "a.exr", "--device", "cpu"],
        &["info", "scene.toml"],
        &["info", "made.glb"],
        &["--help"],
        &["run", "--help"],
    ] {
        let output = blind(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    }
}

/// Each way in which drivers fail has its own message, and `--device cpu` works under all of them.
#[test]
fn drivers_that_do_not_work_are_named() {
    let folder = Folder::new(&quick());
    let at = folder.0.path();
    let manifest = |library: &str| {
        format!(r#"{{"file_format_version":"1.0.0","ICD":{{"library_path":"{library}","api_version":"1.3.0"}}}}"#)
    };
    let files = [
        ("cut.json", "{".to_owned(), "is not JSON"),
        ("absent.json", manifest("/nonexistent/libvk.so"), "/nonexistent/libvk.so, which does not exist"),
        ("other.json", manifest("libc.so.6"), "with the library libc.so.6"),
    ];
    let fails = |name: &str, value: &Path, parts: &[&str]| {
        let blind = |arguments: &[&str]| {
            let mut command = isotherm(at, arguments);
            command.env(name, value);
            if name == "VK_DRIVER_FILES" {
                command.env("VK_ICD_FILENAMES", value);
            }
            end(command)
        };
        let (code, line) = refusal(&blind(&["radiance", "300"]));
        assert_eq!(code, Some(2), "{line}");
        for part in parts.iter().chain(&["--device cpu", "apt-get install"]) {
            assert!(line.contains(part), "{part}: {line}");
        }
        let output = blind(&["radiance", "300", "--device", "cpu"]);
        assert!(output.status.success(), "{}", stderr(&output));
    };
    for (name, text, wrong) in &files {
        let file = folder.write(name, text);
        fails("VK_DRIVER_FILES", &file, &["no driver that works", name, wrong, "VK_LOADER_DEBUG"]);
    }
    // Drivers of hardware that is not there.
    let installed = std::fs::read_dir("/usr/share/vulkan/icd.d").into_iter().flatten().flatten();
    for driver in installed.map(|entry| entry.path()).filter(|path| path.to_string_lossy().contains("radeon")) {
        let named = driver.to_string_lossy().into_owned();
        fails("VK_DRIVER_FILES", &driver, &["no driver finds a device", &named, "VK_LOADER_DEBUG"]);
    }
    // No driver at all, and a loader that is none.
    let empty = folder.path("empty");
    std::fs::create_dir(&empty).expect("a folder");
    std::fs::write(empty.join("libvulkan.so.1"), "none").expect("a file");
    std::fs::write(empty.join("libvulkan.so"), "none").expect("a file");
    #[cfg(target_os = "linux")]
    fails("LD_LIBRARY_PATH", &empty, &["no Vulkan loader can be opened", "libvulkan.so"]);
}

#[test]
fn every_command_has_help_with_an_example() {
    let folder = Folder::new(SCENE);
    for command in ["run", "render", "check", "info", "radiance"] {
        let text = succeed(folder.0.path(), &[command, "--help"]);
        assert!(text.contains("Example") && text.contains(&format!("isotherm {command}")), "{text}");
    }
    assert_eq!(succeed(folder.0.path(), &["--version"]).trim(), format!("isotherm {}", env!("CARGO_PKG_VERSION")));
}
