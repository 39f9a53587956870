//! The energy balance of a run: what the device sums against the reference, and whether a network closes.

use isotherm::EngineError;
use isotherm::internals::{Account, DeviceEngine, EnergyBalance, Engine, Prepared, ReferenceEngine, run, start};

use super::craft::{Folder, never, scene_with};
use super::device::{assert_silent, context};
use super::mesh_network::{CELLS, SKIN, TRANSITION};

const WINGS: &str =
    "response = \"network\"\nthickness = 0.0005\ndensity = 3000\nspecific_heat = 900\nconductivity = 0\n";
const HEATER: &str = "[[heater]]\npart = \"body\"\npower = 3000\nprobe = \"side\"\non_below = 288\noff_above = 291\n\
                      [[probe]]\nname = \"side\"\nposition = [1, 0, 0]\npart = \"body\"\n\
                      [[heater]]\npart = \"wing_starboard\"\npower = 20\n";

/// A network with two heaters, through the entry into eclipse.
fn network(integrator: &str) -> Prepared {
    let scene = scene_with(&[
        ("step = 60\nsteps = 12", "step = 15\nsteps = 48\nwarm_up_orbits = 0"),
        (TRANSITION, SKIN),
        (CELLS, WINGS),
    ]);
    let settings = format!("[initial]\ntemperature = 290\n[network]\nintegrator = \"{integrator}\"\n");
    Folder::new(&(scene + HEATER + &settings)).prepared()
}

/// The balance of a run, with all absorbed heat times a factor.
fn balance(prepared: &Prepared, engine: &mut dyn Engine, factor: f64) -> EnergyBalance {
    start(prepared, engine, None, &never(), &mut || ()).expect("the engine starts");
    let mut account = Account::open(prepared, engine).expect("temperatures");
    run::<EngineError>(prepared, engine, None, &never(), &mut |result| {
        let delivered = result.delivered;
        let absorbed: Option<Vec<f64>> = delivered.absorbed.map(|heat| heat.iter().map(|one| factor * one).collect());
        assert_eq!(absorbed.is_some(), result.step > 0, "heat is absorbed in steps");
        account.take(&delivered.temperatures.expect("a run reads temperatures"), absorbed.as_deref());
        Ok(())
    })
    .expect("the engine runs");
    let time = &prepared.scene.time;
    account.close(prepared, engine, f64::from(time.steps) * time.step).expect("temperatures")
}

fn on_device(prepared: &Prepared, factor: f64) -> EnergyBalance {
    let context = context();
    let mut engine = DeviceEngine::new(&context, prepared, None).expect("a small scene");
    let found = balance(prepared, &mut engine, factor);
    assert_silent(&context);
    found
}

#[test]
fn a_network_closes_and_a_wrong_load_does_not() {
    for integrator in ["one_pass", "accurate"] {
        let prepared = network(integrator);
        let found = on_device(&prepared, 1.0);
        let closure = found.closure.expect("a network");
        assert!(closure < 1e-4, "{integrator}: {closure}");
        let all = &found.all;
        assert!(all.absorbed_j > 1e6 && all.emitted_j > 1e6 && all.unstored_j.abs() < 1e-6 * all.absorbed_j, "{all:?}");
        // The second heater is always on: 20 W over 720 s.
        let wing = found.parts.iter().find(|part| part.part == "wing_starboard").expect("a wing");
        assert!((wing.heated_j - 14_400.0).abs() < 1e-6, "{wing:?}");
        let body = found.parts.iter().find(|part| part.part == "body").expect("a body");
        assert!(body.heated_j > 0.0 && body.heated_j < 3000.0 * 720.0, "the thermostat switches: {body:?}");
        let wrong = on_device(&prepared, 1.001).closure.expect("a network");
        assert!(wrong > 5e-4, "{integrator}: {wrong}");
    }
}

#[test]
fn the_device_absorbs_what_the_reference_absorbs() {
    // Transitions, an instant mast, and in the second scene a network.
    let scenes = [Folder::new(&scene_with(&[])).prepared(), network("one_pass"), network("accurate")];
    for prepared in &scenes {
        let device = on_device(prepared, 1.0);
        let twin = balance(prepared, &mut ReferenceEngine::new(prepared, None), 1.0);
        for (device, twin) in device.parts.iter().zip(&twin.parts) {
            let off = (device.absorbed_j - twin.absorbed_j).abs() / twin.absorbed_j;
            assert!(off < 1e-5, "{device:?}\n{twin:?}");
        }
        let off = on_device(prepared, 1.0001).all.absorbed_j / twin.all.absorbed_j - 1.0;
        assert!(off > 5e-5, "a small error must show: {off}");
    }
    let transitions = on_device(&scenes[0], 1.0);
    assert!(transitions.closure.is_none() && transitions.all.stored_j == 0.0);
    let [mast] = transitions.parts.iter().filter(|part| part.part == "mast").collect::<Vec<_>>()[..] else {
        panic!("one mast: {transitions:?}")
    };
    assert!(mast.unstored_j.abs() < 1e-5 * mast.absorbed_j, "an instant surface emits what it absorbs: {mast:?}");
}

/// The heat that plates by themselves absorb is not kept: a table of zeros would say that they absorb none.
#[test]
fn parts_without_an_account_are_not_told_as_zeros() {
    let plate = "response = \"radiative\"\nthickness = 0.002\ndensity = 2700\nspecific_heat = 900\n";
    let prepared = Folder::new(&scene_with(&[(TRANSITION, plate)])).prepared();
    let found = balance(&prepared, &mut ReferenceEngine::new(&prepared, None), 1.0);
    let transitions = Folder::new(&scene_with(&[])).prepared();
    let all = balance(&transitions, &mut ReferenceEngine::new(&transitions, None), 1.0);
    assert!(found.parts.iter().all(|part| part.absorbed_j > 0.0), "{found:?}");
    assert!(!found.parts.is_empty() && found.parts.len() < all.parts.len(), "{found:?}");
}

#[test]
fn a_scene_may_leave_the_balance_out() {
    let prepared = Folder::new(&(scene_with(&[]) + "[output]\nenergy_balance = false\n")).prepared();
    let context = context();
    let mut engine = DeviceEngine::new(&context, &prepared, None).expect("a small scene");
    start(&prepared, &mut engine, None, &never(), &mut || ()).expect("the engine starts");
    run::<EngineError>(&prepared, &mut engine, None, &never(), &mut |result| {
        assert!(result.delivered.absorbed.is_none());
        Ok(())
    })
    .expect("the engine runs");
}
