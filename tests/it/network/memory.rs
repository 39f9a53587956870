//! Device memory of networks: the plan equals the allocation and stays below the limit of docs/numerics.md.

use std::path::Path;

use isotherm::internals::{
    Density, DeviceData, DeviceEngine, Edges, Engine, Integrator, Planned, Prepared, device_bytes,
};
use isotherm::{Scene, internals};

use crate::craft::{Folder, scene_with};
use crate::device::context;
use crate::mesh_network::{SKIN, TRANSITION};

/// Allowed bytes a node of a mesh network, including triangles (docs/numerics.md 6).
const ALLOWED: f64 = 160.0;

/// Planned device memory of the scene with its network [bytes].
fn planned(prepared: &Prepared) -> u64 {
    let camera = prepared.scene.camera.as_ref();
    let data = DeviceData::new(prepared);
    device_bytes(&data.scene_data(prepared, camera).plan())
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
    scene.density = Density { model: Edges { max: Some(1.5), min: scene.density.model.min }, ..Density::default() };
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
    let is_weights = |planned: &&Planned| planned.resource == &internals::WEIGHTS;
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
    let bytes = planned(&prepared) as f64 / nodes;
    println!("{nodes} nodes: {bytes:.2} bytes a node");
    assert!(bytes < ALLOWED, "{bytes}");
}

#[test]
fn what_is_planned_for_a_scene_is_what_is_allocated() {
    let prepared = skin();
    let context = context();
    let mut engine = DeviceEngine::new(&context, &prepared, prepared.scene.camera.as_ref()).expect("a small scene");
    let load = prepared.loads.step_load(0.0, prepared.scene.time.step);
    engine.settle(&load, 0.0).expect("a steady state");
    assert_eq!(engine.device_bytes(), Some(planned(&prepared)));
}
