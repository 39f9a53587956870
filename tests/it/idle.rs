//! A step with an unchanged load only evaluates transitions, and gives the same result.

use isotherm::internals::{DeviceEngine, Engine, EngineOrder as Order, EngineStep, Prepared, ReferenceEngine};

use super::craft::{Folder, scene_with};
use super::device::{Worst, assert_silent, context};

/// A craft that always faces the Sun in the same way, without planet and eclipse.
fn still() -> Prepared {
    let scene = scene_with(&[
        ("mode = \"nadir\"", "mode = \"inertial\"\nquaternion = [1, 0, 0, 0]"),
        ("nadir_axis = \"+Z\"\n", ""),
        ("forward_axis = \"+X\"\n", ""),
        ("albedo = 0.3\n", ""),
        ("planet_ir = 237\n", ""),
        ("eclipse = true", "eclipse = false"),
        ("draw_every = 4", "draw_every = 0"),
    ]);
    Folder::new(&scene).prepared()
}

#[test]
fn a_step_under_the_same_load_costs_its_transitions_only() {
    let prepared = still();
    let context = context();
    let step = prepared.scene.time.step;
    let mut engine = DeviceEngine::new(&context, &prepared, None).expect("a small scene");
    let mut reference = ReferenceEngine::new(&prepared, None);
    let nodes = prepared.nodes.vertex_of_node.len();
    let mut worst = Worst::none();
    for one in [&mut engine as &mut dyn Engine, &mut reference] {
        one.settle_at(250.0, nodes).expect("it settles");
    }
    for number in 0..6 {
        // The Sun is dimmer in the fourth step, so the fourth and the fifth step command new targets.
        let start = f64::from(number) * step;
        let mut load = prepared.loads.step_load(start, start + step);
        if number == 3 {
            load.sun.iter_mut().for_each(|sample| sample.flux *= 0.5);
        }
        let [found, expected] = [&mut engine as &mut dyn Engine, &mut reference].map(|one| {
            let advance = EngineStep { load: &load, steps: 1.0, start, length: step };
            one.submit(Some(advance), Order { temperatures: true, ..Order::default() }).expect("submitted");
            one.deliver().expect("delivered").temperatures.expect("temperatures")
        });
        for (node, (found, expected)) in found.iter().zip(&expected).enumerate() {
            if *expected > 0.0 {
                worst.see(f64::from(*found), f64::from(*expected), || format!("step {number}, node {node}"));
            }
        }
    }
    worst.within(2e-3, "K", "six steps, three of them idle");
    let ran = |word: &str| -> usize {
        let passes = engine.pass_times().expect("a device");
        passes.iter().filter(|(name, _)| name.contains(word)).map(|(_, samples)| samples.len()).sum()
    };
    let (commanding, idle) = (ran("thermal_step.merge") + ran("thermal_step.restart"), ran("thermal_step.advance"));
    assert!(idle > 0 && commanding == idle, "three steps of each kind: {commanding} and {idle} passes");
    assert_silent(&context);
}
