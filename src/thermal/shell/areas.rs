//! Areas of nodes: the part of each drawn triangle's area that belongs to each of its corners.
//!
//! A corner has the points that lie nearer to it than to the other two: its mixed Voronoi area. In an obtuse triangle half the area belongs to the
//! obtuse corner and a quarter to each of the others (Meyer, Desbrun, Schroeder & Barr, Visualization and Mathematics III, 2003, section 3.3).
//! Capacities, loads, emission and contacts all take these areas, so that a uniform value of a surface is the same at every node.

use glam::DVec3;

use super::ShellSurface;

/// The three corners' shares of a triangle's area [m2], which sum to the area.
pub(super) fn corner_areas(corners: [DVec3; 3]) -> [f64; 3] {
    let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
    if area <= 0.0 {
        return [0.0; 3];
    }
    let dots = corner_dots(corners);
    if dots.iter().any(|dot| *dot < 0.0) {
        return dots.map(|dot| if dot < 0.0 { 0.5 * area } else { 0.25 * area });
    }
    // The cotangent of a corner's angle is its product over two areas.
    [0, 1, 2].map(|corner| {
        let [next, last] = [(corner + 1) % 3, (corner + 2) % 3];
        let [out, back] = [next, last].map(|other| corners[corner].distance_squared(corners[other]));
        (out * dots[last] + back * dots[next]) / (16.0 * area)
    })
}

/// The product of the two edges at each corner [m2], negative at an obtuse one.
pub(super) fn corner_dots(corners: [DVec3; 3]) -> [f64; 3] {
    [0, 1, 2].map(|corner| {
        let [next, last] = [corners[(corner + 1) % 3], corners[(corner + 2) % 3]];
        (next - corners[corner]).dot(last - corners[corner])
    })
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_share_a_triangle_by_hand() {
        let [a, b] = [DVec3::ZERO, DVec3::X];
        let near = |computed: [f64; 3], expected: [f64; 3]| {
            computed.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-15)
        };
        let third = 0.75_f64.sqrt() / 6.0;
        assert!(near(corner_areas([a, b, DVec3::new(0.5, 0.75_f64.sqrt(), 0.0)]), [third; 3]), "equilateral");
        assert!(near(corner_areas([a, b, DVec3::Y]), [0.25, 0.125, 0.125]), "half a square");
        assert!(near(corner_areas([a, b, DVec3::new(0.5, 0.1, 0.0)]), [0.0125, 0.0125, 0.025]), "obtuse");
        assert_eq!(corner_areas([a, b, 0.5 * b]), [0.0; 3]);
        // Isosceles, base 1 and height 1: the circumcentre is 3/8 above the base, so each end of the base has a triangle of 1/2 x 3/8 / 2 and one of
        // half the side, sqrt(5)/4, times the distance of its middle from the circumcentre, sqrt(5)/8 / 2, over 2: 3/32 + 5/64.
        let found = corner_areas([a, b, DVec3::new(0.5, 1.0, 0.0)]);
        assert!(near(found, [11.0 / 64.0, 11.0 / 64.0, 10.0 / 64.0]), "{found:?}");
    }
}
