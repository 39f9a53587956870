//! Areas and extent of a model, in f64 from its f64 positions.

use glam::DVec3;

use super::Model;

/// Half the cross product of two edges: length is the area [m2], direction the outward normal.
pub(super) fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
    0.5 * (b - a).cross(c - a)
}

impl Model {
    /// Corners of a triangle [m].
    pub(super) fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|vertex| self.positions[vertex as usize])
    }

    /// Area of triangle `index` [m2].
    pub fn triangle_area(&self, index: usize) -> f64 {
        area_vector(self.corners(self.triangles[index])).length()
    }

    /// Area of all triangles, one side of each [m2].
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|index| self.triangle_area(index)).sum()
    }

    /// Each vertex's share of the area [m2]: a third of every triangle that it belongs to. They sum to [`Model::area`].
    pub fn node_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.positions.len()];
        for (index, triangle) in self.triangles.iter().enumerate() {
            let share = self.triangle_area(index) / 3.0;
            for vertex in triangle {
                areas[*vertex as usize] += share;
            }
        }
        areas
    }

    /// Least and greatest coordinates [m]; infinite, the wrong way round, for a model without vertices.
    pub fn bounds(&self) -> [DVec3; 2] {
        let nothing = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        self.positions.iter().fold(nothing, |[low, high], at| [low.min(*at), high.max(*at)])
    }
}
