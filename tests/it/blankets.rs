//! Sunlight on thin layers: two plates above each other are lit by as much as their silhouette says, at any gap and angle.

use glam::DVec3;
use isotherm::internals::{LitArea, PADDING, Prepared};
use serde_json::json;

use super::craft::{Folder, glb, scene_with};

/// Side of a blanket [m].
const SIDE: f32 = 10.0;
/// Where a blanket's corner stands [m]: beside the craft, so that neither shades the other while the Sun turns about X.
const PLACE: f32 = 30.0;

/// Two plates above each other beside the craft, and a speck far away that gives the whole its size [m].
fn blanket(gap: f32, size: f32) -> Prepared {
    let sections = "[shadows]\nspacing = 0.3\nredraw_angle_deg = 0\n[radiance]";
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

/// Nodes of the two plates.
fn slots_of(prepared: &Prepared) -> Vec<usize> {
    let nodes = &prepared.nodes;
    let part = prepared.parts.iter().position(|part| part == "blanket").expect("the blanket") as u32;
    let of_plates = |slot: &usize| {
        nodes.vertex_of_node[*slot] != PADDING && nodes.group_part[slot / 4] == part && nodes.positions[*slot].x > 20.0
    };
    (0..nodes.vertex_of_node.len()).filter(of_plates).collect()
}

fn direction(degrees: f64) -> DVec3 {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    DVec3::new(0.02, sine, cosine).normalize()
}

/// Area of both plates that the Sun sees, over the area of one [1]: the front plate, and the strips of the other beside its shadow.
fn silhouette(gap: f32, sun: DVec3) -> f64 {
    let covered = |along: f64| (1.0 - f64::from(gap / SIDE) * (along / sun.z).abs()).max(0.0);
    sun.z.abs() * (2.0 - covered(sun.x) * covered(sun.y))
}

/// Gap between the plates and size of the craft [m].
const BLANKETS: [(f32, f32); 4] = [(0.01, 60.0), (0.04, 120.0), (0.04, 300.0), (0.1, 300.0)];

/// The filter of a depth map, or a start of rays in proportion to a texel, lit or shaded whole plates in jumps.
#[test]
fn a_blanket_neither_lights_nor_shades_itself() {
    for (gap, size) in BLANKETS {
        let prepared = blanket(gap, size);
        let slots = slots_of(&prepared);
        let light = prepared.lit_areas(slots.iter().copied()).expect("shadows are on");
        let areas: Vec<f64> = slots.iter().map(|slot| prepared.nodes.areas[*slot]).collect();
        let seen = |lit: &[LitArea], sun: DVec3| {
            areas.iter().zip(lit).map(|(area, lit)| area * lit.vector.dot(sun)).sum::<f64>() / f64::from(SIDE * SIDE)
        };
        let mut apart = [0.0f64; 2];
        for degrees in -88..=88 {
            let sun = direction(f64::from(degrees));
            let found = seen(&light.under(sun, &[]), sun);
            apart[0] = apart[0].max((found - silhouette(gap, sun)).abs());
            apart[1] = apart[1].max((found - silhouette(3.0 * gap + 0.1, sun)).abs());
        }
        println!("gap {gap} m on {size} m: {} off the silhouette, {} off that of a wider gap", apart[0], apart[1]);
        assert!(apart[0] < 0.01, "gap {gap} m on {size} m: {apart:?}");
        assert!(apart[1] > 0.01, "a wider gap must show: {apart:?}");
    }
}
