//! Shadows by depth on thin layers: no part's share of the Sun jumps as the Sun turns, and it is near that of rays.

use std::path::Path;

use glam::{DAffine3, DVec3};
use isotherm::internals::{
    DepthMap, DeviceData, Occluders, PADDING, Prepared, Renderer, ShadowMethod, ShadowSettings, Sides, StepLoad,
    SunProjection,
};
use isotherm::{Reach, Scene};
use serde_json::json;

use super::craft::{Folder, glb, scene_with};
use super::device::{assert_silent, context, dark, sunlight};

/// Side of a blanket [m].
const SIDE: f32 = 10.0;
/// Where a blanket's corner stands [m]: beside the craft, so that neither shades the other while the Sun turns about X.
const PLACE: f32 = 30.0;

/// Two plates above each other beside the craft, and a speck far away that gives the whole its size [m].
fn blanket(gap: f32, size: f32) -> Prepared {
    let sections = "[shadows]\nmethod = \"depth\"\nredraw_angle_deg = 0\n[radiance]";
    let folder = Folder::new(&scene_with(&[("[radiance]", sections), ("max_edge = 0.7", "max_edge = 1.3")]));
    let mut maker = glb();
    let far = PLACE - size / 2.0f32.sqrt();
    let plate = |z: f32| [[0.0, 0.0], [SIDE, 0.0], [SIDE, SIDE], [0.0, SIDE]].map(|[x, y]| [PLACE + x, PLACE + y, z]);
    let speck = [[far, far, 0.0], [far + 0.1, far, 0.0], [far, far + 0.1, 0.0]];
    let positions = maker.floats(&[&plate(0.0)[..], &plate(gap)[..], &speck[..]].concat());
    let indices = [0u8, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7, 8, 9, 10];
    let indices = maker.accessor(&indices, json!({"componentType": 5121, "count": 15, "type": "SCALAR"}));
    let mesh =
        maker.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices, "material": 1, "mode": 4}));
    let node = maker.push("nodes", json!({"name": "blanket", "mesh": mesh}));
    maker.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(node));
    maker.save(folder.0.path());
    folder.prepared()
}

fn load(sun: DVec3) -> StepLoad {
    StepLoad { sun: sunlight([(sun, 1361.0)]), ..dark(2.7) }
}

/// A node of the blanket: its number, position, normal and area, and whether it is farther than half a metre from the border, beyond the filter of the map.
struct Node {
    slot: usize,
    place: DVec3,
    normal: DVec3,
    area: f64,
    inner: bool,
}

fn nodes_of(prepared: &Prepared) -> Vec<Node> {
    let nodes = &prepared.nodes;
    let part = prepared.parts.iter().position(|part| part == "blanket").expect("the blanket") as u32;
    let own = |slot: &usize| nodes.vertex_of_node[*slot] != PADDING && nodes.group_part[slot / 4] == part;
    let node = |slot: usize| {
        let place = nodes.positions[slot].as_dvec3();
        let from = [place.x, place.y].map(|at| (at - f64::from(PLACE + 0.5 * SIDE)).abs());
        let inner = from[0].max(from[1]) < 0.5 * f64::from(SIDE) - 0.5;
        Node { slot, place, normal: nodes.normals[slot].as_dvec3(), area: nodes.areas[slot], inner }
    };
    (0..nodes.vertex_of_node.len()).filter(own).map(node).filter(|node| node.place.x > 20.0).collect()
}

/// Mean share of the full Sun on a blanket's nodes.
fn mean(nodes: &[&Node], sun: DVec3, seen: impl Fn(&Node) -> f64) -> f64 {
    let lit: f64 = nodes.iter().map(|node| node.area * node.normal.dot(sun).abs() * seen(node)).sum();
    lit / nodes.iter().map(|node| node.area).sum::<f64>()
}

fn direction(degrees: f64) -> DVec3 {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    DVec3::new(0.02, sine, cosine).normalize()
}

/// Gap between the plates and size of the craft [m].
const BLANKETS: [(f32, f32); 6] =
    [(0.01, 60.0), (0.04, 60.0), (0.01, 120.0), (0.04, 120.0), (0.04, 300.0), (0.1, 300.0)];
/// Largest change of a blanket's mean share of the full Sun while the Sun turns by 0.1 deg. A plate in free sunlight changes by 0.0017. The first row of nodes
/// inside the border comes out of the shadow in grazing light: a ninth of one of two plates, at a cosine below 0.1.
const MOST_CHANGE: f64 = 0.01;
/// Largest difference to rays, inside the border.
const MOST_APART: f64 = 0.01;

/// Largest change of the mean share between neighbouring angles, and largest difference to rays inside the border. `lift` is that of a node off its surface.
fn sweep(prepared: &Prepared, mut lift: impl FnMut(&SunProjection) -> f64) -> [f64; 2] {
    let nodes = nodes_of(prepared);
    let all: Vec<&Node> = nodes.iter().collect();
    let inner: Vec<&Node> = nodes.iter().filter(|node| node.inner).collect();
    assert!(inner.len() > 60 && all.len() > inner.len(), "{} of {} nodes", inner.len(), all.len());
    let rays: Occluders = prepared.casters().occluders(&[]);
    let (mut last, mut change, mut apart) = (None, 0.0f64, 0.0f64);
    for tenth in -880..=880 {
        let sun = direction(0.1 * f64::from(tenth));
        let view = prepared.redraw().and_then(|mut redraw| redraw.view(&load(sun))).expect("the Sun shines");
        let map = DepthMap::traced(SunProjection { lift: lift(&view), ..view }, &rays);
        let seen = |node: &Node| map.solar_visibility(node.place, node.normal);
        let now = mean(&all, sun, seen);
        change = last.map_or(0.0, |last: f64| (now - last).abs()).max(change);
        last = Some(now);
        if tenth % 10 == 0 {
            let exact = mean(&inner, sun, |node| rays.solar_visibility(node.place, node.normal, sun));
            apart = apart.max((mean(&inner, sun, seen) - exact).abs());
        }
    }
    [change, apart]
}

#[test]
#[ignore = "long: tools/test --all"]
fn a_blanket_neither_lights_nor_shades_itself_in_jumps() {
    for (gap, size) in BLANKETS {
        let prepared = blanket(gap, size);
        let (mut smallest, mut largest) = (f64::INFINITY, 0.0f64);
        let [change, apart] = sweep(&prepared, |view| {
            (smallest, largest) = (smallest.min(view.texel), largest.max(view.texel));
            view.lift
        });
        println!("gap {gap} m on {size} m: change {change:.4}, apart from rays {apart:.4}");
        assert!(change < MOST_CHANGE && apart < MOST_APART, "gap {gap} m on {size} m: {change} and {apart}");
        // A lift in proportion to the texel of each view passes the gap as the Sun turns, and half of the blanket lights up.
        let share = f64::from(gap) / (0.5 * (smallest + largest));
        let [change, apart] = sweep(&prepared, |view| share * view.texel);
        assert!(change > 0.1 && apart > 0.1, "a lift of {share} texels must jump: {change}, {apart}");
    }
}

#[test]
fn a_blanket_on_the_device_neither_lights_nor_shades_itself() {
    let context = context();
    for (gap, size) in [(0.01, 60.0), (0.04, 120.0), (0.1, 300.0)] {
        let prepared = blanket(gap, size);
        let data = DeviceData::new(&prepared);
        let mut renderer = Renderer::new(&context, &data.scene_data(&prepared, None)).expect("a small scene");
        let nodes = nodes_of(&prepared);
        let inner: Vec<&Node> = nodes.iter().filter(|node| node.inner).collect();
        let rays = prepared.casters().occluders(&[]);
        for degrees in (-88..=88).step_by(4) {
            let sun = direction(f64::from(degrees));
            renderer.settle(&load(sun)).expect("the device settles");
            let visibility = renderer.visibility().expect("the device answers");
            let found = mean(&inner, sun, |node| f64::from(visibility[node.slot]));
            let exact = mean(&inner, sun, |node| rays.solar_visibility(node.place, node.normal, sun));
            assert!((found - exact).abs() < MOST_APART, "gap {gap} m on {size} m, {degrees} deg: {found} for {exact}");
        }
    }
    assert_silent(&context);
}

/// The ISS of `models/iss.toml` at a coarse density. `None` with a printed line where its model is missing.
fn iss(method: ShadowMethod) -> Option<Prepared> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/iss.toml");
    let mut scene = Scene::load_within(&path, Reach::Anywhere).expect("a scene");
    if !scene.model_path.is_file() {
        println!("skipped: {} absent", scene.model_path.display());
        return None;
    }
    scene.density.model.max = Some(4.0);
    scene.shadows = Some(ShadowSettings { method, redraw_angle: 0.0, ..ShadowSettings::default() });
    Some(Prepared::from_scene(scene, &mut |_| ()).expect("the ISS can be prepared"))
}

/// Area of each part [m2], and its mean share of the full Sun with its shadows and without them, at a time [s]. `None` in the planet's shadow.
fn part_means(prepared: &Prepared, renderer: &mut Renderer, time: f64) -> Option<Vec<[f64; 3]>> {
    let load = prepared.loads.step_load(time, time + prepared.scene.time.step);
    if load.sun.is_empty() {
        return None;
    }
    renderer.settle(&load).expect("the device settles");
    let visibility = renderer.visibility().expect("the device answers");
    let sun = load.sun.iter().map(|sample| sample.direction * sample.flux).sum::<DVec3>().normalize();
    let nodes = &prepared.nodes;
    let mut means = vec![[0.0; 3]; prepared.parts.len()];
    for slot in (0..nodes.vertex_of_node.len()).filter(|slot| nodes.vertex_of_node[*slot] != PADDING) {
        let pose = load.joints.get(nodes.joint(slot) as usize).copied().unwrap_or(DAffine3::IDENTITY);
        let cosine = (pose.matrix3 * nodes.normals[slot].as_dvec3()).dot(sun);
        let material = &prepared.materials[nodes.group_material[slot / 4] as usize];
        let facing = if material.sides == Sides::Outside { cosine.max(0.0) } else { cosine.abs() };
        let [area, lit, open] = &mut means[nodes.group_part[slot / 4] as usize];
        *area += nodes.areas[slot];
        *lit += nodes.areas[slot] * facing * f64::from(visibility[slot]);
        *open += nodes.areas[slot] * facing;
    }
    let share = |[area, lit, open]: [f64; 3]| if area > 0.0 { [area, lit / area, open / area] } else { [0.0; 3] };
    Some(means.into_iter().map(share).collect())
}

/// Parts from this area on [m2]. Smaller ones have few nodes.
const LARGE: f64 = 50.0;
/// Steps between two places of the orbit.
const EVERY: usize = 3;

/// Largest difference of a part's mean share to that by rays. It is that of the service module's panels, which have few nodes at this density: nodes on
/// the border of the rear layer see past the edge of the front layer. The arrays were 0.47 off between 430 and 740 s.
const MOST_OF_PART: f64 = 0.11;

/// Each part of the ISS over an orbit: its mean share of the Sun by depth against that by rays.
#[test]
#[ignore = "long: tools/test --all"]
fn no_part_of_the_iss_jumps_over_an_orbit() {
    let (Some(by_depth), Some(by_rays)) = (iss(ShadowMethod::Depth), iss(ShadowMethod::Exact)) else { return };
    let context = context();
    let mut devices = [&by_depth, &by_rays].map(|prepared| {
        let data = DeviceData::new(prepared);
        Renderer::new(&context, &data.scene_data(prepared, None)).expect("the ISS on the device")
    });
    let (mut apart, mut unshaded, mut places) = ((0.0, String::new()), 0.0f64, 0);
    for place in (0..360).step_by(EVERY) {
        let time = by_depth.scene.time.step * place as f64;
        let Some(found) = part_means(&by_depth, &mut devices[0], time) else { continue };
        let exact = part_means(&by_rays, &mut devices[1], time).expect("the same Sun");
        places += 1;
        for (part, ([area, found, _], [_, exact, open])) in by_depth.parts.iter().zip(found.into_iter().zip(exact)) {
            if area > LARGE && (found - exact).abs() > apart.0 {
                apart = ((found - exact).abs(), format!("{part} at {time} s: {found:.3} for {exact:.3}"));
            }
            unshaded = unshaded.max(if area > LARGE { open - exact } else { 0.0 });
        }
    }
    println!("{places} places: apart {apart:?}; without shadows {unshaded:.3}");
    assert!(places > 60, "{places} places in sunlight");
    assert!(apart.0 < MOST_OF_PART, "{apart:?}");
    assert!(unshaded > 0.4, "the layers of the arrays shade each other: {unshaded}");
}
