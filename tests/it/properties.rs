//! Properties of any scene: start, rest without sources, energy, areas, and responses that coincide.

use isotherm::internals::{
    DeviceData, DeviceEngine, Engine, EngineOrder as Order, EngineStep, GROUP, PADDING, Prepared, ReferenceNode,
    STEFAN_BOLTZMANN, absorbed_flux, commanded_temperature, emissivity_sum, incident, run, start,
};
use isotherm::{EngineError, internals};

use super::craft::{AREA, Folder, glb_of_box, never, scene_with};
use super::device::{Worst, assert_silent, context};

/// Temperatures of all nodes [K] at every step of a run, without padding.
fn history(prepared: &Prepared, engine: &mut dyn Engine) -> Vec<Vec<f64>> {
    start(prepared, engine, None, &never(), &mut || ()).expect("the engine starts");
    let mut history = Vec::new();
    let complete = run::<EngineError>(prepared, engine, None, &never(), &mut |result| {
        let all = result.delivered.temperatures.expect("a run reads temperatures");
        history.push(real_nodes(prepared).map(|node| f64::from(all[node])).collect());
        Ok(())
    });
    assert!(complete.expect("the engine runs"));
    history
}

fn real_nodes(prepared: &Prepared) -> impl Iterator<Item = usize> {
    let vertices = &prepared.nodes.vertex_of_node;
    (0..vertices.len()).filter(|node| vertices[*node] != PADDING)
}

/// The run of a scene on the device.
fn on_device(prepared: &Prepared) -> Vec<Vec<f64>> {
    let context = context();
    let found = {
        let mut engine = DeviceEngine::new(&context, prepared, None).expect("a small scene");
        history(prepared, &mut engine)
    };
    assert_silent(&context);
    found
}

/// The craft of a scene without pictures.
fn blind(changes: &[(&str, &str)]) -> Prepared {
    Folder::new(&scene_with(&[&[("draw_every = 4", "draw_every = 0")], changes].concat())).prepared()
}

fn name(node: usize) -> String {
    format!("node {node}")
}

#[test]
fn at_time_0_every_node_is_settled_at_the_balance_of_the_epoch() {
    let prepared = blind(&[]);
    let found = on_device(&prepared);
    assert_eq!(found.len(), 13, "the initial state and twelve steps");
    let first = prepared.loads.step_load(0.0, 0.0);
    let balance = |load| -> Vec<f64> {
        let command = |node: ReferenceNode| {
            commanded_temperature(&incident, &node, &prepared.materials[node.material as usize], load)
        };
        real_nodes(&prepared).map(|slot| command(prepared.nodes.reference_node(slot))).collect()
    };
    Worst::of(&found[0], &balance(&first), name).within(5e-4, "K", "state at time 0");
    let second = Worst::of(&found[0], &balance(&prepared.loads.step_load(60.0, 120.0)), name);
    assert!(second.difference > 1.0, "the balance of the second load must show: {second:?}");
    // A settled state is at rest: the same load changes nothing.
    let context = context();
    let mut engine = DeviceEngine::new(&context, &prepared, None).expect("a small scene");
    start(&prepared, &mut engine, None, &never(), &mut || ()).expect("the engine starts");
    let mut state = || {
        engine
            .submit(
                Some(EngineStep { load: &first, steps: 1.0, start: 0.0, length: 1.0 }),
                Order { temperatures: true, ..Order::default() },
            )
            .expect("a step");
        engine.deliver().expect("the device answers").temperatures.expect("temperatures were ordered")
    };
    assert_eq!(state(), state());
    assert!(real_nodes(&prepared).zip(&found[0]).all(|(node, before)| f64::from(state()[node]) == *before));
}

#[test]
fn a_stated_initial_temperature_is_the_start() {
    let prepared = blind(&[("[radiance]", "[initial]\ntemperature = 290\n[radiance]")]);
    let found = on_device(&prepared);
    assert!(found[0].iter().all(|temperature| *temperature == 290.0));
    assert!(found[1].iter().any(|temperature| (temperature - 290.0).abs() > 1.0));
}

#[test]
fn without_any_source_everything_comes_to_the_background() {
    let sources = "solar_constant = 1361\nalbedo = 0.3\nplanet_ir = 237\n";
    let prepared = blind(&[
        (sources, ""),
        ("background_temperature = 2.7", "background_temperature = 30"),
        ("steps = 12", "steps = 40"),
        ("[radiance]", "[initial]\ntemperature = 290\n[radiance]"),
    ]);
    let found = on_device(&prepared);
    // The slowest material needs 30 steps.
    for (step, temperatures) in found.iter().enumerate() {
        let all = temperatures.iter().all(|temperature| (temperature - 30.0).abs() < 1e-4);
        assert_eq!(all, step >= 30, "step {step}");
        assert!(temperatures.iter().all(|temperature| (29.999..=290.0).contains(temperature)), "step {step}");
    }
    let falling = found.windows(2).all(|pair| pair[0].iter().zip(&pair[1]).all(|(before, after)| after <= before));
    assert!(falling, "nothing warms up in the dark");
}

/// Total emitted and total absorbed power of all nodes [W].
fn power(prepared: &Prepared, temperatures: &[f64], time: f64) -> (f64, f64) {
    let load = prepared.loads.step_load(time - prepared.scene.time.step, time);
    let nodes = real_nodes(prepared).map(|slot| prepared.nodes.reference_node(slot));
    let (mut emitted, mut absorbed) = (0.0, 0.0);
    for ((place, node), temperature) in real_nodes(prepared).zip(nodes).zip(temperatures) {
        let (area, material) = (prepared.nodes.areas[place], &prepared.materials[node.material as usize]);
        let front = incident(&load, node.normal);
        absorbed += area * absorbed_flux(material, front, || incident(&load, -node.normal));
        let background = load.background_temperature.powi(4);
        emitted += area * emissivity_sum(material) * STEFAN_BOLTZMANN * (temperature.powi(4) - background);
    }
    (emitted, absorbed)
}

#[test]
fn an_instant_body_in_sunlight_emits_what_it_absorbs() {
    let folder = Folder::new(&scene_with(&[
        ("draw_every = 4", "draw_every = 0"),
        ("albedo = 0.3\nplanet_ir = 237\n", ""),
        ("eclipse = true", "eclipse = false"),
        ("part = \"wing_starboard\"\n", ""),
        (
            "response = \"transition\"\nretarget = \"merge\"\nheating = { function = \"quadratic\", t_max_steps = 20 }\n\
          cooling = { function = \"linear\", t_max_steps = 30 }",
            "response = \"instant\"",
        ),
    ]));
    glb_of_box().save(folder.0.path());
    let prepared = folder.prepared();
    assert!((prepared.model.area - 24.0).abs() < 1e-9);
    let found = on_device(&prepared);
    for (step, temperatures) in found.iter().enumerate().skip(1) {
        let time = 60.0 * step as f64;
        let (emitted, absorbed) = power(&prepared, temperatures, time);
        assert!((emitted / absorbed - 1.0).abs() < 1e-6, "step {step}: {emitted} W against {absorbed} W");
        let late = power(&prepared, temperatures, time + 60.0).1;
        assert!((emitted / late - 1.0).abs() > 1e-6, "the next step's sunlight must show");
        // A convex body absorbs the flux on its shadow. The cube's shadow is 4 (|x| + |y| + |z|) for sunlight along x,
        // y, z.
        let shadow = |time: f64| 4.0 * prepared.loads.sky_model().sun_direction(time).abs().element_sum();
        let mean = (0..600).map(|part| shadow(time - 60.0 + 0.1 * (f64::from(part) + 0.5))).sum::<f64>() / 600.0;
        assert!((absorbed / (0.29 * 1361.0 * mean) - 1.0).abs() < 2e-4, "step {step}: {absorbed} W on {mean} m2");
    }
}

const SKIN: &str = "heating = { function = \"quadratic\", t_max_steps = 20 }\n\
                    cooling = { function = \"linear\", t_max_steps = 30 }";
const CELLS: &str = "heating = { function = \"quadratic\", t_max_steps = 4 }\n\
                     cooling = { function = \"quadratic\", t_max_steps = 6 }";

#[test]
fn a_transition_that_takes_no_time_is_instant() {
    let immediate = "heating = { function = \"quadratic\", t_max_steps = 0 }\n\
                     cooling = { function = \"linear\", t_max_steps = 0 }";
    let transition = on_device(&blind(&[(SKIN, immediate), (CELLS, immediate)]));
    let transitions = "response = \"transition\"\nretarget = \"merge\"\n";
    let instant = "response = \"instant\"\n";
    let of = |profile: &str| format!("{transitions}{profile}\n");
    let instant = on_device(&blind(&[(&of(SKIN), instant), (&of(CELLS), instant)]));
    // The two scenes have different node orders, so sorted lists are compared.
    for (step, (mut one, mut other)) in transition.into_iter().zip(instant).enumerate() {
        one.sort_by(f64::total_cmp);
        other.sort_by(f64::total_cmp);
        assert_eq!(one, other, "step {step}");
    }
    let slow = on_device(&blind(&[]));
    let fast = on_device(&blind(&[(SKIN, immediate)]));
    assert!(Worst::of(&slow[12], &fast[12], name).difference > 1.0, "inertia must show");
}

#[test]
fn areas_and_switches() {
    let prepared = blind(&[]);
    assert!((prepared.model.area / AREA - 1.0).abs() < 1e-7, "{}", prepared.model.area);
    let shares: f64 = prepared.nodes.areas.iter().sum();
    assert!((shares / AREA - 1.0).abs() < 1e-7, "{shares}");
    assert_eq!(prepared.nodes.vertex_of_node.len() % GROUP, 0);
    // Variants and buffers lack everything that a scene switches off.
    for (change, resource, word) in [
        (("solar_constant = 1361\nalbedo = 0.3\n", ""), &internals::ALBEDO_VALUES, "sun"),
        (("albedo = 0.3\n", ""), &internals::ALBEDO_VALUES, "albedo"),
        (("planet_ir = 237\n", ""), &internals::STEP_RESOURCE, "planet_ir"),
    ] {
        let other = blind(&[change]);
        for (prepared, there) in [(&prepared, true), (&other, false)] {
            let data = DeviceData::new(prepared);
            let data = data.scene_data(prepared, None);
            let named = data.ranges.iter().all(|range| range.variant.shader().words.contains(&word));
            assert_eq!(named, there, "{word}");
            let buffer = data.plan().iter().any(|planned| planned.resource == resource);
            assert_eq!(buffer, there || resource == &internals::STEP_RESOURCE, "{resource:?}");
            assert!(!data.plan().iter().any(|planned| planned.resource.role.is_image()), "nothing is drawn");
        }
    }
}
