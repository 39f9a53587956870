//! Real trajectories against published vectors and eclipses, and through the commands.

use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

use glam::DVec3;
use isotherm::Reach;
use isotherm::internals::{Boundary, SkyModel, SkyScene, albedo_flux, planet_ir_flux, solar_flux};

use super::craft::{Folder, SCENE, prepared, scene_with};
use super::program::{end, isotherm, json, refusal, succeed};

/// A file of `shared/data/orbit`. Prints a line if it is missing.
fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/orbit").join(name);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: ../shared/data absent ({name})");
    None
}

const TLE: &str = include_str!("../../models/iss.tle");

/// Time, orbit, attitude and environment without a model. `orbit` and `time` add keys to their sections.
fn sky_scene(orbit: &str, time: &str, planet_radius: f64) -> String {
    format!(
        "[time]\nstep = 60\nsteps = 1440\n{time}\n[orbit]\n{orbit}\n[attitude]\nmode = 'nadir'\n[environment]\n\
         solar_constant = 1361\nalbedo = 0.3\nplanet_ir = 237\nplanet_radius = {planet_radius}\n"
    )
}

fn sky(folder: &Path, text: &str) -> SkyModel {
    let path = folder.join("sky.toml");
    std::fs::write(&path, text).unwrap();
    let scene = SkyScene::load(&path, &Reach::of(&path)).unwrap_or_else(|error| panic!("{error}"));
    SkyModel::new(&scene.orbit, &scene.attitude, &scene.environment).unwrap()
}

fn rows(path: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let numbers = |line: &str| line.split(',').map(|cell| cell.parse().ok()).collect::<Option<Vec<f64>>>();
    text.lines().filter_map(numbers).collect()
}

/// skyfield with DE421.
#[test]
fn iss_and_sun_agree_with_published_vectors() {
    let Some(vectors) = shared("iss_gcrs_sun_60s.csv") else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("iss.tle"), TLE).unwrap();
    let sky = sky(folder.path(), &sky_scene("file = 'iss.tle'", "", 6371e3));
    let (mut position, mut angle, mut distance) = (0.0_f64, 0.0_f64, 0.0_f64);
    let rows = rows(&vectors);
    assert!(rows.len() > 1000);
    for row in &rows {
        let place = sky.point(row[0]).unwrap();
        let sun = DVec3::from_slice(&row[4..7]) * 1e3;
        position = position.max(place.position.distance(DVec3::from_slice(&row[1..4]) * 1e3));
        angle = angle.max(place.sun.angle_between(sun).to_degrees());
        distance = distance.max((place.sun.length() / sun.length() - 1.0).abs());
    }
    println!("ISS within {position:.1} m, Sun within {angle:.5} deg and {distance:.1e} of its distance");
    assert!(position < 1000.0, "{position} m");
    assert!(angle < 0.02, "{angle} deg");
    assert!(distance < 1e-4, "{distance}");
    let late = sky.point(rows[0][0] + 1.0).unwrap().position;
    assert!(late.distance(DVec3::from_slice(&rows[0][1..4]) * 1e3) > 1000.0, "a second is seen");
}

#[test]
fn eclipses_of_the_iss_agree_with_published_ones() {
    let Some(published) = shared("iss_eclipse_20231029_24h.csv") else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("iss.tle"), TLE).unwrap();
    let text = std::fs::read_to_string(&published).unwrap();
    let lines: Vec<Vec<&str>> =
        text.lines().filter(|line| line.starts_with('6')).map(|line| line.split(',').collect()).collect();
    let mut compared = 0;
    let mut worst = 0.0_f64;
    for radius in ["6371.0", "6378.137"] {
        let expected: Vec<_> = lines.iter().filter(|line| line[0] == radius).collect();
        let sky = sky(folder.path(), &sky_scene("file = 'iss.tle'", "", radius.parse::<f64>().unwrap() * 1e3));
        let events = sky.events(0.0, 86_400.0);
        assert_eq!(events.len(), expected.len(), "{radius} km");
        for (event, line) in events.iter().zip(expected) {
            let boundary = if event.boundary == Boundary::Penumbra { "penumbra" } else { "umbra" };
            assert_eq!([boundary, if event.entry { "entry" } else { "exit" }], [line[1], line[2]], "{line:?}");
            worst = worst.max((event.time - line[3].parse::<f64>().unwrap()).abs());
            compared += 1;
        }
    }
    println!("{compared} contacts within {worst:.4} s");
    assert!(compared >= 100 && worst < 0.5, "{compared} contacts, {worst} s");
    let other = sky(folder.path(), &sky_scene("file = 'iss.tle'", "", 6360e3)).events(0.0, 6000.0);
    assert!((other[0].time - lines[0][3].parse::<f64>().unwrap()).abs() > 0.5, "another radius is seen");
}

#[test]
fn the_station_s_own_ephemeris_is_exact_at_its_epochs_and_close_between() {
    let Some(oem) = shared("ISS_2025-057_24h.oem") else { return };
    let text = std::fs::read_to_string(&oem).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let of = |text: &str, orbit: &str| {
        std::fs::write(folder.path().join("iss.oem"), text).unwrap();
        sky(folder.path(), &sky_scene(&format!("file = 'iss.oem'\n{orbit}"), "start = '2025-02-26T12:00:00'", 6371e3))
    };
    let whole = of(&text, "");
    let high = of(&text, "degree = 15");
    let mut kept = 0;
    let half: String = text
        .lines()
        .filter(|line| {
            kept += usize::from(line.starts_with("2025-"));
            !line.starts_with("2025-") || kept % 2 == 1
        })
        .map(|line| format!("{line}\n"))
        .collect();
    let half = of(&half, "");
    let (mut between, mut left_out) = (0.0_f64, 0.0_f64);
    for line in text.lines().filter(|line| line.starts_with("2025-")) {
        let numbers: Vec<f64> = line.split_whitespace().skip(1).map(|cell| cell.parse().unwrap()).collect();
        let clock: Vec<f64> = line[9..21].split(':').map(|cell| cell.parse().unwrap()).collect();
        let day: f64 = line[5..8].parse().unwrap();
        let time = (day - 57.0) * 86_400.0 + clock[0] * 3600.0 + clock[1] * 60.0 + clock[2] - 43_200.0;
        let position = DVec3::from_slice(&numbers[..3]) * 1e3;
        let found = whole.point(time).unwrap().position;
        assert!(found.distance(position) < 1e-6, "{line}: {found}");
        if let Some(place) = half.point(time) {
            left_out = left_out.max(place.position.distance(position));
        }
        for later in [37.0, 120.0, 201.0] {
            if let (Some(place), Some(reference)) = (whole.point(time + later), high.point(time + later)) {
                between = between.max(place.position.distance(reference.position));
            }
        }
    }
    println!("between epochs within {between:.2} m of degree 15; every second left out: {left_out:.2} m");
    assert!(between > 0.0 && between < 500.0, "{between} m");
    assert!(left_out > 0.0 && left_out < 500.0, "{left_out} m");
    assert!(
        of(&text, "interpolation = 'linear'")
            .point(120.0)
            .unwrap()
            .position
            .distance(whole.point(120.0).unwrap().position)
            > 500.0
    );
}

/// The integral over the planet's disc, summed direction by direction without closed formulas.
fn by_directions(ratio: f64, tilt: f64, azimuth: f64, sun_zenith: f64) -> [f64; 2] {
    const RINGS: u32 = 400;
    const SECTORS: u32 = 400;
    let normal = DVec3::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), tilt.cos());
    let sun = DVec3::new(sun_zenith.sin(), 0.0, -sun_zenith.cos());
    let limb = (1.0 / ratio).asin();
    let mut sums = [0.0; 2];
    for ring in 0..RINGS {
        let share = (f64::from(ring) + 0.5) / f64::from(RINGS);
        // Rings are denser at the limb, where the ground's angle changes fast.
        let angle = limb * share * share * (3.0 - 2.0 * share);
        let width = limb * 6.0 * share * (1.0 - share) / f64::from(RINGS);
        for sector in 0..SECTORS {
            let (sin, cos) = (TAU * (f64::from(sector) + 0.5) / f64::from(SECTORS)).sin_cos();
            let sight = DVec3::new(angle.sin() * cos, angle.sin() * sin, angle.cos());
            let weight = normal.dot(sight).max(0.0) * angle.sin() * width * TAU / f64::from(SECTORS) / PI;
            let down = ratio * angle.cos();
            let ground = sight * (down - (down * down - (ratio * ratio - 1.0)).max(0.0).sqrt()) - DVec3::Z * ratio;
            sums[0] += weight;
            sums[1] += weight * ground.dot(sun).max(0.0);
        }
    }
    sums
}

#[test]
fn a_plate_of_the_command_agrees_with_a_sum_over_directions() {
    let folder = tempfile::tempdir().unwrap();
    let plate = |altitude: f64, angles: [f64; 3]| {
        let [tilt, azimuth, sun] = angles.map(|angle| angle.to_string());
        let altitude = altitude.to_string();
        let arguments = ["environment", "plate", "--altitude", &altitude, "--nadir-angle", &tilt];
        let more = ["--azimuth", &azimuth, "--sun-zenith", &sun, "--json"];
        json(folder.path(), &[&arguments[..], &more[..]].concat())
    };
    let number = |value: &serde_json::Value, key: &str| value[key].as_f64().expect("a number");
    for (altitude, angles) in [
        (100e3, [0.0, 0.0, 0.0]),
        (100e3, [90.0, 30.0, 92.0]),
        (408e3, [40.0, 200.0, 90.0]),
        (408e3, [90.0, 0.0, 100.0]),
        (408e3, [155.0, 10.0, 75.0]),
        (2e6, [120.0, 300.0, 110.0]),
        (35_786e3, [80.0, 90.0, 90.0]),
        (35_786e3, [60.0, 180.0, 120.0]),
    ] {
        let value = plate(altitude, angles);
        let [tilt, azimuth, sun] = angles.map(f64::to_radians);
        let [view, albedo] = by_directions(1.0 + altitude / 6371e3, tilt, azimuth, sun);
        assert!((number(&value, "view_factor") - view).abs() < 1e-4, "{altitude} {angles:?}: {value} {view}");
        assert!((number(&value, "albedo_factor") - albedo).abs() < 1e-4, "{altitude} {angles:?}: {value} {albedo}");
        assert!((number(&value, "planet_ir_w_m2") - 237.0 * view).abs() < 237e-4);
        assert!((number(&value, "albedo_w_m2") - 0.3 * 1361.0 * albedo).abs() < 0.3 * 1361e-4);
        let other = plate(altitude, [angles[0] + 2.0, angles[1], angles[2] - 2.0]);
        let apart = (number(&other, "view_factor") - view).abs() + (number(&other, "albedo_factor") - albedo).abs();
        assert!(apart > 2e-4, "{altitude} {angles:?}: two degrees must be seen");
    }
    let text = succeed(folder.path(), &["environment", "plate", "--altitude", "4e5", "--nadir-angle", "0"]);
    assert!(text.contains("view factor"), "{text}");
    for (key, value) in [("--altitude", "-1"), ("--albedo", "1.5"), ("--planet-radius", "nan")] {
        let mut arguments = vec!["environment", "plate", "--nadir-angle", "0", key, value];
        if key != "--altitude" {
            arguments.extend(["--altitude", "4e5"]);
        }
        let (code, line) = refusal(&end(isotherm(folder.path(), &arguments)));
        assert!(code == Some(2) && line.contains(key.trim_start_matches('-')), "{line}");
    }
}

const ORBIT: &[(&str, &str)] =
    &[("altitude = 408e3\nperiod = 5553.6\nbeta_deg = 20\nphase_deg = 80\n", "file = 'iss.tle'\n")];

#[test]
fn the_environment_of_a_scene_is_that_of_its_run() {
    let folder = Folder::new(&scene_with(ORBIT));
    folder.write("iss.tle", TLE);
    let said = succeed(folder.0.path(), &["environment", "scene.toml", "-o", "env.csv"]);
    assert!(said.contains("env.events.csv"), "{said}");
    let mut reader = csv::Reader::from_path(folder.path("env.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let table: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(table.len(), 13);
    let column = |name: &str| header.iter().position(|cell| cell == name).unwrap_or_else(|| panic!("{name}"));
    assert_eq!(&table[1][column("utc")], "2023-10-29T17:04:44.412Z");
    let prepared = folder.prepared();
    for row in &table {
        let number = |name: &str| row[column(name)].parse::<f64>().unwrap();
        let load = prepared.loads.step_load(number("time_s"), number("time_s"));
        for (face, normal) in [("+X", DVec3::X), ("-Y", DVec3::NEG_Y), ("+Z", DVec3::Z), ("-Z", DVec3::NEG_Z)] {
            let close = |what: &str, found: f64, tolerance: f64| {
                let expected = number(&format!("{what}_{face}_w_m2"));
                assert!((found - expected).abs() < tolerance, "{what} {face}: {found} {expected}");
            };
            close("solar", solar_flux(&load, normal), 1e-3);
            close("planet_ir", planet_ir_flux(&load, normal), 1e-4);
            close("albedo", albedo_flux(&load, normal), 1e-4 * 1361.0 * 0.3);
        }
        // Late October: 0.9931 au.
        assert!((number("sun_distance_m") / 149_597_870_700.0 - 0.9931).abs() < 2e-4);
        assert!((number("solar_flux_w_m2") / 1361.0 - 0.9931_f64.powi(-2)).abs() < 1e-3);
        assert!((number("planet_z") - 1.0).abs() < 1e-9);
    }
    let events = std::fs::read_to_string(folder.path("env.events.csv")).unwrap();
    assert_eq!(events.lines().next(), Some("time_s,utc,boundary,event"));
}

#[test]
fn a_scene_on_a_real_trajectory_runs_and_its_files_are_named() {
    let folder = Folder::new(&scene_with(ORBIT));
    folder.write("iss.tle", TLE);
    let first = prepared(&folder.path("scene.toml"));
    assert!(first.scene.files.iter().any(|path| path.ends_with("iss.tle")));
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    assert!(folder.path("out/frames/step_000012.exr").exists() && folder.path("out/report.json").exists());
    let report = std::fs::read_to_string(folder.path("out/report.json")).unwrap();
    assert!(report.contains("iss.tle") && report.contains("SGP4"));
    folder.write("iss.tle", &format!("{TLE}\n"));
    assert_ne!(prepared(&folder.path("scene.toml")).hashes.all, first.hashes.all, "the file is part of the hash");
}

#[test]
fn what_a_trajectory_does_not_cover_is_refused_with_its_range() {
    let rows = |times: std::ops::Range<u32>| -> String {
        let row = |index: u32| {
            let time = f64::from(index) * 60.0;
            let (sin, cos) = (1.1e-3 * time).sin_cos();
            format!("{time},{},{},0\n", 6.8e6 * cos, 6.8e6 * sin)
        };
        times.map(row).collect()
    };
    let of_table = "file = 'table.csv'\nframe = 'GCRF'\n";
    let folder =
        Folder::new(&scene_with(&[(ORBIT[0].0, of_table), ("step = 60\n", "start = '2024-03-01'\nstep = 60\n")]));
    let run = |arguments: &[&str]| refusal(&end(isotherm(folder.0.path(), arguments)));
    let environment = ["environment", "scene.toml", "-o", "env.csv"];

    folder.write("table.csv", &format!("time,x,y,z\n{}", rows(0..20)));
    succeed(folder.0.path(), &environment);
    std::fs::remove_file(folder.path("env.csv")).unwrap();
    for (table, expected) in [
        (rows(0..10), "it covers 2024-03-01T00:00:00.000Z to 2024-03-01T00:09:00.000Z"),
        (format!("{}{}", rows(0..5), rows(9..20)), "with gaps: 2024-03-01T00:04:00.000Z to 2024-03-01T00:09:00.000Z"),
    ] {
        folder.write("table.csv", &format!("time,x,y,z\n{table}"));
        for arguments in [&environment[..], &["run", "scene.toml", "-o", "out", "--device", "cpu"][..]] {
            let (code, line) = run(arguments);
            assert!(code == Some(2) && line.contains(expected), "{line}");
        }
        assert!(!folder.path("env.csv").exists());
    }
    folder.write("table.csv", "time,x,y,z\n0,1,2\n");
    let (code, line) = run(&environment);
    assert!(code == Some(2) && line.contains("table.csv:2: row"), "{line}");
    folder.write("scene.toml", &SCENE.replace("altitude = 408e3", "altitude = 408e3\nfile = 'x.oem'"));
    let (code, line) = run(&environment);
    assert!(code == Some(2) && line.contains("scene.toml:") && line.contains("orbit.altitude"), "{line}");
}

#[test]
fn a_file_that_the_scene_reads_is_never_written_over() {
    let folder = Folder::new(&scene_with(ORBIT));
    folder.write("iss.tle", TLE);
    let scene = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
    for arguments in [
        &["environment", "scene.toml", "-o", "iss.tle"][..],
        &["environment", "scene.toml", "-o", "./scene.toml"],
        &["render", "scene.toml", "--time", "0", "-o", "iss.tle", "--device", "cpu"],
        &["run", "scene.toml", "-o", "out", "--trace", "scene.toml", "--device", "cpu"],
    ] {
        let (code, line) = refusal(&end(isotherm(folder.0.path(), arguments)));
        assert!(code == Some(2) && line.contains("name another"), "{arguments:?}: {line}");
    }
    assert_eq!(std::fs::read_to_string(folder.path("iss.tle")).unwrap(), TLE);
    assert_eq!(std::fs::read_to_string(folder.path("scene.toml")).unwrap(), scene);
}

/// No command removes its own inputs with --force.
#[test]
fn no_folder_is_emptied_of_what_is_read() {
    let bulk = "thickness = 0.002\ndensity = 2700\nspecific_heat = 900\nconductivity = 200\n";
    let [skin, cells] = ["skin", "cells"].map(|name| format!("match = \"{name}\"\n"));
    let with_bulk = [&skin, &cells].map(|material| format!("{material}{bulk}"));
    for (name, arguments) in [
        ("series.csv", &["run", "scene.toml"][..]),
        ("compare.csv", &["compare", "scene.toml"]),
        ("checks.csv", &["paper", "--scene", "scene.toml"]),
        ("bench.json", &["bench", "--only", "frames", "--scene", "scene.toml"]),
        ("bench.json", &["bench", "--only", "models", "--model-scene", "scene.toml"]),
    ] {
        let orbit: Vec<(&str, String)> =
            ORBIT.iter().map(|(from, to)| (*from, to.replace("iss.tle", &format!("out/{name}")))).collect();
        let mut changes: Vec<(&str, &str)> = orbit.iter().map(|(from, to)| (*from, to.as_str())).collect();
        changes.extend([(skin.as_str(), with_bulk[0].as_str()), (cells.as_str(), with_bulk[1].as_str())]);
        let folder = Folder::new(&scene_with(&changes));
        std::fs::create_dir(folder.path("out")).unwrap();
        folder.write(&format!("out/{name}"), TLE);
        let all = [arguments, &["-o", "out", "--force", "--device", "cpu"]].concat();
        let (code, line) = refusal(&end(isotherm(folder.0.path(), &all)));
        assert!(code == Some(2) && line.contains(name) && line.contains("name another"), "{all:?}: {line}");
        assert_eq!(std::fs::read_to_string(folder.path(&format!("out/{name}"))).unwrap(), TLE, "{all:?}");
    }
}

/// Grazing eclipses come and go with beta. A trajectory must have the same contacts as the circular orbit.
#[test]
fn short_eclipses_of_a_trajectory_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let (radius, rate) = (6.8e6, (3.986_004_418e14_f64 / 6.8e6_f64.powi(3)).sqrt());
    // On 20 March the Sun is near +X. The plane is turned about Y so that the Sun is beta above it.
    let mut found = Vec::new();
    for tenth in 0..60 {
        let beta = (66.0 + 0.1 * f64::from(tenth)).to_radians();
        let row = |index: u32| {
            let (sin, cos) = (rate * f64::from(index) * 60.0).sin_cos();
            let along = DVec3::new(beta.cos(), 0.0, -beta.sin()) * cos + DVec3::Y * sin;
            format!("{},{},{},{}\n", index * 60, radius * along.x, radius * along.y, radius * along.z)
        };
        let table: String = (0..100).map(row).collect();
        std::fs::write(folder.path().join("table.csv"), format!("time,x,y,z\n{table}")).unwrap();
        let orbit = "file = 'table.csv'\nframe = 'GCRF'";
        let sky = sky(folder.path(), &sky_scene(orbit, "start = '2024-03-20T03:06:00'", 6371e3));
        let events = sky.events(0.0, 5900.0);
        // Checked every second.
        let dark = (0..5900).map(|second| sky.lit_fraction(f64::from(second)) < 1.0).collect::<Vec<_>>();
        let changes = dark.windows(2).filter(|pair| pair[0] != pair[1]).count();
        let penumbra = events.iter().filter(|event| event.boundary == Boundary::Penumbra).count();
        assert!(penumbra >= changes, "beta {}: {penumbra} contacts, {changes} seen", beta.to_degrees());
        assert!(penumbra <= changes + 2, "beta {}: {penumbra} contacts, {changes} seen", beta.to_degrees());
        for event in &events {
            let lit = |time: f64| sky.lit_fraction(time);
            let free = if event.entry { event.time - 0.01 } else { event.time + 0.01 };
            assert!(event.boundary == Boundary::Umbra || lit(free) == 1.0, "{event:?}");
        }
        found.push(penumbra);
    }
    assert!(found.contains(&0) && found.contains(&2), "the eclipse must end within these angles: {found:?}");
}
