//! Runs that are killed at random moments and resumed leave the files of an undisturbed run.

#[path = "../../tools/src/kills/craft.rs"]
mod craft;
#[path = "../../tools/src/kills/trial.rs"]
mod trial;

use std::path::Path;

use super::random::Random;
use trial::{NETWORK, TRANSITION, Trial};

/// Returns how many kills fell into the warm-up.
fn kill(scene: &str, device: Option<&str>, steps: u32, kills: u32, first: u32) -> u32 {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let program = Path::new(env!("CARGO_BIN_EXE_isotherm"));
    let trial = Trial::new(program, folder.path(), scene, steps, device).expect("an undisturbed run");
    let seed = 0x5DEE_CE66 + u64::from(first);
    let mut random = Random(seed);
    let met = trial.run(kills, first, &mut || random.unit()).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
    assert!(met.files > 10 && met.kills.values().sum::<u32>() == kills);
    met.in_warm_up
}

#[test]
fn a_transition_with_joints_survives_a_kill_and_a_signal() {
    kill(TRANSITION, Some("cpu"), 150, 2, 0);
}

#[test]
#[ignore = "long: tools/test --all"]
fn a_network_with_thermostats_survives_a_kill_on_the_device() {
    kill(NETWORK, None, 100, 1, 0);
}

/// Images state their errors, which go on from the saved ones.
#[test]
fn stated_errors_survive_a_kill() {
    kill(&format!("{TRANSITION}\n[output]\nerror = true\n"), Some("cpu"), 60, 2, 0);
}

/// Nine tenths of this run are its warm-up.
#[test]
#[ignore = "long: tools/test --all"]
fn a_warm_up_goes_on_after_kills() {
    let long = TRANSITION.replace("warm_up_orbits = 0.6", "warm_up_orbits = 3");
    assert!(kill(&long, Some("cpu"), 40, 3, 0) > 0, "no kill fell into the warm-up");
}

/// A periodic warm-up goes on from the start of the orbit.
#[test]
#[ignore = "long: tools/test --all"]
fn a_periodic_warm_up_goes_on_after_a_kill() {
    let (before, rest) = NETWORK.split_once("[[heater]]").expect("heaters");
    let (_, after) = rest.split_once("[[probe]]").expect("a probe after them");
    let periodic = format!("{before}[[probe]]{after}");
    let orbits = "warm_up = \"periodic\"\nwarm_up_tolerance = 1e-6\nwarm_up_orbits = 6";
    let periodic = periodic.replace("warm_up_orbits = 0.6", orbits);
    assert!(periodic.contains("periodic"));
    assert!(kill(&periodic, Some("cpu"), 40, 3, 0) > 0, "no kill fell into the warm-up");
}

/// The network in sub-steps.
fn sub_steps() -> String {
    format!("{NETWORK}\n[network]\nintegrator = \"cheap\"\ntolerance = 0.005\n")
}

#[test]
#[ignore = "long: tools/test --all"]
fn a_network_in_sub_steps_survives_a_kill_on_the_device() {
    kill(&sub_steps(), None, 100, 2, 0);
}

#[test]
#[ignore = "long: tools/test --all"]
fn every_kind_of_scene_survives_many_kills_on_every_engine() {
    let sub_steps = sub_steps();
    for (first, scene, device) in [
        (0, TRANSITION, Some("cpu")),
        (1, TRANSITION, None),
        (2, NETWORK, Some("cpu")),
        (0, NETWORK, None),
        (1, &sub_steps, Some("cpu")),
        (1, &sub_steps, None),
    ] {
        kill(scene, device, 200, 4, first);
    }
}
