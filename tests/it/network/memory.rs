//! Device memory of networks: the plan equals the allocation, stays below the limit of docs/numerics.md, and memory
//! that the scene lends to the solver is restored before an image.

use std::path::Path;

use isotherm::internals::{
    Density, DeviceData, DeviceEngine, Edges, Engine, EngineOrder as Order, Integrator, LinearConductor, Network,
    NetworkBytes, NetworkStepper, NodeKind, Planned, Prepared, RadiativeConductor, Resource, Scene, StepMethod,
    Stepper, camera_from_body, device_bytes,
};

use crate::craft::{Folder, scene_with};
use crate::device::{assert_silent, context, validated_context};
use crate::mesh_network::{SKIN, TRANSITION};

/// Allowed bytes a node of a mesh network, including triangles (docs/numerics.md 6).
const ALLOWED: f64 = 160.0;

/// Planned device memory of the scene, and of its network.
fn planned(prepared: &Prepared) -> [u64; 2] {
    let camera = prepared.scene.camera.as_ref();
    let data = DeviceData::new(prepared);
    let plan = data.scene_data(prepared, camera).plan();
    [device_bytes(&plan), prepared.network_bytes(&plan).device]
}

/// The craft with a skin of about 1,700 nodes.
fn skin() -> Prepared {
    let scene = scene_with(&[(TRANSITION, SKIN), ("max_edge = 0.7", "max_edge = 0.15")]);
    Folder::new(&scene).prepared()
}

/// The station at an edge of 1.5 m, with an integrator.
fn station(integrator: Integrator) -> Prepared {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/station.toml");
    let mut scene = Scene::load(&path).expect("a scene of this repository");
    scene.density = Density { model: Edges { max: Some(1.5), min: scene.density.model.min }, parts: Vec::new() };
    (scene.network.integrator, scene.shadows, scene.energy_balance) = (integrator, None, false);
    scene.joints.clear();
    Prepared::from_scene(scene, &mut |_| ()).expect("a scene that can run")
}

/// The network in one pass has 100 bytes a drawn node, and 8 for each weight of its blocks. 80 were the goal.
#[test]
fn a_network_in_one_pass_takes_100_bytes_a_node_and_8_a_weight() {
    let prepared = station(Integrator::Default);
    let data = DeviceData::new(&prepared);
    let plan = data.scene_data(&prepared, None).plan();
    let is_weights = |planned: &&Planned| planned.resource == Resource::OnePassWeights;
    let of = |wanted: &dyn Fn(&&Planned) -> bool| plan.iter().filter(wanted).map(|planned| planned.bytes).sum::<u64>();
    let weights = of(&is_weights);
    let rest = of(&|planned| format!("{:?}", planned.resource).starts_with("OnePass") && !is_weights(planned));
    let rest = rest as f64 / prepared.nodes.count as f64;
    println!("{} nodes: {rest:.2} bytes a node, and weights of {weights} bytes", prepared.nodes.count);
    assert!(weights > 0 && rest < 100.0, "{rest} bytes a node");
}

/// Meshes with more triangles a node need more memory. At two a node the scene itself has 77 bytes.
#[test]
fn a_network_of_a_mesh_takes_less_than_160_bytes_a_node() {
    let prepared = station(Integrator::Accurate);
    let nodes = prepared.nodes.count as f64;
    let [of_scene, of_network] = planned(&prepared).map(|bytes| bytes as f64 / nodes);
    println!("{nodes} nodes: {of_scene:.2} and {of_network:.2} bytes a node");
    assert!(of_scene + of_network < ALLOWED, "{of_scene} and {of_network}");
}

/// A ring in which every tenth node also radiates across.
fn ring(nodes: u32) -> Network {
    let count = nodes as usize;
    Network {
        space_temperature: 2.7,
        kinds: vec![NodeKind::Diffusive; count],
        capacitances: vec![5.0; count],
        emissive_areas: vec![1e-3; count],
        temperatures: (0..nodes).map(|node| 280.0 + f64::from(node % 7)).collect(),
        linear: (0..nodes)
            .map(|node| LinearConductor { nodes: [node, (node + 1) % nodes], conductance: 0.1 })
            .collect(),
        radiative: (0..nodes / 2)
            .step_by(10)
            .map(|node| RadiativeConductor { nodes: [node, node + nodes / 2], exchange_area: 1e-4 })
            .collect(),
    }
}

#[test]
fn what_is_planned_for_a_network_is_what_is_allocated() {
    let context = context();
    for nodes in [2000, 2400] {
        let network = ring(nodes);
        let planned = NetworkBytes::of(&network, 0, &[]);
        let mut stepper = NetworkStepper::new(&context, &network, &[]).expect("a network for the device");
        let before = stepper.device_bytes();
        stepper.set_heat(&vec![0.1; network.len()], &vec![0.0; network.len()]).expect("heat");
        stepper.attempt(StepMethod::TrBdf2, 0.0, 1.0, 1).expect("an attempt");
        assert_eq!(stepper.device_bytes(), planned.device, "with the vectors of the solver");
        // The solver needs six vectors of four bytes a node.
        assert_eq!(planned.device - before, 6 * 4 * u64::from(nodes));
        assert!(!stepper.wrote_spare(), "there is none");
    }
}

#[test]
fn what_is_planned_for_a_scene_is_what_is_allocated() {
    let prepared = skin();
    let context = context();
    let mut engine = DeviceEngine::new(&context, &prepared, prepared.scene.camera.as_ref()).expect("a small scene");
    let load = prepared.loads.step_load(0.0, prepared.scene.time.step);
    engine.settle(&load, 0.0).expect("a steady state");
    assert_eq!(engine.device_bytes(), Some(planned(&prepared).iter().sum()));
}

/// The solver uses the memory of the culled triangles. The next image must restore them.
#[test]
fn an_image_after_a_solver_is_the_image_before_it() {
    let prepared = skin();
    let Some(context) = validated_context() else { return };
    let camera = prepared.scene.camera.as_ref();
    let mut engine = DeviceEngine::new(&context, &prepared, camera).expect("a small scene");
    let load = prepared.loads.step_load(0.0, prepared.scene.time.step);
    let pose = camera.map(|camera| camera_from_body(camera, &prepared.loads.sky_model().sky(0.0)));
    let mut images = Vec::new();
    for _ in 0..2 {
        engine.settle(&load, 0.0).expect("a steady state");
        engine.submit(None, Order { pose, ..Order::default() }).expect("submitted");
        images.push(engine.deliver().expect("delivered").pixels.expect("an image"));
    }
    assert_silent(&context);
    let drawn = images[0].identity.iter().filter(|pixel| pixel[0] > 0).count();
    assert!(drawn > 1000, "{drawn} pixels");
    assert_eq!(images[0].identity, images[1].identity);
    for (before, after) in images[0].radiance_temperature_depth.iter().zip(&images[1].radiance_temperature_depth) {
        assert!((before[1] - after[1]).abs() < 2e-3, "{before:?}, {after:?}");
    }
}
