//! Plates by themselves on the device against their f64 twin: response `radiative`.

use std::sync::Arc;

use glam::DVec3;
use isotherm::EngineError;
use isotherm::internals::{
    Below, Check, Context, DeviceEngine, Engine, EngineOrder as Order, EngineStep, Material, Optics, Radiative,
    Reference, ReferenceEngine, RendererState, Request, Response, STEFAN_BOLTZMANN, Sides, StepLoad, incident, run,
    start,
};

use super::craft::{Folder, never, scene_with};
use super::device::{
    ALL, LooseNodes, Present, Worst, assert_silent, context, dark, material, planet, sunlight, temperatures,
};

/// A plate of 1.5 mm of aluminium, and one of a film.
const HEAVY: f64 = 3645.0;
const LIGHT: f64 = 60.0;
/// The structure below a blanket.
const BELOW: Below = Below { capacity: 8100.0, effective_emittance: 0.03 };
const SUN_ONLY: Present = Present { sun: true, planet_ir: false, albedo: false };

fn plate(capacity: f64, over: Option<Below>, step: f64) -> Response {
    Response::Radiative(Radiative { capacity, over, step, hottest: 400.0 })
}

/// The load at a share of an orbit. The last third of the orbit is in shadow.
fn orbit(share: f64) -> StepLoad {
    let angle = std::f64::consts::TAU * share;
    let sun = DVec3::new(angle.cos(), angle.sin(), 0.3).normalize();
    let lit = if share.fract() < 0.63 { 1361.0 } else { 0.0 };
    let sun_zenith = (angle.cos()).acos();
    StepLoad {
        sun: if lit > 0.0 { sunlight([(sun, lit)]) } else { Vec::new() },
        planet: Some(planet(-DVec3::X, DVec3::Y, 1.08, 237.0, sun_zenith)),
        ..dark(2.7)
    }
}

/// Largest difference between device and twin [K] over steps with these loads, from one temperature [K].
fn apart(nodes: &LooseNodes, context: &Arc<Context>, start: f64, loads: &[StepLoad], perturb: f64) -> Worst {
    let mut renderer = nodes.renderer(context, &[]);
    renderer.settle_at(&vec![start as f32; nodes.len()]).expect("the device settles");
    let mut materials = nodes.materials.clone();
    for material in &mut materials {
        let Response::Radiative(plate) = &mut material.response else { continue };
        plate.capacity *= 1.0 + perturb;
    }
    let mut reference = Reference::new(nodes.reference_nodes(), materials, incident);
    reference.settle_at(start);
    let mut worst = Worst::none();
    for (number, load) in loads.iter().enumerate() {
        let submitted = renderer.submit(Request::step(load, 1.0)).expect("the device steps");
        renderer.collect(submitted).expect("the device answers");
        reference.step(load, 1.0);
        if number % 7 == 0 || number + 1 == loads.len() {
            let found = temperatures(nodes, &mut renderer);
            for (node, (found, own)) in found.iter().zip(reference.temperatures()).enumerate() {
                worst.see(*found, *own, || format!("node {node} at step {number}"));
            }
        }
    }
    worst
}

fn materials(step: f64) -> Vec<Material> {
    let both = Sides::Both { back: Optics { absorptivity: 0.3, emissivity: 0.7 } };
    vec![
        material(0.3, 0.8, Sides::Outside, plate(HEAVY, None, step)),
        material(0.3, 0.8, Sides::Outside, plate(LIGHT, None, step)),
        material(0.8, 0.85, both, plate(HEAVY, None, step)),
        material(0.8, 0.85, both, plate(LIGHT, None, step)),
        material(0.14, 0.04, Sides::Outside, plate(LIGHT, Some(BELOW), step)),
        material(0.14, 0.04, both, plate(0.0, Some(BELOW), step)),
        material(
            0.3,
            0.8,
            Sides::Outside,
            plate(HEAVY, Some(Below { capacity: 464.0, effective_emittance: 0.5 }), step),
        ),
        // Eleven time constants in a step of 60 s.
        material(0.3, 0.8, Sides::Outside, plate(20.0, None, step)),
    ]
}

fn directions() -> Vec<DVec3> {
    [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z, DVec3::new(0.6, 0.64, 0.48)].to_vec()
}

/// Heavy and light plates, blankets and sheets over an orbit with eclipse.
#[test]
fn plates_follow_their_twin_over_an_orbit() {
    let context = context();
    for step in [15.0, 60.0] {
        let count = (5580.0 / step) as u32;
        let loads: Vec<StepLoad> = (0..count).map(|n| orbit(f64::from(n) / f64::from(count))).collect();
        let nodes = LooseNodes::new(ALL, materials(step), &directions());
        apart(&nodes, &context, 290.0, &loads, 0.0).within(1e-3, "K", &format!("an orbit in steps of {step} s"));
        let wrong = apart(&nodes, &context, 290.0, &loads, 1e-3);
        assert!(wrong.difference > 5e-3, "a capacity off by a thousandth must show: {}", wrong.difference);
    }
    assert_silent(&context);
}

/// A plate that only radiates, in steps of 11 time constants and less: T = (T0^-3 + 3 k t)^(-1/3).
#[test]
fn free_cooling_is_exact_on_the_device() {
    let context = context();
    for (capacity, step) in [(HEAVY, 15.0), (HEAVY, 600.0), (LIGHT, 60.0), (20.0, 60.0), (1.0, 1000.0)] {
        let own = material(0.3, 0.8, Sides::Outside, plate(capacity, None, step));
        let nodes = LooseNodes::new(SUN_ONLY, vec![own], &[DVec3::Z]);
        let mut renderer = nodes.renderer(&context, &[]);
        renderer.settle_at(&vec![390.0; nodes.len()]).expect("the device settles");
        let mut worst = Worst::none();
        for number in 1..=40 {
            let submitted = renderer.submit(Request::step(&dark(0.0), 1.0)).expect("the device steps");
            renderer.collect(submitted).expect("the device answers");
            let k = 0.8 * STEFAN_BOLTZMANN / capacity;
            let exact = (390f64.powi(-3) + 3.0 * k * step * f64::from(number)).powf(-1.0 / 3.0);
            worst.see(temperatures(&nodes, &mut renderer)[0], exact, || format!("step {number}"));
        }
        worst.within(3e-4, "K", &format!("{capacity} J/(m2 K), {step} s"));
    }
}

/// A slow plate and a blanket's structure, heated at 10, 100 and 1000 Hz, for 20 s. Plain f32 would stand still.
#[test]
fn slow_heating_does_not_stand_still() {
    let context = context();
    for (rate, error) in [(10.0, 1e-4), (100.0, 1e-4), (1000.0, 2e-4)] {
        let step = 1.0 / rate;
        let heavy = 2e5;
        let below = Below { capacity: 30.0 * BELOW.capacity, effective_emittance: 0.03 };
        let own = vec![
            material(0.3, 0.8, Sides::Outside, plate(heavy, None, step)),
            material(0.9, 0.05, Sides::Outside, plate(LIGHT, Some(below), step)),
        ];
        let nodes = LooseNodes::new(SUN_ONLY, own, &[DVec3::Z]);
        let load = StepLoad { sun: sunlight([(DVec3::Z, 1361.0)]), ..dark(2.7) };
        let mut renderer = nodes.renderer(&context, &[]);
        renderer.settle_at(&vec![200.0; nodes.len()]).expect("the device settles");
        let mut reference = Reference::new(nodes.reference_nodes(), nodes.materials.clone(), incident);
        reference.settle_at(200.0);
        let steps = 20 * rate as u32;
        let loads: Vec<(&StepLoad, f64)> = (0..steps).map(|_| (&load, 1.0)).collect();
        // Dispatches of many steps, and single steps.
        renderer.forward(&loads[..loads.len() / 2]).expect("the device steps");
        loads[loads.len() / 2..].iter().for_each(|(load, length)| {
            let submitted = renderer.submit(Request::step(load, *length)).expect("the device steps");
            renderer.collect(submitted).expect("the device answers");
        });
        (0..steps).for_each(|_| reference.step(&load, 1.0));
        // The structure shows in what the outside would be in balance with; the saved state has it.
        let saved = renderer.save().expect("the device saves");
        let structures = saved.buffer("Target").expect("the temperatures of the structures");
        let of_nodes: Vec<f64> = nodes.places().map(|place| f64::from(structures[place])).collect();
        let own: Vec<Option<f64>> = reference.structures().collect();
        let found = temperatures(&nodes, &mut renderer);
        let moved = reference.temperatures()[0] - 200.0;
        let warmed = own[1].expect("a structure") - 200.0;
        println!(
            "{rate} Hz: plate {:.1e} K of {moved:.4}, structure {:.1e} K of {warmed:.4}",
            found[0] - reference.temperatures()[0],
            of_nodes[1] - own[1].expect("a structure")
        );
        assert!((found[0] - reference.temperatures()[0]).abs() < error);
        assert!((of_nodes[1] - own[1].expect("a structure")).abs() < 5e-5 && warmed > 4e-3);
        // In plain f32 the slower one would not move at all at 1000 Hz.
        let lost = (200.0f32 + (warmed / f64::from(steps)) as f32) - 200.0;
        assert!(rate < 1000.0 || lost == 0.0, "{lost}");
    }
}

/// 2 mm of aluminium, and a blanket over it.
const SKIN: &str = "response = \"radiative\"\nheat_capacity_per_area = 60\nover = { effective_emittance = 0.03, thickness = 0.002, \
                    density = 2700, specific_heat = 900, conductivity = 0 }\n";
const CELLS: &str = "response = \"radiative\"\nthickness = 0.002\ndensity = 2700\nspecific_heat = 900\n";

/// The craft with a blanket and sheets, and a periodic warm-up.
fn craft() -> String {
    let quadratic = "response = \"transition\"\nretarget = \"merge\"\nheating = { function = \"quadratic\", t_max_steps = 4 }\n\
                     cooling = { function = \"quadratic\", t_max_steps = 6 }\n";
    let slow = "response = \"transition\"\nretarget = \"merge\"\nheating = { function = \"quadratic\", t_max_steps = 20 }\n\
                cooling = { function = \"linear\", t_max_steps = 30 }\n";
    scene_with(&[(quadratic, CELLS), (slow, SKIN), ("step = 60\n", "step = 60\nwarm_up = \"periodic\"\n")])
}

/// A run from its periodic state on the device, checked in f64: images, eclipse, structures. The warm-up finds slow structures by their secant.
#[test]
fn a_craft_of_plates_runs_from_its_periodic_state() {
    let folder = Folder::new(&craft());
    let prepared = folder.prepared();
    let context = context();
    let mut engine = DeviceEngine::new(&context, &prepared, prepared.scene.camera.as_ref()).expect("an engine");
    let mut check = Check::new(&prepared, usize::MAX);
    let warm = start(&prepared, &mut engine, Some(&mut check), &never(), &mut || ()).expect("the warm-up");
    let warm = warm.expect("a periodic warm-up");
    println!("warm-up: {}", warm.summary());
    assert!(warm.is_met() && warm.orbits < 12, "{}", warm.summary());
    let below = engine.structures().expect("the structures");
    assert_eq!(below.len(), prepared.structures().len());
    let mut drawn = 0;
    run::<EngineError>(&prepared, &mut engine, Some(&mut check), &never(), &mut |result| {
        drawn += usize::from(result.delivered.image.is_some());
        Ok(())
    })
    .expect("the run");
    assert_eq!(drawn, 4);
    let accuracy = check.accuracy(&prepared);
    println!("{:.1e} K, {:?}", accuracy.max_k, accuracy.step_length);
    assert!(accuracy.max_k < 0.01, "{accuracy:?}");
    assert!(accuracy.step_length.expect("nodes that store heat").max_k > 0.0);

    // Two more orbits hardly move the structures, and forty plain orbits from 250 K are still far away.
    let period = prepared.scene.orbit.period();
    let mut plain = ReferenceEngine::new(&prepared, None);
    plain.settle_at(250.0, prepared.nodes.vertex_of_node.len()).expect("the reference settles");
    let orbit = |engine: &mut ReferenceEngine| {
        let steps = (period / 60.0).ceil() as u32;
        for step in 0..steps {
            let from = f64::from(step) * 60.0 - period;
            let to = (from + 60.0).min(0.0);
            let load = prepared.loads.step_load(from, to);
            let step = EngineStep { load: &load, steps: (to - from) / 60.0, start: from, length: to - from };
            engine.submit(Some(step), Order::default()).expect("the reference steps");
            engine.deliver().expect("the reference answers");
        }
    };
    (0..40).for_each(|_| orbit(&mut plain));
    let far = plain.structures().expect("structures");
    plain.set_structures(&below).expect("structures");
    (0..2).for_each(|_| orbit(&mut plain));
    let near = plain.structures().expect("structures");
    let most = |other: &[f64]| below.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("two more orbits move a structure by {:.1e} K; plain ones are {:.1e} K away", most(&near), most(&far));
    assert!(most(&near) < 1e-3 && most(&far) > 1.0);
}

/// The saved state goes on bit for bit.
#[test]
fn plates_go_on_from_a_saved_state() {
    let context = context();
    let nodes = LooseNodes::new(ALL, materials(15.0), &directions());
    let mut one = nodes.renderer(&context, &[]);
    one.settle(&orbit(0.0)).expect("the device settles");
    let step = |renderer: &mut isotherm::internals::Renderer, number: u32| {
        let submitted =
            renderer.submit(Request::step(&orbit(f64::from(number) / 300.0), 1.0)).expect("the device steps");
        renderer.collect(submitted).expect("the device answers");
    };
    (0..100).for_each(|number| step(&mut one, number));
    let saved = one.save().expect("a state");
    let mut other = nodes.renderer(&context, &[]);
    other.restore(&saved).expect("the state fits");
    for number in 100..200 {
        step(&mut one, number);
        step(&mut other, number);
    }
    assert_eq!(temperatures(&nodes, &mut one), temperatures(&nodes, &mut other));
    let buffers = ["Target", "Span", "Elapsed"];
    let [one, other] = [one, other].map(|mut one| one.save().expect("a state"));
    for buffer in buffers {
        let bits = |saved: &RendererState| -> Vec<u32> {
            saved.buffer(buffer).expect("a buffer").iter().map(|value| value.to_bits()).collect()
        };
        assert_eq!(bits(&one), bits(&other), "{buffer:?}");
    }
}
