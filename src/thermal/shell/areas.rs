//! Areas of nodes. Capacities, loads, emission and contacts all take these areas, so that a uniform value of a surface is the same at every node.

use super::ShellSurface;
use crate::environment::shadow::corner::corner_areas;

/// Area of every drawn vertex [m2]: its shares of the triangles around it.
pub(super) fn vertex_areas(surface: &ShellSurface) -> Vec<f64> {
    let mut areas = vec![0.0; surface.positions.len()];
    for triangle in surface.triangles {
        let corners = triangle.map(|vertex| surface.positions[vertex as usize]);
        for (vertex, share) in triangle.iter().zip(corner_areas(corners)) {
            areas[*vertex as usize] += share;
        }
    }
    areas
}
