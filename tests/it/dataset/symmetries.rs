//! Symmetries as BOP's tools read them.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec3};
use isotherm::internals::Begin;
use serde_json::Value;

use super::Workshop;

/// `get_symmetry_transformations` of `bop_toolkit_lib/misc.py`: the turns of an object by the discrete and continuous symmetries of `models_info.json`.
fn transformations(info: &Value, largest_step: f64) -> Vec<DAffine3> {
    let numbers = |value: &Value| -> Vec<f64> { serde_json::from_value(value.clone()).expect("numbers") };
    let mut discrete = vec![DAffine3::IDENTITY];
    for matrix in info["symmetries_discrete"].as_array().into_iter().flatten() {
        let m = numbers(matrix);
        assert_eq!((m.len(), &m[12..]), (16, &[0.0, 0.0, 0.0, 1.0][..]));
        let turn = DMat3::from_cols_array(&[m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]]).transpose();
        discrete.push(DAffine3::from_mat3_translation(turn, DVec3::new(m[3], m[7], m[11])));
    }
    let mut continuous = Vec::new();
    for symmetry in info["symmetries_continuous"].as_array().into_iter().flatten() {
        let [axis, offset] = ["axis", "offset"].map(|key| DVec3::from_slice(&numbers(&symmetry[key])));
        let count = (PI / largest_step).ceil() as u32;
        for step in 0..count {
            let turn = DMat3::from_axis_angle(axis, TAU * f64::from(step) / f64::from(count));
            continuous.push(DAffine3::from_mat3_translation(turn, offset - turn * offset));
        }
    }
    match continuous.is_empty() {
        true => discrete,
        false => discrete.iter().flat_map(|one| continuous.iter().map(move |other| *other * *one)).collect(),
    }
}

/// The vertices of a mesh [mm].
fn vertices(workshop: &Workshop, name: &str) -> Vec<DVec3> {
    let text = String::from_utf8(workshop.tree("set").remove(name).expect("a mesh")).expect("text");
    let count =
        text.lines().find_map(|line| line.strip_prefix("element vertex ")).expect("a count").parse().expect("a number");
    let lines = text.lines().skip_while(|line| *line != "end_header").skip(1).take(count);
    let numbers =
        |line: &str| -> Vec<f64> { line.split(' ').map(|number| number.parse().expect("a number")).collect() };
    lines.map(|line| DVec3::from_slice(&numbers(line))).collect()
}

/// Greatest distance of a turned vertex from the vertices [mm].
fn beside(vertices: &[DVec3], turn: &DAffine3) -> f64 {
    let nearest = |place: DVec3| vertices.iter().map(|vertex| vertex.distance(place)).fold(f64::INFINITY, f64::min);
    vertices.iter().map(|vertex| nearest(turn.transform_point3(*vertex))).fold(0.0, f64::max)
}

fn info(workshop: &Workshop) -> Value {
    serde_json::from_slice(&workshop.tree("set")["models/models_info.json"]).expect("JSON")
}

const SMALL: (&str, &str) = ("samples = 6", "samples = 1");

#[test]
fn the_mesh_is_the_same_after_each_turn_that_the_tools_of_bop_make() {
    let turned = "[[symmetry]]\nkind = \"discrete\"\naxis = [0, 0, 2]\ncount = 2\norigin = [0, 0, 7]\n\n[[key_point]]\nname = \"tip\"";
    let workshop = Workshop::new(&[SMALL, ("[[key_point]]\nname = \"tip\"", turned)]);
    workshop.whole("set");
    let (info, mesh) = (&info(&workshop)["1"], vertices(&workshop, "models/obj_000001.ply"));
    let turns = transformations(info, 0.01);
    assert_eq!(turns.len(), 2);
    for turn in &turns {
        assert!(beside(&mesh, turn) < 1e-3, "{turn}: {} mm", beside(&mesh, turn));
    }
    assert_eq!(
        info["symmetries_discrete"][0],
        serde_json::json!([-1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    );
    assert!(beside(&mesh, &DAffine3::from_rotation_x(PI)) > 100.0, "the mast shows");
    let conventions = String::from_utf8(workshop.tree("set").remove("README.txt").expect("a text")).expect("text");
    assert!(
        conventions.contains("models_info.json has those of the geometry") && !conventions.contains("No symmetries")
    );

    // Without any, the files are those of every other data set.
    let plain = Workshop::new(&[SMALL]);
    plain.whole("set");
    assert!(!info_keys(&plain).iter().any(|key| key.contains("symmetries")));
    let text = String::from_utf8(plain.tree("set").remove("README.txt").expect("a text")).expect("text");
    assert!(text.contains("\nNo symmetries are stated.\n"), "{text}");
}

fn info_keys(workshop: &Workshop) -> Vec<String> {
    info(workshop)["1"].as_object().expect("an object").keys().cloned().collect()
}

/// A continuous axis beside the origin, of an object on a joint. The tolerance lets the box pass for a cylinder, which it is not.
#[test]
fn an_axis_has_a_point_in_millimetres() {
    let joint = "[[joint]]\npart = \"mast\"\nmode = \"fixed\"\naxis = \"+Z\"\nangle_deg = 30\n";
    let symmetry = |tolerance: f64, count: &str| {
        format!(
            "[[symmetry]]\nkind = \"continuous\"\nobject = \"mast\"\naxis = [0, 0, 1]\norigin = [0.25, 0, 0]\ntolerance = {tolerance}\n\
             [[symmetry]]\nkind = \"discrete\"\nobject = \"mast\"\naxis = [1, 0, 0]\norigin = [0, 0, -2]\ncount = {count}\n[life]\n"
        )
    };
    let workshop = Workshop::new(&[SMALL, ("[life]\n", &symmetry(0.5, "2"))]);
    let scene = std::fs::read_to_string(workshop.path("scene.toml")).expect("a scene");
    workshop.0.write("scene.toml", &format!("{scene}\n{joint}"));
    workshop.whole("set");
    let info = info(&workshop);
    assert!(info["1"].get("symmetries_continuous").is_none());
    let turns = transformations(&info["2"], 0.1);
    assert_eq!(turns.len(), 2 * 32);
    for turn in &turns {
        // The axis stays, and what lies beside it stays as far from it.
        let place = turn.transform_point3(DVec3::new(250.0, 0.0, -2000.0));
        assert!(place.distance(DVec3::new(250.0, 0.0, -2000.0)) < 1e-9, "{place}");
        let other = turn.transform_point3(DVec3::new(0.0, 0.0, -2500.0)) - DVec3::new(250.0, 0.0, -2000.0);
        assert!((other.truncate().length() - 250.0).abs() < 1e-9 && (other.z.abs() - 500.0).abs() < 1e-9, "{other}");
    }
    workshop.change(&[SMALL, ("[life]\n", &symmetry(0.01, "2"))]);
    let error = workshop.make("other", (0, 1), Begin::Fresh).expect_err("no cylinder").to_string();
    assert!(error.contains("the object 'mast' is not the same after a turn of 137.5 deg"), "{error}");
    workshop.change(&[SMALL, ("[life]\n", &symmetry(0.5, "4"))]);
    let error = workshop.make("other", (0, 1), Begin::Fresh).expect_err("another axis").to_string();
    assert!(error.contains("turns the continuous axis of the object 'mast' into another one"), "{error}");
    assert!(!workshop.path("other").exists());
}
