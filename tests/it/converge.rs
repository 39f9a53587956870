//! The command `converge` of the built program: known errors of settings, the choice within a bound, and what it refuses.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;
use std::process::Stdio;

use serde_json::json;

use super::craft::{Folder, SCENE, glb_of_box, scene_with};
use super::model::make::Maker;
use super::program::{end, isotherm, stderr, succeed};

/// Heat capacity of the plate [J/(m2 K)], length of a step [s], and steps of the run.
const CAPACITY: f64 = 200.0;
const STEP: f64 = 60.0;
const STEPS: u32 = 10;

/// A box whose face away from the planet turns from the Sun at 544 cos(20 deg + 2 pi t / 5553.6 s) W/m2. The camera sees this face alone.
fn plate() -> Folder {
    let folder = Folder::new(&format!(
        "name = \"plate\"\n[model]\npath = \"made.glb\"\n[time]\nstep = {STEP}\nsteps = {STEPS}\ndraw_every = 5\n\
         [orbit]\naltitude = 408e3\nperiod = 5553.6\nphase_deg = 20\n[attitude]\nmode = \"nadir\"\n\
         [environment]\nsolar_constant = 1361\neclipse = false\n[shadows]\n[initial]\ntemperature = 300\n\
         [[material]]\nmatch = \"skin\"\nabsorptivity = 0.4\nemissivity = 0.63\nsides = \"outside\"\nresponse = \"radiative\"\n\
         heat_capacity_per_area = {CAPACITY}\n\
         [radiance]\nband_um = [8, 14]\n[camera]\nwidth = 24\nheight = 24\nfov_deg = 40\nframe = \"body\"\nposition = [0, 0, -4]\n\
         look_at = [0, 0, 0]\nup = [1, 0, 0]\n"
    ));
    glb_of_box().save(folder.0.path());
    folder
}

/// Temperature of the plate after 300 and 600 s [K] under the mean load of each step, by the classical Runge-Kutta method. With steps of 60 s scipy's
/// DOP853 at rtol 1e-11 gives 332.566733 and 304.812789, with 30 s 332.174486 and 304.259149, under the load of every moment 332.037269 and 304.069591.
fn truth(capacity: f64, step: f64) -> [f64; 2] {
    let angle = |time: f64| 20f64.to_radians() + TAU * time / 5553.6;
    let parts = (10.0 * step) as u32;
    let mut kelvin = 300.0f64;
    let mut drawn = Vec::new();
    for number in 0..(600.0 / step).round() as u32 {
        let [from, to] = [number, number + 1].map(|number| angle(f64::from(number) * step));
        let mean = 0.4 * 1361.0 * (to.sin() - from.sin()) / (to - from);
        let rate = |kelvin: f64| (mean - 0.63 * 5.670374419e-8 * kelvin.powi(4)) / capacity;
        let h = step / f64::from(parts);
        for _ in 0..parts {
            let a = rate(kelvin);
            let b = rate(kelvin + h / 2.0 * a);
            let c = rate(kelvin + h / 2.0 * b);
            let d = rate(kelvin + h * c);
            kelvin += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
        }
        if ((f64::from(number + 1) * step) % 300.0).abs() < 1e-6 {
            drawn.push(kelvin);
        }
    }
    [drawn[0], drawn[1]]
}

/// Root mean square difference of the three images, the first of which is at time 0 [K].
fn apart(one: [f64; 2], other: [f64; 2]) -> f64 {
    (one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / 3.0).sqrt()
}

/// The rows of `converge.csv` by setting.
fn table(path: &Path) -> BTreeMap<String, BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).expect("the table");
    let head = reader.headers().expect("a head").clone();
    let rows = reader.records().map(|row| row.expect("a row"));
    rows.map(|row| (row[0].to_owned(), head.iter().map(str::to_owned).zip(row.iter().map(str::to_owned)).collect()))
        .collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} = '{}' is a number", row[column]))
}

#[test]
fn a_plate_in_long_steps_has_the_known_error() {
    let folder = plate();
    let [coarse, fine, exact] = [STEP, STEP / 2.0, 0.5].map(|step| truth(CAPACITY, step));
    for (mine, scipy) in [coarse, fine, exact]
        .iter()
        .flatten()
        .zip([332.566733, 304.812789, 332.174486, 304.259149, 332.037269, 304.069591])
    {
        assert!((mine - scipy).abs() < 2e-4, "{mine} for {scipy}");
    }
    let out = succeed(folder.0.path(), &["converge", "scene.toml", "-o", "out", "--within", "0.6"]);
    let rows = table(&folder.path("out/converge.csv"));
    println!("{out}");
    let change = number(&rows["time.step"], "change_rms_k");
    let is_known = |known: f64| (change - known).abs() < 0.01 * known;
    assert!(is_known(apart(coarse, fine)), "{change} K for {} K", apart(coarse, fine));
    // A plate that stores more must show.
    assert!(!is_known(apart(truth(1.1 * CAPACITY, STEP), truth(1.1 * CAPACITY, STEP / 2.0))));
    for setting in ["model.max_edge", "shadows.spacing", "shadows.redraw_angle_deg"] {
        assert!(number(&rows[setting], "change_max_k") < 2e-3, "{setting}: {out}");
        assert!((number(&rows[setting], "from_finest_rms_k") - change).abs() < 2e-3, "{setting}: {out}");
    }
    assert!(rows.len() == 6 && number(&rows["time.step"], "from_finest_max_k") < 2e-3, "{out}");

    // The difference from the finest run and its estimated error are no less than the true error, 0.53 K, and at most twice as much.
    let left = out.split("itself off by about ").nth(1).and_then(|text| text.split(' ').next()).expect("an estimate");
    let stated = number(&rows["as it is"], "from_finest_rms_k") + left.parse::<f64>().expect("a number");
    let error = apart(coarse, exact);
    assert!(error <= stated && stated < 2.0 * error, "{stated} K for {error} K");

    // 0.78 K are too much for the scene as it is. Half the step leaves 0.39 K.
    assert!(out.contains("within 0.6 K rms at the least cost: time.step = 30:"), "{out}");
    let settings: toml::Table =
        std::fs::read_to_string(folder.path("out/settings.toml")).expect("settings").parse().expect("TOML");
    assert_eq!(settings.len(), 1);
    let time = &settings["time"];
    assert_eq!([&time["step"], &time["steps"], &time["draw_every"]].map(ToString::to_string), ["30", "20", "10"]);
    let plot = std::fs::read_to_string(folder.path("out/converge.svg")).expect("a plot");
    assert!(plot.contains("time.step = 30") && plot.contains("within 0.6 K"));
}

/// The error of the finest run is not known, so no bound below it is shown to be met.
#[test]
fn the_finest_settings_are_never_said_to_be_within() {
    let folder = plate();
    // Edges longer than the craft, and a name that Rust and TOML escape differently.
    let scene = std::fs::read_to_string(folder.path("scene.toml")).expect("a scene");
    folder.write("scene.toml", &format!("{scene}[[part]]\nmatch = [\"no\u{a0}part\", \"*\"]\nmax_edge = 80\n"));
    let out = succeed(folder.0.path(), &["converge", "scene.toml", "-o", "out", "--within", "0.3", "--device", "cpu"]);
    assert!(out.contains("nothing that was tested is shown to be within 0.3 K rms"), "{out}");
    assert!(!out.contains("at the least cost"), "{out}");
    let settings = std::fs::read_to_string(folder.path("out/settings.toml")).expect("settings");
    let parsed: toml::Table = settings.parse().expect("TOML");
    assert!(settings.contains("nothing that was tested") && settings.contains("The finest settings follow"));
    assert!(
        parsed["time"]["step"].as_integer() == Some(30)
            && parsed["shadows"]["redraw_angle_deg"].as_float() == Some(0.0625)
    );
    assert_eq!(parsed["part"][0]["match"][0].as_str(), Some("no\u{a0}part"));

    // A bound that the scene meets leaves it as it is.
    let out = succeed(
        folder.0.path(),
        &["converge", "scene.toml", "-o", "out", "--force", "--within", "0.9", "--device", "cpu"],
    );
    assert!(out.contains("within 0.9 K rms at the least cost: the settings of the scene:"), "{out}");
    let settings = std::fs::read_to_string(folder.path("out/settings.toml")).expect("settings");
    assert!(settings.contains("stays as it is") && settings.parse::<toml::Table>().expect("TOML").is_empty());
}

/// A sheet in a standing Sun beside a box 0.3 m proud of it. `quaternion` turns the craft, so that the box shades the sheet or not.
fn sheet(quaternion: &str) -> Folder {
    let material = |name: &str, capacity: u32| {
        format!(
            "[[material]]\nmatch = \"{name}\"\nabsorptivity = 0.6\nemissivity = 0.8\nsides = \"outside\"\nresponse = \"radiative\"\n\
             heat_capacity_per_area = {capacity}\n"
        )
    };
    let folder = Folder::new(&format!(
        "name = \"sheet\"\n[model]\npath = \"made.glb\"\nmax_edge = 1\n[time]\nstep = 60\nsteps = 20\ndraw_every = 10\n\
         [orbit]\naltitude = 408e3\nbeta_deg = 50\n[attitude]\nmode = \"inertial\"\nquaternion = {quaternion}\n\
         [environment]\nsolar_constant = 1361\neclipse = false\n[shadows]\n[initial]\ntemperature = 300\n{}{}\
         [radiance]\nband_um = [8, 14]\n[camera]\nwidth = 48\nheight = 36\nfov_deg = 50\nframe = \"body\"\nposition = [5, -4, 5]\n\
         look_at = [1, 0, 0]\nup = [0, 0, 1]\n",
        material("skin", 4860),
        material("cells", 2430)
    ));
    let mut maker = Maker::cube();
    for name in ["skin", "cells"] {
        maker.push("materials", json!({ "name": name }));
    }
    maker.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    maker.json["nodes"][0]["scale"] = json!([1.0, 2.0, 0.15]);
    maker.json["nodes"][0]["translation"] = json!([-1.0, 0.0, 0.15]);
    let positions = maker.floats(&[[0.0, -2.0, 0.0], [4.0, -2.0, 0.0], [4.0, 2.0, 0.0], [0.0, 2.0, 0.0]]);
    let indices = maker.accessor(&[0u8, 1, 2, 0, 2, 3], json!({"componentType": 5121, "count": 6, "type": "SCALAR"}));
    let mesh = maker.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices, "material": 1}));
    let index = maker.push("nodes", json!({"name": "sheet", "mesh": mesh}));
    maker.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(index));
    maker.save(folder.0.path());
    folder
}

/// Light on areas is exact where no shadow falls, whatever the mesh. Where the shadow of the box falls, the mesh decides.
#[test]
fn settings_that_do_not_matter_change_nothing() {
    let largest = |quaternion: &str, setting: &str| {
        let folder = sheet(quaternion);
        let out = succeed(folder.0.path(), &["converge", "scene.toml", "-o", "out", "--device", "cpu"]);
        println!("{out}");
        number(&table(&folder.path("out/converge.csv"))[setting], "change_max_k")
    };
    let none = largest("[1, 0, 0, 0]", "all finer");
    assert!(none < 0.01, "{none} K without a shadow");
    let shaded = largest("[0, 0, 0, 1]", "model.max_edge");
    assert!(shaded > 1.0, "{shaded} K in a shadow");
}

#[test]
fn poses_of_a_table_take_the_place_of_images() {
    let folder = plate();
    folder.write("poses.csv", "time,x,y,z,qw,qx,qy,qz\n300,0,0,-4,1,0,0,0\n600,0,0,-4,1,0,0,0\n");
    let out =
        succeed(folder.0.path(), &["converge", "scene.toml", "-o", "out", "--poses", "poses.csv", "--device", "cpu"]);
    assert!(out.contains("pixels of 2 images"), "{out}");
    let rows = table(&folder.path("out/converge.csv"));
    assert_eq!((rows["as it is"]["steps"].as_str(), rows["time.step"]["steps"].as_str()), ("10", "20"));
    // The largest change is the known one at 600 s.
    let change = number(&rows["time.step"], "change_max_k");
    let known = truth(CAPACITY, STEP)[1] - truth(CAPACITY, STEP / 2.0)[1];
    assert!((change - known).abs() < 0.01 * known, "{change} K for {known} K");
}

#[test]
fn what_can_not_be_compared_is_refused() {
    let folder = Folder::new(SCENE);
    let refused = |scene: &str, arguments: &[&str], says: &str| {
        folder.write("scene.toml", scene);
        let output = end(isotherm(folder.0.path(), &[&["converge", "scene.toml"], arguments].concat()));
        assert!(output.status.code() == Some(2) && stderr(&output).contains(says), "{}", stderr(&output));
        assert!(!folder.path("out").exists());
    };
    for within in ["0", "-1", "nan", "inf", "warm"] {
        refused(SCENE, &["-o", "out", &format!("--within={within}")], "must be a number above 0 [K]");
    }
    refused(
        &scene_with(&[("draw_every = 4", "draw_every = 0")]),
        &["-o", "out"],
        "has no images, and converge compares pixels",
    );
    refused(SCENE, &["-o", "out", "--poses", "none.csv"], "none.csv");
    folder.write("file", "");
    refused(SCENE, &["-o", "file"], "file");
    refused(SCENE, &["-o", "file/out"], "file/out");
    refused(SCENE, &["-o", "-"], "name a folder");
    let away = scene_with(&[("look_at = [0, 0, 0]", "look_at = [20, 10, -15]"), ("steps = 12", "steps = 4")]);
    refused(&away, &["-o", "out", "--device", "cpu"], "no pixel of its images shows the craft");
}

/// A scene of many steps tells its forecast before its first run has ended.
#[cfg(unix)]
#[test]
fn a_signal_after_the_forecast_leaves_nothing() {
    let folder =
        Folder::new(&scene_with(&[("steps = 12", "steps = 100000"), ("draw_every = 4", "draw_every = 50000")]));
    let mut command = isotherm(folder.0.path(), &["converge", "scene.toml", "-o", "out"]);
    let log = folder.path("log");
    command.stdout(Stdio::piped()).stderr(std::fs::File::create(&log).expect("a log"));
    let told = || std::fs::read_to_string(&log).expect("the log");
    let forecast = "forecast from measured steps: about ";
    let output = super::run_stopped::interrupted(command, "INT", || told().contains(forecast));
    let told = told();
    assert!(output.status.code() == Some(1) && told.contains("error: stopped"), "{told}");
    // What the runs take at least comes first, for the finest settings may take long to measure.
    let least = told.find(" at least; a few steps with all settings finer are measured next").expect("the least time");
    assert!(least < told.find(forecast).expect("the forecast"), "{told}");
    assert!(!told.contains("these took"), "the first two runs had not ended: {told}");
    assert!(!folder.path("out").exists());
}
