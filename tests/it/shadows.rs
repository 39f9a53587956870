//! The craft's shadow on itself: device against f64 twin, depth map against rays, and when shadows are computed again.

use std::sync::Arc;

use glam::DVec3;
use isotherm::internals::{
    Context, DeviceData, PADDING, Prepared, Renderer, Request, ShadowCasters, ShadowMethod, StepLoad,
};
use serde_json::json;

use super::craft::{Folder, glb, scene_with};
use super::device::{assert_silent, context, dark, sunlight};

/// The craft with half-metre edges. Its box shades a wing, and a wing the box.
fn prepared(shadows: &str) -> Prepared {
    let scene = scene_with(&[("[radiance]", &format!("[shadows]\n{shadows}\n[radiance]"))]);
    Folder::new(&scene).prepared()
}

/// A Sun low over a wing, so that the box stands in the light.
fn sun() -> DVec3 {
    DVec3::new(0.25, 0.8, -0.45).normalize()
}

fn load(sun: DVec3) -> StepLoad {
    StepLoad { sun: sunlight([(sun, 1361.0)]), ..dark(2.7) }
}

/// Visible share of the Sun on the device, for nodes that face it.
fn on_device(context: &Arc<Context>, prepared: &Prepared, sun: DVec3) -> Vec<f64> {
    let data = DeviceData::new(prepared);
    let mut renderer = Renderer::new(context, &data.scene_data(prepared, None)).expect("a small scene");
    renderer.settle(&load(sun)).expect("the device settles");
    renderer.visibility().expect("the device answers").into_iter().map(f64::from).collect()
}

/// The same in f64.
fn in_f64(prepared: &Prepared, sun: DVec3) -> Vec<f64> {
    let slots = 0..prepared.nodes.vertex_of_node.len();
    let mut shadows: ShadowCasters = prepared.shadows(slots).expect("shadows are on");
    shadows.visibility(&load(sun)).expect("the first time")
}

/// Nodes that can see the Sun: nodes of sheets, and nodes of a skin that face it.
fn lit(prepared: &Prepared, sun: DVec3) -> Vec<usize> {
    let nodes = &prepared.nodes;
    let faces = |slot: usize| {
        let both = prepared.materials[nodes.group_material[slot / 4] as usize].name == "cells";
        let cosine = nodes.normals[slot].as_dvec3().dot(sun);
        if both { cosine.abs() > 0.05 } else { cosine > 0.05 }
    };
    (0..nodes.vertex_of_node.len()).filter(|slot| nodes.vertex_of_node[*slot] != PADDING && faces(*slot)).collect()
}

/// Share of the nodes whose answers differ by more than a ninth (one column of texels), and mean difference.
fn apart(slots: &[usize], a: &[f64], b: &[f64]) -> (f64, f64) {
    let differences = slots.iter().map(|slot| (a[*slot] - b[*slot]).abs());
    let wrong = differences.clone().filter(|difference| *difference > 0.12).count();
    (wrong as f64 / slots.len() as f64, differences.sum::<f64>() / slots.len() as f64)
}

#[test]
fn the_device_sees_the_shadows_of_its_twin() {
    let context = context();
    // A rasteriser rounds corners to 1/16 of a texel or finer, so a tenth of the texels along an edge may differ. An
    // f32 ray may miss an edge that an f64 ray hits.
    for (shadows, most_wrong, most_mean) in
        [("method = \"depth\"\nresolution = 512", 0.01, 2e-3), ("method = \"exact\"", 0.005, 1e-3)]
    {
        let prepared = prepared(shadows);
        let slots = lit(&prepared, sun());
        let device = on_device(&context, &prepared, sun());
        let (wrong, mean) = apart(&slots, &device, &in_f64(&prepared, sun()));
        println!("{shadows}: {} lit nodes, {wrong:.4} apart, mean {mean:.1e}", slots.len());
        assert!(wrong <= most_wrong && mean <= most_mean, "{shadows}: {wrong} apart, mean {mean}");
        let shaded = slots.iter().filter(|slot| device[**slot] < 0.5).count();
        assert!(shaded > slots.len() / 20, "{shadows}: {shaded} of {} nodes are in shadow", slots.len());
        // A Sun one degree away must give another result.
        let moved = (sun() + 0.017 * sun().any_orthonormal_vector()).normalize();
        let (wrong, mean) = apart(&slots, &device, &in_f64(&prepared, moved));
        assert!(wrong > most_wrong || mean > most_mean, "{shadows}: {wrong} apart, mean {mean} when the Sun has moved");
    }
    assert_silent(&context);
}

#[test]
fn the_fast_way_is_near_the_exact_one() {
    let context = context();
    let fast = prepared("method = \"depth\"\nresolution = 1024");
    let exact = prepared("method = \"exact\"");
    let slots = lit(&fast, sun());
    let (wrong, mean) = apart(&slots, &on_device(&context, &fast, sun()), &on_device(&context, &exact, sun()));
    println!("{} lit nodes, {wrong:.4} apart, mean {mean:.1e}", slots.len());
    assert!(wrong < 0.03 && mean < 0.01, "{wrong} apart, mean {mean}");
    assert_eq!(fast.scene.shadows.map(|settings| settings.method), Some(ShadowMethod::Depth));
}

#[test]
fn shadows_are_found_anew_when_the_sun_has_moved_enough() {
    let context = context();
    let prepared = prepared("resolution = 128\nredraw_angle_deg = 1.0");
    let data = DeviceData::new(&prepared);
    let mut renderer = Renderer::new(&context, &data.scene_data(&prepared, None)).expect("a small scene");
    renderer.settle(&load(sun())).expect("the device settles");
    let drawn = |renderer: &Renderer| {
        renderer
            .pass_times()
            .iter()
            .filter(|(name, _)| *name == "solar_depth")
            .map(|(_, times)| times.len())
            .sum::<usize>()
    };
    let first = renderer.visibility().expect("the device answers");
    assert_eq!(drawn(&renderer), 1);
    // At 0.6 degrees a step, the second step is the first beyond one degree.
    let turn = glam::DQuat::from_axis_angle(DVec3::Z, 0.6f64.to_radians());
    let mut sun = sun();
    for expected in [1, 2, 2, 3] {
        sun = turn * sun;
        let submitted = renderer.submit(Request::step(&load(sun), 1.0)).expect("the device steps");
        renderer.collect(submitted).expect("the device answers");
        assert_eq!(drawn(&renderer), expected);
    }
    assert_ne!(renderer.visibility().expect("the device answers"), first);
    assert_silent(&context);
}

#[test]
fn what_is_shaded_stays_cold() {
    let context = context();
    let shaded = prepared("method = \"depth\"");
    let open = Folder::new(super::craft::SCENE).prepared();
    let temperatures = |prepared: &Prepared| {
        let data = DeviceData::new(prepared);
        let mut renderer = Renderer::new(&context, &data.scene_data(prepared, None)).expect("a small scene");
        renderer.settle(&load(sun())).expect("the device settles");
        let submitted = renderer.submit(Request::default().and_temperatures()).expect("the device reads");
        renderer.collect(submitted).expect("the device answers").temperatures.expect("all nodes").to_vec()
    };
    let visibility = on_device(&context, &shaded, sun());
    let (with, without) = (temperatures(&shaded), temperatures(&open));
    let mut seen = [0; 2];
    for slot in lit(&shaded, sun()) {
        // In umbra only the background of 2.7 K is left. Nodes in full sunlight do not change.
        if visibility[slot] == 0.0 {
            assert!((with[slot] - 2.7).abs() < 1e-3, "node {slot}: {} K", with[slot]);
            assert!(without[slot] > 100.0);
            seen[0] += 1;
        } else if visibility[slot] == 1.0 {
            assert!((with[slot] - without[slot]).abs() < 1e-3);
            seen[1] += 1;
        }
    }
    assert!(seen[0] > 10 && seen[1] > 10, "{seen:?}");
}

/// The craft with a wing on a joint. Far from it are two small plates under a stack of equal triangles, and a screen
/// above the first plate. A ray from a plate meets the boxes of the triangles but misses the triangles.
fn under_a_stack(triangles: usize) -> Folder {
    let joint = "[[joint]]\npart = \"wing_port\"\nmode = \"fixed\"\naxis = \"+X\"\nangle_deg = 30\n";
    let sections = format!("[shadows]\nmethod = \"exact\"\n{joint}[radiance]");
    let folder = Folder::new(&scene_with(&[("[radiance]", &sections)]));
    let mut maker = glb();
    let corners = |[x, y]: [f32; 2], side: f32, z: f32| [[x, y, z], [x + side, y, z], [x, y + side, z]];
    let plates = [corners(COVERED, 0.01, 4.0), corners(OPEN, 0.01, 4.0)].concat();
    let places = [&corners([10.0; 2], 0.4, 5.0), &plates[..], &corners([10.2; 2], 0.6, 6.0)].concat();
    let indices = [[3u32, 4, 5, 6, 7, 8].to_vec(), [0, 1, 2].repeat(triangles), vec![9, 10, 11]].concat();
    let positions = maker.floats(&places);
    let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()).collect();
    let indices = maker.accessor(&bytes, json!({"componentType": 5125, "count": indices.len(), "type": "SCALAR"}));
    let mesh =
        maker.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices, "material": 1, "mode": 4}));
    let node = maker.push("nodes", json!({"name": "stack", "mesh": mesh}));
    maker.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(node));
    maker.save(folder.0.path());
    folder
}

/// Corners of the plates [m], beyond the long side of the stack's triangles.
const COVERED: [f32; 2] = [10.35, 10.35];
const OPEN: [f32; 2] = [10.38, 10.15];

/// The last triangle of the largest tree is found after every box before it. lavapipe ends loops after 65,535 turns.
#[test]
fn rays_walk_the_largest_tree_to_its_end() {
    let context = context();
    let prepared = under_a_stack(129_900).prepared();
    assert!(prepared.occluders.tree.as_ref().is_some_and(|tree| tree.tree.nodes.len() > 64_900));
    let [covered, open] = [COVERED, OPEN].map(|[x, y]| {
        let corner = DVec3::new(f64::from(x), f64::from(y), 4.0);
        let near = |slot: &usize| prepared.nodes.positions[*slot].as_dvec3().distance(corner) < 1e-3;
        (0..prepared.nodes.positions.len()).find(near).expect("a plate's corner")
    });
    let load = StepLoad { joints: prepared.loads.joints_at(0.0).1, ..load(DVec3::Z) };
    let data = DeviceData::new(&prepared);
    let mut renderer = Renderer::new(&context, &data.scene_data(&prepared, None)).expect("a small scene");
    renderer.settle(&load).expect("the device settles");
    let visibility = renderer.visibility().expect("the device answers");
    assert_eq!([visibility[covered], visibility[open]], [0.0, 1.0]);
    let mut in_f64 = prepared.shadows([covered, open].into_iter()).expect("shadows are on");
    assert_eq!(in_f64.visibility(&load).expect("the first time"), [0.0, 1.0]);
    assert_silent(&context);

    let folder = under_a_stack(130_100);
    let error = Prepared::new(&folder.path("scene.toml"), &mut |_| ()).err().expect("a refusal").to_string();
    for part in ["scene.toml: shadows.method: 130", "rays take at most 65000", "use method = \"depth\""] {
        assert!(error.contains(part), "{error}");
    }
}
