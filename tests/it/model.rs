//! The glTF loader, subdivision and summary, on shared files and on generated files.

mod bad_input;
mod density;
mod faces;
mod geometry;
mod instances;
pub mod make;
pub mod shared_files;
mod subdivision;

use glam::{DVec3, Vec3};
use isotherm::internals::Model;

/// Volume inside the triangles [m3] by the divergence theorem. It is positive for outward winding.
fn volume(model: &Model) -> f64 {
    let corner = |vertex: u32| model.positions[vertex as usize];
    model.triangles.iter().map(|[a, b, c]| corner(*a).dot(corner(*b).cross(corner(*c))) / 6.0).sum()
}

/// Checks the invariants of every loaded model.
fn check_promises(model: &Model) {
    let vertices = model.positions.len();
    assert!(!model.triangles.is_empty());
    assert!([model.normals.len(), model.vertex_part.len(), model.vertex_material.len()] == [vertices; 3]);
    assert!(model.positions.iter().all(|position: &DVec3| position.is_finite()));
    assert!(model.normals.iter().all(|normal: &Vec3| (normal.length() - 1.0).abs() < 1e-6));
    let mut used = vec![false; vertices];
    for (index, triangle) in model.triangles.iter().enumerate() {
        assert!(model.triangle_area(index) > 0.0);
        let owner = |of: &[u32]| triangle.map(|vertex| of[vertex as usize]);
        let ([part, ..], [material, ..]) = (owner(&model.vertex_part), owner(&model.vertex_material));
        assert_eq!(owner(&model.vertex_part), [part; 3]);
        assert_eq!(owner(&model.vertex_material), [material; 3]);
        assert!((part as usize) < model.parts.len() && (material as usize) < model.materials.len());
        for vertex in triangle {
            used[*vertex as usize] = true;
        }
    }
    assert!(used.iter().all(|used| *used), "a vertex that no triangle uses");
    let shares: f64 = model.node_areas().iter().sum();
    // The two sums have a million terms in different orders.
    assert!((shares / model.area() - 1.0).abs() < 1e-10);
}
