//! Errors of SPEC files and folders, as users see them.

use std::path::Path;

use isotherm::dataset::error::DatasetError;
use isotherm::dataset::spec::Spec;
use isotherm::dataset::store::Begin;

use super::super::program::{end, isotherm, refusal};
use super::{SPEC, Workshop};

#[test]
fn a_wrong_spec_is_refused_with_line_and_key() {
    for (from, to, expected) in [
        (
            "poses_per_orbit = 2",
            "poses_per_orbits = 2",
            "spec.toml:3: poses_per_orbits: unknown key; did you mean 'poses_per_orbit'?",
        ),
        ("samples = 6", "samples = 0", "spec.toml:2: samples: expected a whole number from 1"),
        ("samples = 6", "", "samples: is missing"),
        ("[0, 0.1]", "[0.1, 0]", "time.orbits: uniform must run from low to high"),
        ("log_uniform = [9, 40]", "log_uniform = [-9, 40]", "camera.distance: log_uniform must begin above 0"),
        (
            "log_uniform = [9, 40]",
            "log_unifrom = [9, 40]",
            "'log_unifrom' is no distribution; did you mean 'log_uniform'?",
        ),
        ("log_uniform = [9, 40]", "uniform = [-1, 40]", "camera.distance: may be -1 to 40, and must lie within"),
        ("within = [0.7, 0.9]", "within = [7, 9]", "nothing can be drawn"),
        ("phase_deg = {", "phase_dag = {", "has no key 'phase_dag'; did you mean 'phase_deg'?"),
        ("[each_orbit.orbit]", "[each_orbit.orbits]", "is no section of a scene; did you mean 'orbit'?"),
        ("[each_orbit.orbit]\n", "[each_orbit.camera]\nwidth = 3\n[each_orbit.orbit]\n", "the same camera"),
        ("test = 0.33", "test = 0.5", "split: the shares of train, val and test must add up to 1"),
        ("kind = \"shell\"", "kind = \"shall\"", "camera.kind: 'shall' is none of its words; did you mean 'shell'?"),
        ("kind = \"shell\"", "kind = \"cone\"", "camera.half_angle_deg: is missing"),
        ("name = \"corner\"", "name = \"tip\"", "'tip' is the name of another key point"),
        ("images = [\"numbers\"", "images = [\"number\"", "'number' is no kind of image; did you mean 'numbers'?"),
        ("begin = { absorptivity = 0.20, ", "begin = { ", "absorptivity stands in only one of begin and end"),
        ("seed = 5", "seed = ", "not valid TOML"),
        ("scene = \"scene.toml\"", "model = 3", "spec.toml:1: scene: this file is a scene"),
        ("position = [1, 1, 1]", "position = [1, 1]", "expected an array of 3 finite numbers, found an array of 2"),
        ("[life]", "[each_image.joint]\nangle_deg = 3\n[life]", "each_image.joint: can not be drawn for an image"),
        ("[life]", "[each_image.sensor]\nnetdd = 3\n[life]", "has no key 'netdd'; did you mean 'netd'?"),
        ("[life]", "[each_image.sensor]\nnetd = 3\n[life]", "draws sensor.netd, and so does [each_orbit.sensor]"),
        (
            "[life]",
            "[each_image.sensor]\ntime_constant = 3\n[life]",
            "each_image.sensor.time_constant: can not be drawn: images lie far apart",
        ),
    ] {
        assert!(SPEC.contains(from), "{from}");
        let error = Spec::parse(&SPEC.replacen(from, to, 1), Path::new("spec.toml")).expect_err(to).to_string();
        assert!(error.contains(expected), "{to}: {error}");
    }
}

#[test]
fn what_the_scene_refuses_is_told_before_anything_is_written() {
    for (changes, expected) in [
        (&[("match = \"cells\"", "match = \"cell\"")][..], "the scene has no [[material]] with match = \"cell\""),
        (
            &[("[life]", "[each_image.sensor]\ntransmission = 1.5\n[life]")],
            "spec.toml: sensor.transmission: must be in [0.01, 1]",
        ),
        (&[("[0.7, 0.9]", "[0.7, 1.9]"), ("[0.82, 0.02]", "[1.8, 0.01]")], "emissivity"),
        // Drawn once in a million images, and refused at once.
        (
            &[("netd = { log_uniform = [0.05, 0.5] }", "netd = { normal = [0.3, 0.06] }")],
            "sensor.netd: must be 0 or above [K], found -0.06",
        ),
        (
            &[("netd = { log_uniform = [0.05, 0.5] }", "netd = { least = 0.1, greatest = 0.2 }")],
            "which names none of the distributions uniform, log_uniform",
        ),
        (&[("part = \"wing_starboard\"", "part = \"wing_starbord\"")], "wing_starbord"),
        (
            &[("kind = \"shell\"\ndistance = { log_uniform = [9, 40] }", "kind = \"path\"")],
            "the scene has no camera.path",
        ),
    ] {
        let workshop = Workshop::new(changes);
        let error = workshop.make("set", (0, 1), Begin::Fresh).expect_err("a refusal").to_string();
        assert!(error.contains(expected), "{changes:?}: {error}");
        assert!(!workshop.path("set").exists(), "{changes:?}");
    }
}

#[test]
fn no_sample_after_all_attempts_is_an_error_with_the_reasons() {
    let workshop =
        Workshop::new(&[("pointing_px = { normal = [0, 4] }", "pointing_px = 400"), ("attempts = 50", "attempts = 7")]);
    let error = workshop.make("set", (0, 1), Begin::Fresh).expect_err("no sample");
    assert!(matches!(error, DatasetError::NoSample { attempts: 7, .. }));
    assert!(error.to_string().contains("after 7 attempts: 7 craft out of view"), "{error}");
    assert!(error.is_of_the_user());
}

#[test]
fn a_folder_that_can_not_be_used_is_refused() {
    let workshop = Workshop::new(&[]);
    workshop.0.write("file", "");
    std::fs::create_dir(workshop.path("full")).expect("a folder");
    workshop.0.write("full/mine.txt", "mine");
    for (folder, expected) in
        [("file", "is a file"), ("file/below", "cannot create output folder"), ("full", "is not empty")]
    {
        for begin in [Begin::Fresh, Begin::Force] {
            let error = workshop.make(folder, (0, 1), begin).expect_err(folder).to_string();
            assert!(error.contains(expected), "{folder}: {error}");
        }
    }
    assert!(workshop.path("full/mine.txt").exists());
}

#[test]
fn the_command_tells_what_is_wrong_with_exit_code_2() {
    let workshop = Workshop::new(&[("seed = 5", "sead = 5")]);
    let run = |arguments: &[&str]| refusal(&end(isotherm(workshop.0.0.path(), arguments)));
    let (code, error) = run(&["dataset", "spec.toml", "-o", "set", "--device", "cpu"]);
    assert_eq!(code, Some(2));
    assert_eq!(error, "error: spec.toml:4: sead: unknown key; did you mean 'seed'?");
    workshop.change(&[]);
    let (code, error) = run(&["dataset", "spec.toml", "-o", "set", "--shard", "3/3"]);
    assert!(code == Some(2) && error.contains("such as 0/3"), "{error}");
    let (code, error) = run(&["dataset", "verify", "nowhere"]);
    assert!(code == Some(2) && error.contains("holds no data set"), "{error}");
}
