//! Tests of the station: closed bodies, normals, areas, unique names, and identical bytes every time.

use std::collections::{HashMap, HashSet};

use glam::{DVec3, dvec3};
use serde_json::Value;

use crate::glb;
use crate::layout::{self, Node, Station, station};
use crate::material::Material;
use crate::mesh::Mesh;
use crate::panels::{BLANKET_LENGTH, BLANKET_WIDTH};

type Triangle = [DVec3; 3];

/// Corners of the triangles of a mesh whose material is (or is not) a sheet.
fn triangles(mesh: &Mesh, sheet: bool) -> Vec<Triangle> {
    let surfaces = mesh.surfaces.iter().filter(|s| s.material.is_sheet() == sheet);
    surfaces.flat_map(|s| s.triangles.iter().map(|t| t.map(|corner| s.positions[corner as usize]))).collect()
}

fn key(point: DVec3) -> [u64; 3] {
    // Adding 0 makes -0 into 0.
    point.to_array().map(|value| (value + 0.0).to_bits())
}

/// Whether every edge occurs equally often in both directions.
fn is_watertight(triangles: &[Triangle]) -> bool {
    let mut balance: HashMap<_, i32> = HashMap::new();
    for [a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (from, to) = (key(*from), key(*to));
            *balance.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
        }
    }
    balance.values().all(|count| *count == 0)
}

/// Signed volumes of the bodies of a mesh. Triangles connected through corners are one body.
fn body_volumes(triangles: &[Triangle]) -> Vec<f64> {
    fn root(parent: &mut [usize], mut at: usize) -> usize {
        while parent[at] != at {
            parent[at] = parent[parent[at]];
            at = parent[at];
        }
        at
    }
    let mut parent: Vec<usize> = (0..triangles.len()).collect();
    let mut owner = HashMap::new();
    for (index, triangle) in triangles.iter().enumerate() {
        for corner in triangle {
            let other = *owner.entry(key(*corner)).or_insert(index);
            let (a, b) = (root(&mut parent, index), root(&mut parent, other));
            parent[a] = b;
        }
    }
    let mut volumes: HashMap<usize, f64> = HashMap::new();
    for (index, [a, b, c]) in triangles.iter().enumerate() {
        *volumes.entry(root(&mut parent, index)).or_default() += a.dot(b.cross(*c)) / 6.0;
    }
    volumes.into_values().collect()
}

fn flipped([a, b, c]: Triangle) -> Triangle {
    [a, c, b]
}

#[test]
fn closed_bodies_are_watertight_with_positive_volume() {
    for (name, mesh) in &station().meshes {
        let closed = triangles(mesh, false);
        assert!(is_watertight(&closed), "{name} leaks");
        assert!(body_volumes(&closed).iter().all(|volume| *volume > 1e-4), "{name} has an inverted body");

        assert!(!is_watertight(&closed[1..]), "{name}: a missing triangle must leak");
        let mut turned = closed.clone();
        turned[0] = flipped(turned[0]);
        assert!(!is_watertight(&turned), "{name}: a flipped triangle must leak");
        let inverted: Vec<Triangle> = closed.iter().copied().map(flipped).collect();
        assert!(body_volumes(&inverted).iter().all(|volume| *volume < 0.0), "{name}: inside out must show");
    }
}

#[test]
fn turned_bodies_have_the_volume_of_their_polygon() {
    // A prism over a regular n-gon: n/2 r^2 sin(2 pi / n) x length, here n = 12, sin(30 deg) = 1/2.
    let mut mesh = Mesh::default();
    mesh.cylinder(Material::WhitePaint, dvec3(1.0, 2.0, 3.0), DVec3::Y, 2.0, 5.0);
    let volumes = body_volumes(&triangles(&mesh, false));
    let expected = 6.0 * 4.0 * 0.5 * 5.0;
    assert_eq!(volumes.len(), 1);
    // The positions are rounded to 1/8192 m.
    assert!((volumes[0] - expected).abs() < 5e-3, "{} against {expected}", volumes[0]);
    assert!((volumes[0] - std::f64::consts::PI * 20.0).abs() > 1.0, "the round cylinder is another volume");
}

#[test]
fn normals_are_unit_and_agree_with_the_winding() {
    for (name, mesh) in &station().meshes {
        for surface in &mesh.surfaces {
            for triangle in &surface.triangles {
                let [a, b, c] = triangle.map(|corner| surface.positions[corner as usize]);
                let normal = (b - a).cross(c - a);
                assert!(normal.length() / 2.0 > 1e-5, "{name}: degenerate triangle {a} {b} {c}");
                for corner in triangle {
                    let stored = surface.normals[*corner as usize];
                    assert!((stored.length() - 1.0).abs() < 1e-12, "{name}: normal {stored}");
                    // Half a strip of a 12-sided cylinder: cos 15 deg = 0.966.
                    assert!(stored.dot(normal.normalize()) > 0.96, "{name}: {stored} against {normal}");
                }
            }
        }
    }
}

/// Calls `visit` with every node and its position in the body frame.
fn walk(node: &Node, parent: DVec3, visit: &mut impl FnMut(&Node, DVec3)) {
    let here = parent + node.translation;
    visit(node, here);
    for child in &node.children {
        walk(child, here, visit);
    }
}

/// The triangles of all instances in the body frame, of sheets or of closed bodies.
fn drawn(station: &Station, sheet: bool) -> Vec<(String, Triangle)> {
    let mut all = vec![];
    walk(&station.root, DVec3::ZERO, &mut |node, origin| {
        if let Some(mesh) = node.mesh {
            let moved = triangles(&station.meshes[mesh].1, sheet).into_iter().map(|t| t.map(|p| p + origin));
            all.extend(moved.map(|triangle| (node.name.clone(), triangle)));
        }
    });
    all
}

#[test]
fn the_arrays_have_their_designed_area_and_face_zenith() {
    let station = station();
    let wings: Vec<_> = drawn(&station, true).into_iter().filter(|(name, _)| name.starts_with("array_wing_")).collect();
    let mut area = 0.0;
    for (_, [a, b, c]) in &wings {
        let normal = (b - a).cross(c - a);
        assert!(normal.normalize().dot(DVec3::NEG_Z) > 1.0 - 1e-12);
        area += normal.length() / 2.0;
    }
    let expected = 8.0 * 2.0 * BLANKET_LENGTH * BLANKET_WIDTH;
    assert!((area - expected).abs() < 0.2, "{area} m2 against {expected} m2");
    assert!((area * 2.0 - expected).abs() > 0.2, "closed boxes would count every blanket twice");
}

#[test]
fn the_station_has_the_scale_of_the_iss() {
    let station = station();
    let (mut lower, mut upper) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (_, triangle) in drawn(&station, false).into_iter().chain(drawn(&station, true)) {
        for corner in triangle {
            (lower, upper) = (lower.min(corner), upper.max(corner));
        }
    }
    // ISS_42.glb measures 74 x 109 x 33 m.
    let size = upper - lower;
    assert!((70.0..80.0).contains(&size.x) && (105.0..112.0).contains(&size.y), "{size}");
    assert!((lower + upper).abs().max_element() < 5.0, "centre {}", (lower + upper) / 2.0);
    assert!((5_000..16_000).contains(&layout::triangles_drawn(&station)));
}

#[test]
fn names_are_unique_and_the_joints_are_there() {
    let station = station();
    let mut names = HashSet::new();
    walk(&station.root, DVec3::ZERO, &mut |node, _| {
        assert!(names.insert(node.name.clone()), "{} twice", node.name);
        assert!(!node.name.contains("_joint") || node.mesh.is_none(), "joint {} has a mesh of its own", node.name);
    });
    let numbered = |name: &str, count: usize| (1..=count).map(|n| format!("{name}_{n}")).collect::<Vec<_>>();
    let mut joints = [numbered("beta_joint", 8), numbered("pv_radiator_joint", 4)].concat();
    joints.extend(["alpha_joint_port", "alpha_joint_starboard"].map(String::from));
    joints.extend(["port", "centre", "starboard"].map(|name| format!("radiator_joint_{name}")));
    for joint in joints {
        assert!(names.contains(&joint), "{joint} is missing");
    }
    assert!(!names.contains("beta_joint_9"));
    for material in Material::ALL {
        let used = station.meshes.iter().any(|(_, mesh)| mesh.surfaces.iter().any(|s| s.material == material));
        assert!(used, "{} is not used", material.name());
    }
}

#[test]
fn the_file_in_models_is_what_the_generator_writes() -> std::io::Result<()> {
    let bytes = glb::write(&station());
    assert_eq!(bytes, glb::write(&station()), "two runs differ");
    assert!(bytes.len() < 1_500_000);
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/station.glb");
    let stored = std::fs::read(path)?;
    assert!(stored == bytes, "run: cargo run -p isotherm-tools --bin station -- -o models/station.glb");
    Ok(())
}

/// The JSON and binary chunks of a container, its framing checked.
fn chunks(file: &[u8]) -> (Value, &[u8]) {
    let word = |at: usize| u32::from_le_bytes([file[at], file[at + 1], file[at + 2], file[at + 3]]) as usize;
    assert_eq!(&file[..4], b"glTF");
    assert_eq!((word(4), word(8)), (2, file.len()));
    let text = word(12);
    assert_eq!((&file[16..20], text % 4), (&b"JSON"[..], 0));
    assert_eq!((&file[24 + text..28 + text], word(20 + text)), (&b"BIN\0"[..], file.len() - 28 - text));
    let document = serde_json::from_slice(&file[20..20 + text]);
    (document.unwrap_or_else(|error| panic!("JSON chunk: {error}")), &file[28 + text..])
}

#[test]
fn accessors_lie_in_the_buffer_and_state_their_true_bounds() {
    let file = glb::write(&station());
    let (document, binary) = chunks(&file);
    let number = |value: &Value| value.as_u64().unwrap_or_default() as usize;
    let mut bounded = 0;
    for accessor in document["accessors"].as_array().into_iter().flatten() {
        let view = &document["bufferViews"][number(&accessor["bufferView"])];
        let vector = accessor["type"] == "VEC3";
        let length = number(&accessor["count"]) * if vector { 12 } else { 4 };
        let offset = number(&accessor["byteOffset"]);
        assert!(length > 0 && offset + length <= number(&view["byteLength"]), "{accessor}");
        if accessor["min"].is_null() {
            continue;
        }
        bounded += 1;
        let start = number(&view["byteOffset"]) + offset;
        let (words, _) = binary[start..start + length].as_chunks::<4>();
        let values: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
        for axis in 0..3 {
            let column = || values.iter().skip(axis).step_by(3).copied();
            let (lowest, highest) = (column().fold(f32::MAX, f32::min), column().fold(f32::MIN, f32::max));
            assert_eq!(accessor["min"][axis].as_f64(), Some(f64::from(lowest)), "{accessor}");
            assert_eq!(accessor["max"][axis].as_f64(), Some(f64::from(highest)), "{accessor}");
        }
    }
    let surfaces: usize = station().meshes.iter().map(|(_, mesh)| mesh.surfaces.len()).sum();
    assert_eq!(bounded, surfaces);
}
