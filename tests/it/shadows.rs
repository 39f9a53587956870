//! The craft's shadow on itself: lit areas on the device against f64, and when they are found anew.

use std::sync::Arc;

use glam::DVec3;
use isotherm::internals::{Context, DeviceData, LitArea, PADDING, Prepared, Renderer, Request, StepLoad};

use super::budget::{LIT, scene, squares};
use super::craft::{Folder, scene_with};
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

/// Lit areas on the device.
fn on_device(context: &Arc<Context>, prepared: &Prepared, sun: DVec3) -> Vec<LitArea> {
    let data = DeviceData::new(prepared);
    let mut renderer = Renderer::new(context, &data.scene_data(prepared, None)).expect("a small scene");
    renderer.settle(&load(sun)).expect("the device settles");
    renderer.lit_areas().expect("the device answers")
}

/// Nodes that can see the Sun: nodes of sheets, and nodes of a skin that face it.
fn facing(prepared: &Prepared, sun: DVec3) -> Vec<usize> {
    let nodes = &prepared.nodes;
    let faces = |slot: usize| {
        let both = prepared.materials[nodes.group_material[slot / 4] as usize].name == "cells";
        let cosine = nodes.normals[slot].as_dvec3().dot(sun);
        if both { cosine.abs() > 0.05 } else { cosine > 0.05 }
    };
    (0..nodes.vertex_of_node.len()).filter(|slot| nodes.vertex_of_node[*slot] != PADDING && faces(*slot)).collect()
}

#[test]
fn the_device_has_the_light_of_its_twin() {
    let context = context();
    let prepared = prepared("");
    let slots = facing(&prepared, sun());
    let device = on_device(&context, &prepared, sun());
    let light = prepared.lit_areas(slots.iter().copied()).expect("shadows are on");
    let largest = |sun: DVec3| {
        let in_f64 = light.under(sun, &[]);
        let apart = slots.iter().zip(&in_f64).map(|(slot, lit)| device[*slot].vector.distance(lit.vector));
        apart.fold(0.0, f64::max)
    };
    assert!(largest(sun()) < 1e-6, "{}", largest(sun()));
    let shaded = slots.iter().filter(|slot| device[**slot].vector.length() < 0.5).count();
    assert!(shaded > slots.len() / 20, "{shaded} of {} nodes are in shadow", slots.len());
    // A Sun one degree away must give another result.
    let moved = (sun() + 0.017 * sun().any_orthonormal_vector()).normalize();
    assert!(largest(moved) > 0.01, "{}", largest(moved));
    assert_silent(&context);
}

#[test]
fn light_is_found_anew_when_the_sun_has_moved_enough() {
    let context = context();
    let prepared = prepared("redraw_angle_deg = 1.0");
    let data = DeviceData::new(&prepared);
    let mut renderer = Renderer::new(&context, &data.scene_data(&prepared, None)).expect("a small scene");
    renderer.settle(&load(sun())).expect("the device settles");
    let mut last = renderer.lit_areas().expect("the device answers");
    // At 0.6 degrees a step, the second step is the first beyond one degree.
    let turn = glam::DQuat::from_axis_angle(DVec3::Z, 0.6f64.to_radians());
    let mut sun = sun();
    for anew in [false, true, false, true] {
        sun = turn * sun;
        let submitted = renderer.submit(Request::step(&load(sun), 1.0)).expect("the device steps");
        renderer.collect(submitted).expect("the device answers");
        let now = renderer.lit_areas().expect("the device answers");
        assert_eq!(now != last, anew);
        last = now;
    }
    assert_silent(&context);
}

#[test]
fn what_is_shaded_stays_cold() {
    let context = context();
    let shaded = prepared("");
    let open = Folder::new(super::craft::SCENE).prepared();
    let temperatures = |prepared: &Prepared| {
        let data = DeviceData::new(prepared);
        let mut renderer = Renderer::new(&context, &data.scene_data(prepared, None)).expect("a small scene");
        renderer.settle(&load(sun())).expect("the device settles");
        let submitted = renderer.submit(Request::default().and_temperatures()).expect("the device reads");
        renderer.collect(submitted).expect("the device answers").temperatures.expect("all nodes").to_vec()
    };
    let lit = [&shaded, &open].map(|prepared| on_device(&context, prepared, sun()));
    let (with, without) = (temperatures(&shaded), temperatures(&open));
    let mut seen = [0; 2];
    for slot in facing(&shaded, sun()) {
        let cosine = lit[0][slot].vector.dot(sun());
        // In umbra only the background of 2.7 K is left. Nodes in full sunlight do not change.
        if cosine == 0.0 {
            assert!((with[slot] - 2.7).abs() < 1e-3, "node {slot}: {} K", with[slot]);
            assert!(without[slot] > 100.0);
            seen[0] += 1;
        } else if lit[1].get(slot).is_none_or(|open| open.vector.dot(sun()) - cosine < 1e-6) {
            assert!((with[slot] - without[slot]).abs() < 1e-3 || lit[1].is_empty());
            seen[1] += 1;
        }
    }
    assert!(seen[0] > 10 && seen[1] > 10, "{seen:?}");
}

/// Longest edge of a scene that states `max_edge` so, or not at all, and what it assumes of it.
fn chosen(stated: &str, section: &str) -> (Option<f64>, Vec<String>) {
    let own = "emissivity = 0.8\nheat_capacity_per_area = 100\nresponse = \"radiative\"\n";
    let text = scene(&[("plate", own)], LIT, section).replace("max_edge = 0.5\n", stated);
    let scene = squares(&text, &[("plate", [0.0; 3], true)]).prepared().scene;
    let told = scene.assumptions.iter().filter(|assumption| assumption.contains("model.max_edge is absent"));
    (scene.density.model.max, told.cloned().collect())
}

#[test]
fn edges_are_chosen_where_surfaces_shade_or_warm_each_other() {
    // The square has 4 m2.
    for section in ["[shadows]\n", "[exchange]\n"] {
        let (edge, told) = chosen("", section);
        assert_eq!(edge, Some(0.05), "{section}");
        assert!(told.len() == 1 && told[0].starts_with("Edges longer than 0.05 m are split"), "{told:?}");
        assert_eq!(chosen("max_edge = \"file\"\n", section), (Some(f64::INFINITY), Vec::new()));
        assert_eq!(chosen("max_edge = 0.3\n", section), (Some(0.3), Vec::new()));
        assert_eq!(chosen("min_edge = 0.2\n", section).0, Some(0.2));
        // A part that states an edge leaves none to choose, and one that merges longer edges has its own.
        let part = |edges: &str| chosen("", &format!("{section}[[part]]\nmatch = \"plate\"\n{edges}\n"));
        assert_eq!(part("max_edge = \"file\""), (None, Vec::new()));
        assert_eq!(part("max_edge = 0.4"), (None, Vec::new()));
        assert_eq!(part("min_edge = 0.2").0, Some(0.05));
    }
    let (edge, told) = chosen("", "");
    assert!(edge.is_none() && told.len() == 1 && told[0].contains("are not subdivided"), "{told:?}");
}

/// A square has four edges of one triangle, and a second square in the same place coincides with both of its triangles.
#[test]
fn surfaces_that_mislead_shadows_are_told() {
    const BOTH: &str = "\"both\"\nback = { absorptivity = 0.5, emissivity = 0.5 }";
    let told = |sides: &str, places: &[[f32; 3]], section: &str| -> Vec<String> {
        let own =
            format!("emissivity = 0.8\nheat_capacity_per_area = 100\nsides = {sides}\nresponse = \"radiative\"\n");
        let text = scene(&[("plate", &own)], LIT, section).replace("max_edge = 0.5\n", "max_edge = \"file\"\n");
        let all: Vec<(&str, [f32; 3], bool)> = places.iter().map(|place| ("plate", *place, true)).collect();
        let warnings = squares(&text, &all).prepared().warnings;
        warnings.into_iter().filter(|warning| warning.starts_with("[shadows]")).collect()
    };
    let one = [[0.0; 3]];
    let open = told("\"outside\"", &one, "[shadows]\n");
    assert!(open.len() == 1 && open[0].starts_with("[shadows]: 4 open edges "), "{open:?}");
    let twice = told(BOTH, &[[0.0; 3]; 2], "[shadows]\n");
    assert!(twice.len() == 1 && twice[0].starts_with("[shadows]: 2 triangles exactly on another"), "{twice:?}");
    assert_eq!(told("\"outside\"", &one, ""), [""; 0], "a scene without shadows");
    assert_eq!(told(BOTH, &one, "[shadows]\n"), [""; 0], "a sheet may be open");
}
