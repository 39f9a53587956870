//! The stated error of the step length against runs in much shorter steps.

use std::f64::consts::SQRT_2;

use isotherm::EngineError;
use isotherm::internals::{Check, DeviceEngine, Prepared, ReferenceEngine, StepLengthError, run, start};
use serde_json::Value;

use super::craft::{Folder, never, scene_with};
use super::device::context;
use super::mesh_network::{CELLS, TRANSITION, history};
use super::program;

/// Length of a step [s], and steps in which the craft enters the planet's shadow.
const STEP: f64 = 22.0;
const STEPS: u32 = 40;
/// Parts of a step in the run that counts as exact.
const FINE: u32 = 16;

const NETWORK: &str =
    "response = \"network\"\nthickness = 0.001\ndensity = 1000\nspecific_heat = 1000\nconductivity = 1e-3\n";
const SLOW: &str = "response = \"transition\"\nheating = { function = \"quadratic\", t_max = 240 }\n\
                    cooling = { function = \"quadratic\", t_max = 360 }\n";
const INSTANT: &str = "response = \"instant\"\n";

/// Dark walls and wings with the given responses. The network has 1000 J/(m2 K) and hardly conducts.
fn scene(step: f64, steps: u32, [walls, wings]: [&str; 2]) -> String {
    scene_with(&[
        ("step = 60\nsteps = 12", &format!("step = {step}\nsteps = {steps}\nwarm_up_orbits = 0")),
        (TRANSITION, walls),
        (CELLS, wings),
        ("absorptivity = 0.29", "absorptivity = 0.9"),
    ]) + "[initial]\ntemperature = 290\n"
}

/// The scene without parts of steps.
fn in_whole_steps(mut prepared: Prepared) -> Prepared {
    prepared.loads = prepared.loads.clone().with_parts_of(f64::INFINITY);
    prepared
}

fn stated(prepared: &Prepared) -> StepLengthError {
    let mut engine = ReferenceEngine::new(prepared, None);
    let mut check = Check::new(prepared, usize::MAX);
    start(prepared, &mut engine, Some(&mut check), &never(), &mut || ()).expect("the engine starts");
    run::<EngineError>(prepared, &mut engine, Some(&mut check), &never(), &mut |_| Ok(())).expect("the engine runs");
    check.accuracy(prepared).step_length.expect("nodes that store heat")
}

/// Largest difference, and root mean square difference by area [K], of the nodes of some materials.
fn apart(prepared: &Prepared, coarse: &[Vec<f64>], fine: &[Vec<f64>], materials: &[&str]) -> [f64; 2] {
    let nodes = &prepared.nodes;
    let real =
        (0..nodes.vertex_of_node.len()).filter(|slot| nodes.vertex_of_node[*slot] != isotherm::internals::PADDING);
    let is_meant =
        |slot: usize| materials.contains(&prepared.materials[nodes.group_material[slot / 4] as usize].name.as_str());
    let weights: Vec<f64> = real.map(|slot| if is_meant(slot) { nodes.areas[slot] } else { 0.0 }).collect();
    let pairs = coarse.iter().zip(fine).skip(1).flat_map(|(a, b)| a.iter().zip(b).zip(&weights));
    let (mut largest, mut sums) = (0.0f64, [0.0, 0.0]);
    for ((a, b), weight) in pairs.filter(|(_, weight)| **weight > 0.0) {
        largest = largest.max((a - b).abs());
        sums = [sums[0] + weight, sums[1] + weight * (a - b) * (a - b)];
    }
    [largest, (sums[1] / sums[0]).sqrt()]
}

/// Largest and root mean square error [K], as stated and as found, of the nodes of one material. All steps are whole, so that the Sun leaves inside of one.
fn errors(responses: [&str; 2], material: &str) -> [[f64; 2]; 2] {
    let prepared = in_whole_steps(Folder::new(&scene(STEP, STEPS, responses)).prepared());
    let fine = Folder::new(&scene(STEP / f64::from(FINE), STEPS * FINE, responses)).prepared();
    let whole = |prepared: &Prepared| history(prepared, &mut ReferenceEngine::new(prepared, None));
    let exact: Vec<Vec<f64>> = whole(&fine).into_iter().step_by(FINE as usize).collect();
    let found = apart(&prepared, &whole(&prepared), &exact, &[material]);
    let stated = stated(&prepared);
    println!("{material}: found {found:.4?} K, stated {:.4} and {:.4} K", stated.max_k, stated.rms_k);
    assert!(stated.worst_node.contains(material) && stated.worst_time_s > 0.0, "{stated:?}");
    [[stated.max_k, stated.rms_k], found]
}

/// The stated figure is twice the difference to half the step. That is 1 to 2 times the error where the Sun leaves inside a step, and 3/2 of an error of
/// order 2. Without the estimate the run states 0.
#[test]
#[ignore = "long: tools/test --all"]
fn the_error_of_the_step_length_is_stated() {
    let [[max, rms], found] = errors([NETWORK, INSTANT], "skin");
    assert!(found[0] > 0.1, "the eclipse must show: {} K", found[0]);
    for (stated, found) in [(max, found[0]), (rms, found[1])] {
        assert!((0.95..2.1).contains(&(stated / found)), "{stated} K for {found} K");
    }
    // A transition takes the mean load at the start of the step, so the sign of its error depends on when in a step the Sun leaves.
    let [[max, rms], found] = errors([INSTANT, SLOW], "cells");
    for (stated, found) in [(max, found[0]), (rms, found[1])] {
        assert!((0.95..3.0).contains(&(stated / found)), "{stated} K for {found} K");
    }
    // A longer step must show.
    let longer = stated(&Folder::new(&scene(2.0 * STEP, STEPS / 2, [INSTANT, SLOW])).prepared());
    assert!(longer.max_k > SQRT_2 * max, "{} K for {max} K", longer.max_k);
}

/// A foil, an array and a panel: heat capacities [J/(m2 K)].
const CAPACITIES: [f64; 3] = [77.0, 1350.0, 5000.0];

/// Dark walls and wings of one heat capacity [J/(m2 K)], by themselves or in a network without conduction, for 1440 s about the entry into eclipse.
fn plates(step: f64, capacity: f64, response: &str) -> String {
    let conducts = if response == "network" { "thickness = 0.001\nconductivity = 0\n" } else { "" };
    let plate = format!("response = \"{response}\"\nheat_capacity_per_area = {capacity}\n{conducts}");
    scene(step, (1440.0 / step).round() as u32, [&plate, &plate]).replace("max_edge = 0.7", "max_edge = 5")
}

fn temperatures(scene: &str) -> Vec<Vec<f64>> {
    let prepared = Folder::new(scene).prepared();
    history(&prepared, &mut ReferenceEngine::new(&prepared, None))
}

/// Largest and root mean square difference [K] of walls and wings from steps of 1/8 s.
fn off(prepared: &Prepared, fine: &[Vec<f64>]) -> [f64; 2] {
    let steps = (8.0 * prepared.scene.time.step).round() as usize;
    let exact: Vec<Vec<f64>> = fine.iter().step_by(steps).cloned().collect();
    apart(prepared, &history(prepared, &mut ReferenceEngine::new(prepared, None)), &exact, &["skin", "cells"])
}

/// The same with a craft that keeps its face to the Sun and no planet: only the eclipse changes the load.
fn facing_the_sun(step: f64, response: &str) -> String {
    plates(step, 77.0, response)
        .replace(
            "mode = \"nadir\"\nnadir_axis = \"+Z\"\nforward_axis = \"+X\"",
            "mode = \"sun\"\nsun_axis = \"+X\"\nnorth_axis = \"+Z\"",
        )
        .replace("albedo = 0.3\nplanet_ir = 237\n", "")
}

/// Issue 29.4: a foil that enters the eclipse is right to 0.5 K at steps of 15 s, and of a minute. With the mean load of the whole step it is not.
#[test]
fn a_foil_crosses_the_penumbra() {
    for response in ["radiative", "network"] {
        let fine = temperatures(&facing_the_sun(0.125, response));
        for step in [15.0, 60.0] {
            let prepared = Folder::new(&facing_the_sun(step, response)).prepared();
            let [largest, rms] = off(&prepared, &fine);
            println!("{response}, {step} s: at most {largest:.3} K, rms {rms:.3} K");
            assert!(largest < 0.5, "{response}, {step} s: {largest} K");
            let [without, _] = off(&in_whole_steps(prepared), &fine);
            println!("{response}, {step} s: at most {without:.3} K in whole steps");
            assert!(without > 4.0, "{response}, {step} s: {without} K in whole steps");
        }
    }
}

/// The device takes the same parts.
#[test]
fn a_foil_crosses_the_penumbra_on_a_device() {
    let context = context();
    for response in ["radiative", "network"] {
        let prepared = Folder::new(&plates(15.0, 77.0, response)).prepared();
        let device = history(&prepared, &mut DeviceEngine::new(&context, &prepared, None).expect("an engine"));
        let twin = history(&prepared, &mut ReferenceEngine::new(&prepared, None));
        let pairs = device.iter().zip(&twin).flat_map(|(a, b)| a.iter().zip(b));
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-3, "{response}: {worst} K");
    }
}

/// Issue 29.8: the stated error does not fall below the error, at steps from a second to two minutes.
#[test]
#[ignore = "long: tools/test --all"]
fn the_stated_error_is_not_below_the_error() {
    for response in ["radiative", "network"] {
        for capacity in CAPACITIES {
            let fine = temperatures(&plates(0.125, capacity, response));
            for step in [1.0, 15.0, 60.0, 120.0] {
                let prepared = Folder::new(&plates(step, capacity, response)).prepared();
                let [largest, rms] = off(&prepared, &fine);
                let stated = stated(&prepared);
                println!(
                    "{response}, {capacity} J/(m2 K), {step} s: largest {:.4} for {largest:.4} K, rms {:.4} for {rms:.4} K",
                    stated.max_k, stated.rms_k
                );
                // The fine steps err too.
                assert!(stated.max_k > 0.98 * largest - 2e-3, "{} K for {largest} K", stated.max_k);
                assert!(stated.rms_k > 0.98 * rms - 1e-3, "{} K for {rms} K", stated.rms_k);
                assert!(stated.max_k < 4.0 * largest + 0.02, "{} K for {largest} K", stated.max_k);
            }
        }
    }
}

/// Issue 29.8: the balance at the start is that of the start, whatever the length of a step.
#[test]
fn the_balance_at_the_start_does_not_depend_on_the_step() {
    let start = |step: f64| {
        let scene = scene(step, 1, [NETWORK, SLOW]).replace("[initial]\ntemperature = 290\n", "");
        temperatures(&scene).swap_remove(0)
    };
    let short = start(1.0);
    for step in [60.0, 600.0] {
        let worst = start(step).iter().zip(&short).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-6, "{step} s: {worst} K");
    }
}

/// A network that the check can not step in halves states the error of its nodes by themselves. A fine mesh states the same as a coarse one.
#[test]
#[ignore = "long: tools/test --all"]
fn a_large_network_states_its_error_too() {
    let of = |edge: f64| {
        let scene = scene(STEP, 8, [NETWORK, INSTANT]).replace("max_edge = 0.7", &format!("max_edge = {edge}"));
        let prepared = Folder::new(&scene).prepared();
        let nodes = prepared.network.as_ref().expect("a network").network().len();
        (nodes, stated(&prepared))
    };
    let ((few, coarse), (many, fine)) = (of(0.5), of(0.07));
    println!("{few} nodes: {coarse:?}\n{many} nodes: {fine:?}");
    assert!(few < 5000 && many > 5000, "{few} and {many} nodes");
    assert!(!coarse.measure.contains("by themselves") && fine.measure.contains("by themselves"));
    assert!((0.8..1.25).contains(&(fine.max_k / coarse.max_k)), "{} and {} K", fine.max_k, coarse.max_k);
    assert!((0.8..1.25).contains(&(fine.rms_k / coarse.rms_k)), "{} and {} K", fine.rms_k, coarse.rms_k);
}

/// Surfaces that radiate to each other are compared with the reference up to 20,000 nodes. Beyond that the error of the step length is still stated.
#[test]
#[ignore = "long: tools/test --all"]
fn a_large_craft_with_exchange_states_its_error_too() {
    let of = |edge: f64| {
        let plate = "response = \"radiative\"\nheat_capacity_per_area = 1000\n";
        let scene = scene(STEP, 4, [plate, INSTANT]).replace("max_edge = 0.7", &format!("max_edge = {edge}"));
        stated(&Folder::new(&(scene + "[shadows]\n[exchange]\npatch_edge = 2\nrays = 64\n")).prepared())
    };
    let (coarse, fine) = (of(0.5), of(0.04));
    println!("{coarse:?}\n{fine:?}");
    assert!(!coarse.measure.contains("by themselves") && fine.measure.contains("by themselves"));
    assert!((0.7..1.4).contains(&(fine.max_k / coarse.max_k)), "{} and {} K", fine.max_k, coarse.max_k);
}

#[test]
#[ignore = "long: tools/test --all"]
fn a_run_says_the_error_of_its_step_length() {
    let folder = Folder::new(&scene(STEP, STEPS, [NETWORK, SLOW]));
    let said = program::succeed(folder.0.path(), &["run", "scene.toml", "-o", "out"]);
    assert!(said.contains("error of the step length: at most "), "{said}");
    let report: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path("out/report.json")).expect("a report"))
            .expect("JSON");
    let stated = &report["accuracy"]["step_length"];
    assert!(stated["max_k"].as_f64().is_some_and(|max| max > 0.2), "{stated}");
    let page = std::fs::read_to_string(folder.path("out/report.html")).expect("a page");
    assert!(page.contains("Error of the step length"));

    // A craft without inertia has none.
    let folder = Folder::new(&scene(STEP, STEPS, [INSTANT; 2]));
    let said = program::succeed(folder.0.path(), &["run", "scene.toml", "-o", "out"]);
    assert!(said.contains("against the f64 reference") && !said.contains("error of the step length"), "{said}");
}
