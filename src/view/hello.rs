//! The first message to a page: facts about the scene, before the first image.

use std::collections::BTreeMap;

use glam::DVec3;
use serde_json::{Value, json};

use super::camera::extent;
use crate::environment::joints::Joint;
use crate::lens::{Distortion, Lens};
use crate::model::nodes::GROUP;
use crate::output::eclipses::Eclipses;
use crate::output::material_picture;
use crate::scene::{Camera, Motion};
use crate::simulation::facade::Simulation;
use crate::simulation::pose_at;
use crate::simulation::prepare::Prepared;
use crate::thermal::budget::CHANNELS;
use crate::thermal::material::Material;

/// Names and gradients of the colour maps that a page offers.
const MAPS: [(&str, colorous::Gradient); 5] = [
    ("inferno", colorous::INFERNO),
    ("viridis", colorous::VIRIDIS),
    ("cividis", colorous::CIVIDIS),
    ("turbo", colorous::TURBO),
    ("greys", colorous::GREYS),
];

/// The scene in words and numbers, as JSON. `has_camera` tells whether the scene has a camera of its own.
pub(crate) fn hello(simulation: &Simulation, camera: &Camera, has_camera: bool) -> String {
    let prepared = simulation.prepared();
    let scene = &prepared.scene;
    let (middle, radius) = extent(prepared);
    let eclipses = Eclipses::of(prepared);
    let of_material = |(number, material): (usize, &Material)| {
        json!({
            "name": material.name,
            "colour": material_picture::colour(number),
            "emissivity": material.front.emissivity,
        })
    };
    let joint = |joint: &Joint| json!({ "name": joint.name, "unit": if joint.turns() { "deg" } else { "m" } });
    let joints = prepared.loads.joints().joints().iter().map(joint);
    let value = json!({
        "type": "hello",
        "scene": scene.name,
        "version": env!("CARGO_PKG_VERSION"),
        "device": simulation.device_name(),
        "nodes": prepared.nodes.count,
        "triangles": prepared.triangles.len(),
        "band_um": [scene.band.lower * 1e6, scene.band.upper * 1e6],
        "size": [camera.width, camera.height],
        "focal": camera.lens.focal,
        "step": scene.time.step,
        "steps": scene.time.steps,
        "umbra": eclipses.umbra,
        "penumbra": eclipses.penumbra,
        "parts": prepared.parts,
        "objects": objects(prepared),
        "materials": prepared.materials.iter().enumerate().map(of_material).collect::<Vec<_>>(),
        "joints": joints.collect::<Vec<_>>(),
        "middle": middle.to_array(),
        "radius": radius,
        "up": up(prepared, has_camera).to_array(),
        "scene_camera": has_camera,
        "camera_path": has_camera && matches!(camera.motion, Motion::Path(_)),
        "camera_toml": lens_toml(camera),
        "sensor": scene.sensor.is_some(),
        "error": scene.images.error,
        "uncertainty": scene.uncertainty.is_some(),
        "causes": if scene.images.budget { &CHANNELS[..] } else { &[] },
        "colour_range": scene.colour_range,
        "maps": MAPS.map(|(name, gradient)| json!({ "name": name, "colours": colours(name, gradient) })),
    });
    value.to_string()
}

/// The axis of the body that is up in the scene's image at time 0, or the one away from the planet.
fn up(prepared: &Prepared, has_camera: bool) -> DVec3 {
    let of_camera = pose_at(prepared, 0.0).filter(|_| has_camera).map(|pose| -(pose.matrix3.transpose() * DVec3::Y));
    let direction = of_camera.unwrap_or_else(|| -prepared.loads.sky_model().sky(0.0).nadir_direction);
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
    axes.max_by(|a, b| a.dot(direction).total_cmp(&b.dot(direction))).unwrap_or(DVec3::NEG_Z)
}

/// Pairs of part and material that nodes have, with the number of their nodes. Parts and materials are indices, in order.
fn objects(prepared: &Prepared) -> Vec<[usize; 3]> {
    let nodes = &prepared.nodes;
    let mut pairs = BTreeMap::new();
    for (slot, _) in nodes.real() {
        let pair = [nodes.group_part[slot / GROUP], nodes.group_material[slot / GROUP]];
        *pairs.entry(pair).or_insert(0) += 1;
    }
    pairs.into_iter().map(|([part, material], count)| [part as usize, material as usize, count]).collect()
}

/// Size and lens of a camera as lines of `[camera]` in a scene file.
fn lens_toml(camera: &Camera) -> String {
    let Lens { focal: [fx, fy], centre: [cx, cy], skew, distortion } = camera.lens;
    let mut lines = format!("width = {}\nheight = {}\nfx = {fx:?}\nfy = {fy:?}\n", camera.width, camera.height);
    lines += &format!("cx = {cx:?}\ncy = {cy:?}\n");
    if skew != 0.0 {
        lines += &format!("skew = {skew:?}\n");
    }
    match distortion {
        Distortion::None => {}
        Distortion::BrownConrady(numbers) => lines += &format!("distortion = {numbers:?}\n"),
        Distortion::Fisheye(numbers) => {
            lines += &format!("distortion = {numbers:?}\ndistortion_model = \"fisheye\"\n");
        }
    }
    if camera.samples > 1 {
        lines += &format!("samples = {}\n", camera.samples);
    }
    lines
}

/// 256 colours of a map, dark first.
fn colours(name: &str, gradient: colorous::Gradient) -> Vec<Value> {
    let dark_last = name == "greys";
    let share = |i: u32| f64::from(if dark_last { 255 - i } else { i }) / 255.0;
    (0..256).map(|i| gradient.eval_continuous(share(i))).map(|colour| json!([colour.r, colour.g, colour.b])).collect()
}
