//! Thermal networks of scenes: closed form, device against twin, periodic state, refusals.

use isotherm::EngineError;
use isotherm::internals::{DeviceEngine, Engine, PADDING, Prepared, ReferenceEngine, STEFAN_BOLTZMANN, run, start};

use super::craft::{Folder, never, scene_with};
use super::device::{Worst, assert_silent, context};
use super::program::run as run_program;

pub const TRANSITION: &str = "response = \"transition\"\nretarget = \"merge\"\nheating = { function = \"quadratic\", t_max_steps = 20 }\n\
                          cooling = { function = \"linear\", t_max_steps = 30 }\n";
pub const SKIN: &str =
    "response = \"network\"\nthickness = 0.002\ndensity = 2700\nspecific_heat = 900\nconductivity = 160\n";
pub const CELLS: &str = "response = \"transition\"\nretarget = \"merge\"\nheating = { function = \"quadratic\", t_max_steps = 4 }\n\
                     cooling = { function = \"quadratic\", t_max_steps = 6 }\n";

/// Temperatures of all nodes [K] at every step.
pub fn history(prepared: &Prepared, engine: &mut dyn Engine) -> Vec<Vec<f64>> {
    start(prepared, engine, None, &never(), &mut || ()).expect("the engine starts");
    let vertices = &prepared.nodes.vertex_of_node;
    let mut history = Vec::new();
    run::<EngineError>(prepared, engine, None, &never(), &mut |result| {
        let all = result.delivered.temperatures.expect("a run reads temperatures");
        let real = (0..vertices.len()).filter(|node| vertices[*node] != PADDING);
        history.push(real.map(|node| f64::from(all[node])).collect());
        Ok(())
    })
    .expect("the engine runs");
    history
}

fn on_device(prepared: &Prepared) -> Vec<Vec<f64>> {
    let context = context();
    let found = history(prepared, &mut DeviceEngine::new(&context, prepared, None).expect("a small scene"));
    assert_silent(&context);
    found
}

fn compare(prepared: &Prepared) -> Worst {
    let device = on_device(prepared).concat();
    let twin = history(prepared, &mut ReferenceEngine::new(prepared, None)).concat();
    Worst::of(&device, &twin, |node| format!("value {node}"))
}

#[test]
fn a_box_cools_as_the_closed_form_says() {
    let scene = scene_with(&[
        ("solar_constant = 1361\nalbedo = 0.3\nplanet_ir = 237\n", ""),
        ("background_temperature = 2.7\n", ""),
        (TRANSITION, SKIN),
    ]) + "[initial]\ntemperature = 320\n";
    let prepared = Folder::new(&scene).prepared();
    // C dT/dt = -e sigma T^4: T^-3 = T0^-3 + 3 e sigma t / C, with C = 4860 J/(m2 K).
    let cooled = |time: f64, capacitance: f64| {
        (320.0_f64.powi(-3) + 3.0 * 0.83 * STEFAN_BOLTZMANN * time / capacitance).powf(-1.0 / 3.0)
    };
    let skin: Vec<usize> = {
        let nodes = &prepared.nodes;
        let real = (0..nodes.vertex_of_node.len()).filter(|node| nodes.vertex_of_node[*node] != PADDING);
        real.enumerate().filter(|(_, node)| nodes.group_material[node / 4] == 0).map(|(index, _)| index).collect()
    };
    for found in [on_device(&prepared), history(&prepared, &mut ReferenceEngine::new(&prepared, None))] {
        for (step, temperatures) in found.iter().enumerate() {
            let expected = cooled(60.0 * step as f64, 4860.0);
            for node in &skin {
                assert!(
                    (temperatures[*node] - expected).abs() < 5e-3,
                    "step {step}: {} {expected}",
                    temperatures[*node]
                );
            }
        }
        assert!((found[12][skin[0]] - cooled(720.0, 4000.0)).abs() > 1.0, "another capacity would be seen");
    }
}

#[test]
fn device_and_twin_agree_on_a_mixed_scene_with_a_blanket_heater_and_contact() {
    let layered = "response = \"network\"\ndensity = 0\nover = { effective_emittance = 0.05, thickness = 0.002, \
                   density = 2700, specific_heat = 900, conductivity = 160 }\n";
    let mast = "response = \"network\"\nthickness = 0.001\ndensity = 1600\nspecific_heat = 900\nconductivity = 20\n";
    let tail = "[[contact]]\nbetween = [\"body\", \"mast\"]\nconductance = 0.5\n\
                [[heater]]\npart = \"body\"\npower = 300\nprobe = \"side\"\non_below = 281\noff_above = 283\n\
                [[heater]]\npart = \"mast\"\npower = { time = [0, 300, 300], power = [0, 5, 1] }\n\
                [[probe]]\nname = \"side\"\nposition = [1, 0, 0]\npart = \"body\"\n[initial]\ntemperature = 282\n";
    for (name, changes) in [
        ("skin only", vec![(TRANSITION, SKIN)]),
        ("layers", vec![(TRANSITION, layered), ("response = \"instant\"\n", mast)]),
    ] {
        let scene = scene_with(&changes) + if name == "layers" { tail } else { "" };
        let prepared = Folder::new(&scene).prepared();
        compare(&prepared).within(2e-3, "K", name);
        assert!(prepared.network.is_some());
    }
    // The cells keep their transition next to the network.
    let prepared = Folder::new(&scene_with(&[(TRANSITION, SKIN)])).prepared();
    let plain = Folder::new(&scene_with(&[])).prepared();
    assert!(prepared.scene.assumptions.iter().any(|text| text.contains("hollow")));
    assert!(!plain.scene.assumptions.iter().any(|text| text.contains("hollow")));
}

#[test]
#[ignore = "long: tools/test --all"]
fn a_periodic_warm_up_ends_where_an_orbit_changes_nothing() {
    let scene = scene_with(&[
        (TRANSITION, SKIN),
        (CELLS, "response = \"instant\"\n"),
        ("step = 60\n", "step = 60\nwarm_up = \"periodic\"\nwarm_up_tolerance = 0.01\nwarm_up_orbits = 30\n"),
        ("steps = 12", "steps = 93"),
        // An orbit is 93 steps.
        ("period = 5553.6", "period = 5580"),
    ]);
    // Difference between the network's state and its state one orbit earlier [K].
    let change = |scene: &str| {
        let prepared = Folder::new(scene).prepared();
        let mut engine = ReferenceEngine::new(&prepared, None);
        let done = start(&prepared, &mut engine, None, &never(), &mut || ()).expect("it starts");
        let before = engine.network_temperatures().expect("f64").expect("a network");
        run::<EngineError>(&prepared, &mut engine, None, &never(), &mut |_| Ok(())).expect("it runs");
        let after = engine.network_temperatures().expect("f64").expect("a network");
        (done, before.iter().zip(&after).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max))
    };
    let (done, moved) = change(&scene);
    let done = done.expect("it was asked for");
    assert!(done.is_met() && done.orbits < 12, "{done:?}");
    assert!(moved < 0.02, "{moved}");
    let (none, moved) =
        change(&scene.replace("warm_up = \"periodic\"\nwarm_up_tolerance = 0.01\nwarm_up_orbits = 30\n", ""));
    assert!(none.is_none() && moved > 1.0, "{moved}");
}

#[test]
fn what_a_network_lacks_is_said() {
    let refused = |changes: &[(&str, &str)], tail: &str| {
        let folder = Folder::new(&(scene_with(changes) + tail));
        match Prepared::new(&folder.path("scene.toml"), &mut |_| ()) {
            Ok(_) => panic!("accepted: {tail}"),
            Err(error) => error.to_string(),
        }
    };
    let thin = SKIN.replace("thickness = 0.002\n", "");
    let error = refused(&[(TRANSITION, &thin)], "");
    assert!(error.contains("'skin'") && error.contains("thickness"), "{error}");
    let error = refused(&[(TRANSITION, SKIN)], "[[contact]]\nbetween = [\"body\", \"tail\"]\nconductance = 1\n");
    assert!(error.contains("contact.between: ") && error.contains("no part 'tail'; known here: body, "), "{error}");
    let error =
        refused(&[(TRANSITION, SKIN)], "[[contact]]\nbetween_materials = [\"skin\", \"cels\"]\nconductance = 1\n");
    assert!(error.contains("no material 'cels'; did you mean 'cells'?"), "{error}");
    let error = refused(&[(TRANSITION, SKIN)], "[[contact]]\nbetween = [\"body\", \"mast\"]\nconductance = 1\n");
    assert!(error.contains("has no nodes in the network"), "{error}");
    let error = refused(&[(TRANSITION, SKIN)], "[[contact]]\nbetween = [\"body\", \"mast\"]\n");
    assert!(error.contains("conductance"), "{error}");
    let error = refused(&[], "[[heater]]\npart = \"body\"\npower = 3\n");
    assert!(error.contains("response = 'network'"), "{error}");
    let error = refused(&[(TRANSITION, SKIN)], "[[heater]]\npart = [\"body\", \"wing_prt\"]\npower = 3\n");
    assert!(error.contains("heater.part: the model has no part 'wing_prt'; did you mean 'wing_port'?"), "{error}");
    let error = refused(&[(TRANSITION, SKIN)], "[[heater]]\npart = \"sail\"\npower = 3\n");
    assert!(error.contains("no part 'sail'; known here: body, wing_port, wing_starboard, mast"), "{error}");
    let error = refused(&[(TRANSITION, SKIN)], "[[heater]]\npart = \"body\"\npower = 3\nprobe = \"nose\"\n");
    assert!(error.contains("no [[probe]] 'nose'") && error.contains("tip"), "{error}");
    let error = refused(&[(TRANSITION, SKIN)], "[network]\nintegrator = \"fast\"\n");
    assert!(error.contains("'default'"), "{error}");
    let error = refused(&[("step = 60", "step = 60\nwarm_up_tolerance = 1")], "");
    assert!(error.contains("periodic"), "{error}");
}

/// A heater whose probe begins below its band is on from the first step, and one above it off, whatever `initially_on` says. Within the band that key decides.
#[test]
fn a_heater_that_begins_beyond_its_band_is_on_or_off_by_that() {
    let context = context();
    let ends = |kelvin: f64, power: f64, key: &str| {
        let tail = format!(
            "[[heater]]\npart = \"body\"\npower = {power}\nprobe = \"side\"\non_below = 281\noff_above = 283\n{key}\
             [[probe]]\nname = \"side\"\nposition = [1, 0, 0]\npart = \"body\"\n[initial]\ntemperature = {kelvin}\n"
        );
        let prepared = Folder::new(&(scene_with(&[(TRANSITION, SKIN)]) + &tail)).prepared();
        let first = |engine: &mut dyn Engine| history(&prepared, engine)[1].clone();
        let device = first(&mut DeviceEngine::new(&context, &prepared, None).expect("a small scene"));
        [device, first(&mut ReferenceEngine::new(&prepared, None))]
    };
    let (on, off) = ("initially_on = true\n", "");
    let apart = |[a, b]: [&Vec<f64>; 2]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    for (kelvin, is_on) in [(278.0, true), (292.0, false)] {
        let without = ends(kelvin, 0.0, off);
        for key in [on, off] {
            for (engine, found) in ends(kelvin, 3000.0, key).iter().enumerate() {
                let heated = apart([found, &without[engine]]);
                assert!((heated > 0.1) == is_on, "{kelvin} K, engine {engine}, '{key}': {heated} K by the heater");
            }
        }
    }
    let within = [on, off].map(|key| ends(282.0, 3000.0, key));
    assert!((0..2).all(|engine| apart([&within[0][engine], &within[1][engine]]) > 0.1));
}

#[test]
fn a_heater_whose_band_can_not_hold_is_named_with_its_probe() {
    let tail = "[[heater]]\npart = \"body\"\npower = 1e5\nprobe = \"side\"\non_below = 400\noff_above = 400.0001\n\
                initially_on = true\n\
                [[probe]]\nname = \"side\"\nposition = [1, 0, 0]\npart = \"body\"\n[initial]\ntemperature = 399\n";
    let scene = scene_with(&[(TRANSITION, SKIN)]) + tail;
    let folder = Folder::new(&scene);
    let ran = run_program(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    assert_eq!(ran.code, 2, "{}", ran.err);
    for part in ["heater of 'body', sensed at probe 'side'", "times within", "from 400 to 400.0001 K", "widen the band"]
    {
        assert!(ran.err.contains(part), "{part}: {}", ran.err);
    }
}
