//! Meshes for BOP: PLY in millimetres, and their extents.

use std::fmt::Write;

use glam::{DAffine3, DVec3};
use serde_json::json;

use super::craft::{Craft, Symmetries};
use super::silhouette::Solids;
use super::text::{line, object};

/// The vertices that triangles use, and the triangles between them.
fn compact(triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<[usize; 3]>) {
    let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let place = |vertex: u32| used.partition_point(|used| *used < vertex);
    let moved = triangles.iter().map(|triangle| triangle.map(place)).collect();
    (used, moved)
}

/// A position [m] in millimetres as the file has it, with four decimals.
fn millimetres(position: DVec3) -> DVec3 {
    // A zero without sign.
    (position * 1e7).round() * 1e-4 + 0.0
}

/// Triangles of a craft as an ASCII PLY in millimetres, with vertex normals (docs/bop_datasets_format.md of bop_toolkit, "3D object models").
pub(crate) fn ply(craft: &Craft, triangles: &[[u32; 3]]) -> String {
    let (vertices, triangles) = compact(triangles);
    let mut text = format!(
        "ply\nformat ascii 1.0\ncomment millimetres, body axes of Isotherm\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        triangles.len()
    );
    for vertex in vertices {
        let [x, y, z] = millimetres(craft.positions[vertex as usize]).to_array();
        let [nx, ny, nz] = craft.normals[vertex as usize].to_array().map(|part| part + 0.0);
        // A text takes everything that is written to it.
        let _ = writeln!(text, "{x:.4} {y:.4} {z:.4} {nx:.6} {ny:.6} {nz:.6}");
    }
    for [a, b, c] in triangles {
        let _ = writeln!(text, "3 {a} {b} {c}");
    }
    text
}

/// Greatest distance between two points. Pairs are tried from the outermost inwards, until no pair can be farther apart.
pub(crate) fn diameter(points: &[DVec3]) -> f64 {
    let [low, high] = points
        .iter()
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], point| [low.min(*point), high.max(*point)]);
    let middle = 0.5 * (low + high);
    let mut outer: Vec<(f64, DVec3)> = points.iter().map(|point| (point.distance(middle), *point)).collect();
    outer.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut greatest = 0.0_f64;
    for (place, (radius, point)) in outer.iter().enumerate() {
        if 2.0 * radius < greatest {
            break;
        }
        let near = outer[place + 1..].iter().take_while(|(other, _)| radius + other >= greatest);
        greatest = near.fold(greatest, |greatest, (_, other)| greatest.max(point.distance(*other)));
    }
    greatest
}

/// A number whose last digits, which rounding makes, are left out.
fn rounded(number: f64) -> f64 {
    (number * 1e12).round() / 1e12 + 0.0
}

/// The symmetries of an object as BOP has them: 4 x 4 matrices row by row, and axes with a point of each [mm].
fn put_symmetries(info: &mut serde_json::Value, symmetries: &Symmetries) {
    let matrix = |turn: &DAffine3| {
        let (rows, place) = (turn.matrix3.transpose(), turn.translation * 1e3);
        let row = |row: DVec3, last: f64| [row.x, row.y, row.z, last];
        let rows =
            [row(rows.x_axis, place.x), row(rows.y_axis, place.y), row(rows.z_axis, place.z), row(DVec3::ZERO, 1.0)];
        rows.concat().into_iter().map(rounded).collect::<Vec<f64>>()
    };
    if !symmetries.discrete.is_empty() {
        info["symmetries_discrete"] = symmetries.discrete.iter().map(matrix).collect();
    }
    if let Some([axis, place]) = symmetries.continuous {
        let offset = (place * 1e3).to_array().map(rounded);
        info["symmetries_continuous"] = json!([{ "axis": axis.to_array(), "offset": offset }]);
    }
}

/// `models_info.json`: diameter, least corner and size of each object [mm], and its symmetries.
pub(crate) fn models_info(craft: &Craft, solids: &Solids) -> String {
    object(solids.objects().iter().map(|solid| {
        let (vertices, _) = compact(&craft.triangles_of(solid));
        let points: Vec<DVec3> = vertices.iter().map(|vertex| millimetres(craft.positions[*vertex as usize])).collect();
        let [low, high] = points
            .iter()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], point| [low.min(*point), high.max(*point)]);
        let size = high - low;
        let mut info = json!({
            "diameter": diameter(&points),
            "min_x": low.x, "min_y": low.y, "min_z": low.z,
            "size_x": size.x, "size_y": size.y, "size_z": size.z,
        });
        if let Some(symmetry) = craft.symmetries.iter().find(|symmetry| symmetry.object == solid.id) {
            put_symmetries(&mut info, symmetry);
        }
        (solid.id, line(info))
    }))
}

#[cfg(test)]
mod tests {
    use super::super::image::tests::small_craft;
    use super::*;

    #[test]
    fn a_mesh_is_in_millimetres_with_its_own_vertices() {
        let (craft, solids) = (small_craft(), Solids::new(&small_craft()));
        let text = ply(&craft, &craft.triangles_of(&craft.objects()[1]));
        let body = text.split("end_header\n").nth(1).expect("a body");
        assert_eq!(
            body,
            "1000.0000 0.0000 0.0000 0.000000 0.000000 1.000000\n3000.0000 0.0000 0.0000 0.000000 0.000000 1.000000\n\
             3000.0000 1000.0000 0.0000 0.000000 0.000000 1.000000\n3 0 1 2\n"
        );
        assert!(text.contains("element vertex 3\n") && text.contains("element face 1\n"));
        let info: serde_json::Value = serde_json::from_str(&models_info(&craft, &solids)).expect("JSON");
        let diameter = 1000.0 * 5.0_f64.sqrt();
        let expected = json!({"diameter": diameter, "min_x": 1000.0, "min_y": 0.0, "min_z": 0.0, "size_x": 2000.0, "size_y": 1000.0, "size_z": 0.0});
        assert_eq!(info["2"], expected);
        assert_ne!(info["1"], expected);
    }

    #[test]
    fn the_diameter_is_that_of_all_pairs() {
        // Numbers without order, from a linear congruence.
        let mut state = 12345_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        for flat in [1.0, 0.01] {
            let points: Vec<DVec3> = (0..300).map(|_| DVec3::new(next(), flat * next(), 3.0 * next())).collect();
            let all = points.iter().flat_map(|a| points.iter().map(|b| a.distance(*b)));
            assert_eq!(diameter(&points), all.fold(0.0, f64::max));
        }
        assert_eq!(diameter(&[DVec3::ONE]), 0.0);
    }

    #[test]
    fn a_file_has_four_decimals_and_no_negative_zero() {
        assert_eq!(millimetres(DVec3::new(-1e-9, 0.123_456_78, 1.0)), DVec3::new(0.0, 123.4568, 1000.0));
        assert!(millimetres(DVec3::new(-1e-9, 0.0, 0.0)).x.is_sign_positive());
        assert_eq!(compact(&[[7, 3, 9]]), (vec![3, 7, 9], vec![[1, 0, 2]]));
    }
}
