//! Subdivision: no edge too long, no crack, same area, volume, materials and parts.

use std::collections::{HashMap, HashSet};

use isotherm::ModelError;
use isotherm::internals::Model;
use serde_json::json;

use super::make::Maker;
use super::shared_files::shared;
use super::{check_promises, volume};

fn load(maker: &Maker) -> Model {
    let folder = tempfile::tempdir().unwrap();
    Model::load(&maker.save(folder.path())).unwrap()
}

fn split(model: Model, max_edge: f64) -> Model {
    let split = model.subdivide(max_edge, usize::MAX, &mut |_| {}).unwrap();
    check_promises(&split);
    split
}

pub fn longest_edge(model: &Model) -> f64 {
    let at = |vertex: u32| model.positions[vertex as usize];
    let edges = model.triangles.iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
    edges.map(|[a, b]| at(*a).distance(at(*b))).fold(0.0, f64::max)
}

/// Number of edges (by the bits of their ends) that occur more often in one direction. A closed surface has none, a
/// crack has some.
pub fn open_edges(model: &Model) -> usize {
    let bits = |vertex: u32| (model.positions[vertex as usize] + 0.0).to_array().map(f64::to_bits);
    let mut balance: HashMap<_, i64> = HashMap::new();
    for [a, b, c] in &model.triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let (from, to) = (bits(*from), bits(*to));
            *balance.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
        }
    }
    balance.values().filter(|count| **count != 0).count()
}

/// A rotated box of unequal sides, so that midpoints need rounding.
fn turned_box(unwelded: bool) -> Model {
    let mut maker = Maker::cube();
    maker.json["nodes"][0]["scale"] = json!([7.3, 0.9, 2.1]);
    maker.json["nodes"][0]["rotation"] = json!([0.1, 0.7, 0.1, 0.7]);
    maker.json["nodes"][0]["translation"] = json!([1.234_567_891, -0.3, 10.1]);
    if !unwelded {
        let normals = maker.floats(&super::make::cube_corners());
        maker.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    }
    load(&maker)
}

#[test]
fn a_box_stays_closed_and_keeps_its_measures() {
    for unwelded in [false, true] {
        let before = turned_box(unwelded);
        assert_eq!(open_edges(&before), 0);
        for max_edge in [3.0, 1.0, 0.3] {
            let after = split(before.clone(), max_edge);
            assert!(longest_edge(&after) <= max_edge);
            assert!(after.triangles.len() > before.triangles.len());
            assert_eq!(open_edges(&after), 0, "cracks at {max_edge} m, unwelded {unwelded}");
            assert!((after.area() / before.area() - 1.0).abs() < 1e-12);
            assert!((volume(&after) / volume(&before) - 1.0).abs() < 1e-12);
            assert_eq!((after.materials.len(), after.parts.len()), (1, 1));
        }
    }
}

/// The test of cracks can fail: moving one vertex by one unit in the last place opens the surface.
#[test]
fn a_moved_vertex_is_a_crack() {
    let mut model = split(turned_box(true), 1.0);
    let moved = &mut model.positions[40].x;
    *moved = f64::from_bits(moved.to_bits() + 1);
    assert!(open_edges(&model) > 0);
}

/// A welded, closed surface of Euler characteristic 2 keeps it: V - E + F = 2 with E = 3 F / 2.
#[test]
fn midpoints_are_shared() {
    let model = split(turned_box(false), 0.5);
    assert_eq!(model.positions.len(), 2 + model.triangles.len() / 2);
    let unwelded = split(turned_box(true), 0.5);
    assert!(unwelded.positions.len() > model.positions.len());
    assert_eq!((open_edges(&model), open_edges(&unwelded)), (0, 0));
}

#[test]
fn nothing_happens_where_edges_are_short_enough() {
    let before = turned_box(true);
    let (positions, triangles) = (before.positions.clone(), before.triangles.clone());
    let after = split(before, 100.0);
    assert_eq!((after.positions, after.triangles), (positions, triangles));
}

#[test]
fn refusals() {
    for max_edge in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = turned_box(true).subdivide(max_edge, usize::MAX, &mut |_| {});
        assert!(matches!(refused, Err(ModelError::MaxEdge(_))), "{max_edge}");
    }
    let mut told = Vec::new();
    let refused = turned_box(true).subdivide(0.01, 5_000, &mut |vertices| told.push(vertices));
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("limit is 5000") && message.contains("made.glb"), "{message}");
    assert!(told.is_sorted() && told.iter().all(|vertices| *vertices <= 5_000));
}

/// An unwelded mesh, after welding, equals the mesh that shares vertices with equal normals.
#[test]
fn welding_joins_what_is_the_same_and_nothing_else() {
    let unwelded = turned_box(true);
    let welded = unwelded.clone().weld();
    check_promises(&welded);
    // Six flat faces of four corners, so creases stay.
    assert_eq!((unwelded.positions.len(), welded.positions.len()), (36, 24));
    let corners = |model: &Model| -> Vec<_> {
        let flat = model.triangles.as_flattened().iter();
        flat.map(|vertex| (model.positions[*vertex as usize], model.normals[*vertex as usize])).collect()
    };
    assert_eq!(corners(&unwelded), corners(&welded));
    let mut parted = unwelded;
    parted.vertex_material[0..3].fill(1);
    parted.materials.push(parted.materials[0].clone());
    assert!(parted.weld().positions.len() > 24, "a difference of material must keep vertices apart");
}

/// Places that differ in position, part or material.
fn places(model: &Model) -> usize {
    let place = |vertex: usize| {
        let position = (model.positions[vertex] + 0.0).to_array().map(f64::to_bits);
        (position, model.vertex_part[vertex], model.vertex_material[vertex])
    };
    (0..model.positions.len()).map(place).collect::<HashSet<_>>().len()
}

/// Halving every long edge gives the ISS 43 k and 138 k vertices at 2 and 1 m, counted without regard to normals (shared/REFERENCES.md 5). Long strips of flat faces need fewer. Equilateral
/// triangles with these edges would have the fewest, half as many as triangles.
#[test]
fn the_station() {
    let Some(shared) = shared() else { return };
    let before = Model::load(&shared.join("models/ISS_42.glb")).unwrap().weld();
    check_promises(&before);
    let (area, content, parts) = (before.area(), volume(&before), before.parts.len());
    assert_eq!(open_edges(&before), 0, "the file itself is closed");
    for (max_edge, reference) in [(2.0, 43_000), (1.0, 138_000)] {
        let after = split(before.clone(), max_edge);
        let fewest = (0.5 * area / (0.25 * 3f64.sqrt() * max_edge * max_edge)) as usize;
        println!("{max_edge} m: {} places, at least {fewest}", places(&after));
        assert!(places(&after) > fewest && places(&after) < reference, "{max_edge}");
        // The corners of a flat face are off its plane by the rounding of f32 at 50 m, and so the other diagonal of two triangles encloses another volume: 7e-9 of it.
        assert!((after.area() / area - 1.0).abs() < 1e-9 && (volume(&after) / content - 1.0).abs() < 2e-8);
        assert!(longest_edge(&after) <= max_edge);
        assert_eq!((after.parts.len(), after.materials.len()), (parts, 30));
        assert_eq!(open_edges(&after), 0, "cracks at {max_edge} m");
    }
}
