//! Areas and extent of a model, in f64.

use glam::DVec3;

use super::Model;

/// Half the cross product of two edges: the length is the area [m2], the direction the outward normal.
pub(super) fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
    0.5 * (b - a).cross(c - a)
}

impl Model {
    pub(super) fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|vertex| self.positions[vertex as usize])
    }

    /// Longest side of the box around the triangles [m].
    pub(crate) fn extent(&self) -> f64 {
        let drawn = || self.triangles.iter().flatten().map(|vertex| self.positions[*vertex as usize]);
        let low = drawn().fold(DVec3::INFINITY, DVec3::min);
        (drawn().fold(DVec3::NEG_INFINITY, DVec3::max) - low).max_element().max(0.0)
    }

    /// Area of triangle `index` [m2].
    pub fn triangle_area(&self, index: usize) -> f64 {
        area_vector(self.corners(self.triangles[index])).length()
    }

    /// Area of all triangles [m2], one side of each.
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|index| self.triangle_area(index)).sum()
    }

    /// Area of each vertex [m2]: a third of every triangle around it. The sum is [`Model::area`].
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

    /// Smallest and largest coordinates [m]. A model without vertices gives infinities.
    pub fn bounds(&self) -> [DVec3; 2] {
        let nothing = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        self.positions.iter().fold(nothing, |[low, high], at| [low.min(*at), high.max(*at)])
    }
}
