//! `isotherm sensitivity`: derivatives against closed forms and against runs of changed scenes, and wrong input.

use std::path::Path;

use exr::prelude::{FlatSamples, read_first_flat_layer_from_file};
use isotherm::internals::STEFAN_BOLTZMANN;

use super::budget::{DARK, LIT, scene, squares, sunlight};
use super::craft::{Folder, scene_with};
use super::mesh_network::{SKIN, TRANSITION};
use super::program::{end, isotherm, refusal, succeed};

const PERIODIC: &str = "draw_every = 5\nwarm_up = \"periodic\"\nwarm_up_tolerance = 0.01\nwarm_up_orbits = 30";

/// An orbit as long as the run of [`scene`], which so settles itself.
const AN_ORBIT: &str = "altitude = 408e3\nperiod = 600";

const CPU: [&str; 2] = ["--device", "cpu"];

fn parameter(text: &str) -> String {
    format!("[[parameter]]\n{text}\n")
}

/// Rows of a parameter and a place in `sensitivity.csv`: time, temperature, dT/dlnp and its error [K].
fn all_rows(folder: &Path, parameter: &str, place: &str) -> Vec<[f64; 4]> {
    let table = std::fs::read_to_string(folder.join("out/sensitivity.csv")).expect("a table");
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let records = reader.records().map(|record| record.expect("a row"));
    let own = records.filter(|record| &record[0] == parameter && &record[2] == place);
    own.map(|record| [3, 4, 5, 7].map(|cell| record[cell].parse().expect("a number"))).collect()
}

/// The same of a run of [`scene`].
fn rows(folder: &Path, parameter: &str, place: &str) -> Vec<[f64; 4]> {
    let rows = all_rows(folder, parameter, place);
    assert_eq!(rows.len(), 11, "{parameter} of {place}");
    rows
}

fn assert_all(rows: &[[f64; 4]], known: f64, within: f64) {
    for [time, _, derivative, error] in rows {
        let off = (derivative - known).abs();
        assert!(off <= within, "{derivative} K at {time} s for {known}");
        // Of the second order: the coarser step errs by three times as much as the finer step does.
        assert!(*error <= 5.0 * within, "{error} K");
    }
}

fn channel(path: &Path, name: &str) -> Vec<f32> {
    let layer = read_first_flat_layer_from_file(path).expect("an image").layer_data;
    let channel =
        layer.channel_data.list.into_iter().find(|channel| channel.name.to_string() == name).expect("a channel");
    match channel.sample_data {
        FlatSamples::F32(values) => values,
        other => panic!("{other:?}"),
    }
}

/// Wings that touch nothing know nothing of the body's blanket. Their derivatives are 0, though the estimated error decides how often steps are halved.
#[test]
fn what_touches_nothing_does_not_depend_on_it() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let folder = Folder::new("");
    for name in ["cubesat.glb", "materials.toml"] {
        std::fs::copy(models.join(name), folder.path(name)).expect("a copy");
    }
    let scene = std::fs::read_to_string(models.join("cubesat_conduction.toml")).expect("a scene");
    let shorter =
        [("step = 15.43 ", "step = 60 "), ("steps = 360\n", "steps = 92\n"), ("max_edge = 0.02", "max_edge = 0.1")];
    let coarse = shorter.iter().fold(scene, |scene, (from, to)| {
        assert!(scene.contains(from), "{from}");
        scene.replace(from, to)
    });
    folder.write("scene.toml", &coarse);
    folder.write("p.toml", &parameter("vary = \"absorptivity\"\nmaterial = \"blanket\"\npercent = 10"));
    succeed(folder.0.path(), &["sensitivity", "scene.toml", "--parameters", "p.toml", "-o", "out"]);
    let of = |place: &str| {
        let rows = all_rows(folder.0.path(), "absorptivity of blanket", place);
        let largest = |column: usize| rows.iter().map(|row| row[column].abs()).fold(0.0, f64::max);
        assert_eq!(rows.len(), 93);
        [largest(2), largest(3)]
    };
    let [[wing, error], [body, _]] = ["wing_port", "body"].map(of);
    assert!(wing < 0.03 && error < 0.06, "{wing} and {error} K");
    assert!(body > 10.0, "{body} K");
}

/// A plate in balance: T^4 = q / (eps sigma), so that dT/dln alpha = T/4 and dT/dln eps = -T/4, and its capacity changes nothing.
#[test]
fn a_plate_depends_on_its_optics_as_the_closed_form_says() {
    for (response, device) in [("radiative", &CPU[..]), ("network", &[])] {
        let own = format!(
            "emissivity = 0.8\nheat_capacity_per_area = 2430\nsides = \"outside\"\nresponse = \"{response}\"\n"
        );
        let text = scene(&[("plate", &own)], LIT, "").replace("draw_every = 5", PERIODIC);
        let folder = squares(&text, &[("plate", [0.0; 3], true)]);
        let parameters = [
            "vary = \"absorptivity\"\nmaterial = \"pl*\"\nrange = [0.55, 0.65]",
            "vary = \"emissivity\"\nmaterial = \"plate\"\npercent = 10",
            "vary = \"capacity\"\nmaterial = \"plate\"\npercent = 10",
            "name = \"Sun\"\nvary = \"solar_constant\"\npercent = 0.5",
        ];
        folder.write("p.toml", &parameters.map(parameter).concat());
        let said = succeed(
            folder.0.path(),
            &[&["sensitivity", "scene.toml", "--parameters", "p.toml", "-o", "out"], device].concat(),
        );
        let temperature = (sunlight() / (0.8 * STEFAN_BOLTZMANN)).powf(0.25);
        let known = temperature / 4.0;
        for (name, known) in [
            ("absorptivity of pl*", known),
            ("emissivity of plate", -known),
            ("capacity of plate", 0.0),
            ("Sun", known),
        ] {
            let rows = rows(folder.0.path(), name, "plate");
            assert!(rows.iter().all(|row| (row[1] - temperature).abs() < 0.01), "{rows:?}");
            assert_all(&rows, known, 0.005 * temperature / 4.0);
        }
        // A tenth of a unit of absorptivity, 0.6: T/4 times 1/6. The largest effects come first.
        let effects = std::fs::read_to_string(folder.path("out/effects.csv")).expect("effects");
        let order: Vec<&str> = effects.lines().skip(1).map(|line| line.split(',').next().unwrap_or_default()).collect();
        assert_eq!(order, ["emissivity of plate", "absorptivity of pl*", "Sun", "capacity of plate"]);
        let effect: f64 =
            effects.lines().nth(2).and_then(|line| line.split(',').nth(5)).expect("a cell").parse().expect("a number");
        assert!((effect / (known / 6.0) - 1.0).abs() < 0.005, "{effect}");
        assert!(said.contains("emissivity of plate") && folder.path("out/tornado.svg").exists());
        let image = folder.path("out/frames/step_000010.exr");
        let pixels = channel(&image, "dT1_absorptivity_of_pl_");
        let shown: Vec<f32> = pixels.into_iter().filter(|value| *value != 0.0).collect();
        assert!(shown.len() > 500 && shown.iter().all(|value| (f64::from(*value) / known - 1.0).abs() < 0.005));
        assert!(channel(&image, "dT1_absorptivity_of_pl__error").iter().all(|error| f64::from(*error) < 0.005 * known));
    }
}

/// A value of 1 goes down alone. A difference of first order would err by 1.25 %.
#[test]
fn an_emissivity_of_one_is_varied_to_one_side() {
    let own = "emissivity = 1\nheat_capacity_per_area = 2430\nsides = \"outside\"\nresponse = \"radiative\"\n";
    let text = scene(&[("plate", own)], LIT, "").replace("draw_every = 5", PERIODIC);
    let folder = squares(&text, &[("plate", [0.0; 3], true)]);
    folder.write("p.toml", &parameter("vary = \"emissivity\"\nmaterial = \"plate\"\nrange = [0.9, 1]"));
    let arguments = ["sensitivity", "scene.toml", "--parameters", "p.toml", "-o", "out"];
    succeed(folder.0.path(), &[&arguments[..], &CPU].concat());
    let known = -(sunlight() / STEFAN_BOLTZMANN).powf(0.25) / 4.0;
    assert_all(&rows(folder.0.path(), "emissivity of plate", "plate"), known, 0.005 * known.abs());
    let pixels = channel(&folder.path("out/frames/step_000010.exr"), "dT1_emissivity_of_plate");
    let mut shown = pixels.into_iter().filter(|value| *value != 0.0);
    assert!(shown.all(|value| (f64::from(value) / known - 1.0).abs() < 0.005));
}

/// A cooler that begins at 0 W has the value and the range of its largest power. The lower end of its range stands first.
#[test]
fn the_value_of_a_schedule_is_its_largest_power() {
    let own = "emissivity = 0.8\nheat_capacity_per_area = 2430\nsides = \"outside\"\nresponse = \"network\"\n";
    let rest = "[[heater]]\npart = \"plate\"\npower = { time = [0, 120, 120, 600], power = [0, 0, -30, -30] }\n";
    let folder = squares(&scene(&[("plate", own)], LIT, rest), &[("plate", [0.0; 3], true)]);
    folder.write("p.toml", &parameter("vary = \"heater\"\npart = \"plate\"\npercent = 20"));
    succeed(folder.0.path(), &["sensitivity", "scene.toml", "--parameters", "p.toml", "-o", "out"]);
    let effects = std::fs::read_to_string(folder.path("out/effects.csv")).expect("effects");
    let cells: Vec<&str> = effects.lines().nth(1).expect("a row").split(',').collect();
    assert_eq!(cells[1..5], ["-30", "W", "-36", "-24"], "{effects}");
    let [low, high] = [6, 7].map(|place| cells[place].parse::<f64>().expect("a number"));
    assert!(low < -0.1 && high > 0.1, "{effects}");
}

/// Two radiators of 4 m2 with a contact of 1.5 W/K, and a heater of 300 W on the first. The derivatives of both balances are two linear equations.
#[test]
fn two_plates_depend_on_their_contact_and_heater_as_the_closed_form_says() {
    let own = "emissivity = 0.8\nheat_capacity_per_area = 2430\nconductivity = 1e5\nthickness = 0.01\nsides = \"outside\"\nresponse = \"network\"\n";
    let rest = "[[heater]]\npart = \"hot\"\npower = 300\n\
                [[contact]]\nbetween = [\"hot\", \"cold\"]\nconductance = 1.5\ndistance = 0.3\n";
    let text = scene(&[("hot", own), ("cold", own)], DARK, rest)
        .replace("draw_every = 5", PERIODIC)
        .replace("altitude = 408e3", AN_ORBIT);
    let folder = squares(&text, &[("hot", [0.0; 3], true), ("cold", [2.2, 0.0, 0.0], true)]);
    let parameters = [
        "name = \"contact\"\nvary = \"contact\"\nbetween = [\"cold\", \"h*\"]\nrange = [1, 2]",
        "name = \"heater\"\nvary = \"heater\"\npart = \"hot\"\nrange = [290, 310]",
        "name = \"spread\"\nvary = \"conductivity\"\nmaterial = \"*\"\npercent = 50",
    ];
    folder.write("p.toml", &parameters.map(parameter).concat());
    succeed(folder.0.path(), &["sensitivity", "scene.toml", "--parameters", "p.toml", "-o", "out"]);
    let (radiation, power, contact) = (0.8 * STEFAN_BOLTZMANN * 4.0, 300.0, 1.5);
    let (mut hot, mut cold) = (200.0f64, 150.0f64);
    let solved = |hot: f64, cold: f64, off: [f64; 2]| {
        let [a, d] = [hot, cold].map(|t| contact + 4.0 * radiation * t.powi(3));
        let whole = a * d - contact * contact;
        [(off[0] * d + contact * off[1]) / whole, (off[1] * a + contact * off[0]) / whole]
    };
    for _ in 0..100 {
        let moved = contact * (hot - cold);
        let by = solved(hot, cold, [power - moved - radiation * hot.powi(4), moved - radiation * cold.powi(4)]);
        (hot, cold) = (hot + by[0], cold + by[1]);
    }
    let moved = contact * (hot - cold);
    for (name, known) in [
        ("contact", solved(hot, cold, [-moved, moved])),
        ("heater", solved(hot, cold, [power, 0.0])),
        ("spread", [0.0; 2]),
    ] {
        for (place, known) in [("hot", known[0]), ("cold", known[1])] {
            assert_all(&rows(folder.0.path(), name, place), known, 0.005 * known.abs().max(10.0));
        }
    }
}

/// A heater of 300 W below a blanket of 4 m2, with a contact of 1.5 W/K from the same structure to a bare radiator. A share of the heat leaves through the blanket.
#[test]
fn a_blanket_over_a_heater_depends_on_its_emittance_as_the_balances_say() {
    let own = "emissivity = 0.8\nheat_capacity_per_area = 2430\nconductivity = 1e5\nthickness = 0.01\nsides = \"outside\"\nresponse = \"network\"\n";
    let over = "over = { effective_emittance = 0.05, thickness = 0.01, density = 200, specific_heat = 100, conductivity = 1e5 }\n";
    let rest = "[[heater]]\npart = \"hot\"\npower = 300\n\
                [[contact]]\nbetween = [\"hot\", \"cold\"]\nconductance = 1.5\ndistance = 0.3\n";
    let hot = format!("{own}{over}");
    let text = scene(&[("hot", &hot), ("cold", own)], DARK, rest)
        .replace("draw_every = 5", PERIODIC)
        .replace("altitude = 408e3", AN_ORBIT);
    let folder = squares(&text, &[("hot", [0.0; 3], true), ("cold", [2.2, 0.0, 0.0], true)]);
    folder.write("p.toml", &parameter("vary = \"effective_emittance\"\nmaterial = \"h*\"\nrange = [0.02, 0.08]"));
    succeed(folder.0.path(), &["sensitivity", "scene.toml", "--parameters", "p.toml", "-o", "out"]);
    // Temperatures of the cover and of the radiator, from the temperature of the structure that balances the heater.
    let balance = |emittance: f64| {
        let (radiation, blanket) = (0.8 * STEFAN_BOLTZMANN * 4.0, emittance * STEFAN_BOLTZMANN * 4.0);
        let (mut low, mut high) = (100.0f64, 2000.0);
        let mut solved = [0.0; 2];
        for _ in 0..200 {
            let structure = 0.5 * (low + high);
            let cover = structure * (blanket / (blanket + radiation)).powf(0.25);
            let mut cold = 200.0f64;
            for _ in 0..100 {
                let off = 1.5 * (structure - cold) - radiation * cold.powi(4);
                cold += off / (1.5 + 4.0 * radiation * cold.powi(3));
            }
            solved = [cover, cold];
            if radiation * (cover.powi(4) + cold.powi(4)) > 300.0 { high = structure } else { low = structure }
        }
        solved
    };
    let [more, less] = [1.001, 0.999].map(|times| balance(0.05 * times));
    for (place, index) in [("hot", 0), ("cold", 1)] {
        let known = (more[index] - less[index]) / 0.002;
        assert!(known.abs() > 2.0, "{known}");
        assert_all(&rows(folder.0.path(), "effective_emittance of h*", place), known, 0.005 * known.abs());
    }
}

/// The craft in its own shadow and radiation. A scene file with another value is prepared and run without anything that runs of a search share.
#[test]
fn derivatives_are_differences_of_scenes_with_other_values() {
    let cells = "response = \"radiative\"\nheat_capacity_per_area = 1500\n";
    let base = scene_with(&[
        ("draw_every = 4", "draw_every = 0\nwarm_up = \"periodic\"\nwarm_up_tolerance = 0.0002\nwarm_up_orbits = 60"),
        ("step = 60\nsteps = 12", "step = 60\nsteps = 10"),
        (TRANSITION, SKIN),
        (super::mesh_network::CELLS, cells),
    ]) + "[shadows]\n[exchange]\nrays = 64\n";
    let folder = Folder::new(&base);
    let cases = [
        ("front", "absorptivity = 0.75", "absorptivity = 0.765", "vary = \"absorptivity\"\nmaterial = \"cells\""),
        ("skin", "emissivity = 0.83", "emissivity = 0.8466", "vary = \"emissivity\"\nmaterial = \"skin\""),
        ("planet", "planet_ir = 237", "planet_ir = 241.74", "vary = \"planet_ir\""),
    ];
    let parameters = cases.map(|(name, .., own)| parameter(&format!("name = \"{name}\"\n{own}\npercent = 5")));
    folder.write("p.toml", &parameters.concat());
    succeed(
        folder.0.path(),
        &[&["sensitivity", "scene.toml", "--parameters", "p.toml", "-o", "out"], &CPU[..]].concat(),
    );
    let means = |scene: &str| -> Vec<f64> {
        let out = format!("{scene}_run");
        succeed(folder.0.path(), &[&["run", scene, "-o", &out], &CPU[..]].concat());
        let table = std::fs::read_to_string(folder.path(&format!("{out}/series.csv"))).expect("a series");
        let mut reader = csv::Reader::from_reader(table.as_bytes());
        let column =
            reader.headers().expect("heads").iter().position(|head| head == "part:body:mean").expect("the body");
        reader.records().map(|row| row.expect("a row")[column].parse().expect("a number")).collect()
    };
    let before = means("scene.toml");
    for (name, from, to, _) in cases {
        folder.write("changed.toml", &base.replacen(from, to, 1));
        let _ = std::fs::remove_dir_all(folder.path("changed.toml_run"));
        let after = means("changed.toml");
        let known: Vec<f64> = after.iter().zip(&before).map(|(after, before)| (after - before) / 0.02).collect();
        let largest = known.iter().fold(0.0f64, |largest, known| largest.max(known.abs()));
        for (row, known) in rows(folder.0.path(), name, "body").iter().zip(&known) {
            let off = (row[2] - known).abs();
            assert!(off < 0.02 * largest.max(1.0), "{name}: {} K for {known}", row[2]);
            assert!((1.05 * row[2] - known).abs() > off || known.abs() < 1.0, "{name}: five percent more must show");
        }
    }
}

#[test]
fn wrong_parameters_are_refused_before_anything_is_written() {
    let folder = Folder::new(&scene_with(&[]));
    let range = "percent = 5";
    for (text, why) in [
        (String::new(), "parameter: is missing"),
        (parameter("vary = \"colour\"\npercent = 5"), "parameter.vary: 'colour' is not one of"),
        (parameter(range), "parameter.vary: is missing"),
        (parameter("vary = \"albedo\""), "parameter.range: is missing"),
        (parameter(&format!("vary = \"absorptivity\"\n{range}")), "parameter.material: is missing"),
        (parameter(&format!("vary = \"albedo\"\nmaterial = \"skin\"\n{range}")), "parameter.material: has no meaning"),
        (parameter(&format!("vary = \"albedo\"\ncolour = 1\n{range}")), "parameter.colour: unknown key"),
        (parameter("vary = \"albedo\"\nrange = [0.4, 0.2]"), "parameter.range: must be two rising"),
        (parameter("vary = \"albedo\"\nrange = [0.2, 1.2]"), "parameter.range: ends at 1.2, but albedo is at most 1"),
        (parameter("vary = \"planet_ir\"\nrange = [-1, 237]"), "begins at -1, but planet_ir is not negative"),
        (
            parameter(&format!("vary = \"absorptivity\"\nmaterial = \"gold*\"\n{range}")),
            "parameter.material: no material 'gold*' is in the model; known here: skin, ",
        ),
        (parameter(&format!("vary = \"absorptivity\"\nmaterial = \"skin\"\nface = \"back\"\n{range}")), "has a back"),
        (
            parameter(&format!("vary = \"heater\"\npart = \"body\"\n{range}")),
            "parameter.part: the scene has no heater of 'body'",
        ),
        (
            parameter(&format!("vary = \"contact\"\nbetween = [\"a\", \"b\"]\n{range}")),
            "the scene has no contact of 'a' and 'b'",
        ),
        (parameter("vary = \"absorptivity\"\nmaterial = \"*\"\nrange = [0.1, 0.2]"), "parameter.range: names values"),
        (
            parameter("vary = \"absorptivity\"\nmaterial = \"skin\"\nrange = [0.05, 0.2]"),
            "leaves out the value in the scene, 0.29",
        ),
        (
            parameter("vary = \"emissivity\"\nmaterial = \"skin\"\npercent = 90"),
            "parameter.percent: 90 takes 0.83 above 1",
        ),
        (parameter("vary = \"planet_ir\"\npercent = 150"), "parameter.percent: 150 takes planet_ir below 0"),
        (
            parameter(&format!("name = \"{}\"\nvary = \"albedo\"\n{range}", "a".repeat(250))),
            "has more than 200 characters",
        ),
        (
            [range, range].map(|range| parameter(&format!("vary = \"albedo\"\n{range}"))).concat(),
            "'albedo' is the name of an earlier",
        ),
    ] {
        folder.write("p.toml", &text);
        let arguments = ["sensitivity", "scene.toml", "--parameters", "p.toml", "-o", "out", "--device", "cpu"];
        let (code, line) = refusal(&end(isotherm(folder.0.path(), &arguments)));
        assert!(code == Some(2) && line.contains(why) && line.contains("p.toml"), "{text}: {line}");
        assert!(!folder.path("out").exists(), "{text}");
    }
    let missing = ["sensitivity", "scene.toml", "--parameters", "q.toml", "-o", "out"];
    assert_eq!(refusal(&end(isotherm(folder.0.path(), &missing))).0, Some(2));
}
