//! Moves vertices that lie apart by rounding alone to one place, so that a surface has no cracks.
//!
//! A file in f32 often holds one point in several ways: a seam at an angle of 2 pi, a cap that was added to a tube, two instances of a mesh. Conduction, closed bodies and defects compare positions
//! bit by bit.

use std::collections::HashMap;

use glam::DVec3;

use super::Model;
use super::alike::places;

/// Distance that is rounding, over the diagonal of the craft: some units in the last place of an f32.
const ROUNDING: f64 = 5e-7;
/// Side of a cell of the grid, over this distance.
const CELL: f64 = 64.0;
/// Offset of the grid, so that few points of a plane through the origin lie at borders of cells.
const OFF_GRID: f64 = 0.382;

impl Model {
    /// Diagonal of the box around all vertices [m].
    pub(super) fn diagonal(&self) -> f64 {
        let around = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let widen = |[low, high]: [DVec3; 2], at: &DVec3| [low.min(*at), high.max(*at)];
        let [low, high] = self.positions.iter().fold(around, widen);
        (high - low).length()
    }

    /// Moves each vertex that lies within 5e-7 of the craft's diagonal of an earlier one there. No two corners of a triangle become one. Returns how many vertices moved.
    pub(crate) fn snap(mut self) -> (Self, usize) {
        let within = ROUNDING * self.diagonal();
        if !(within > 0.0 && within.is_finite()) {
            return (self, 0);
        }
        // Vertices of one place stay together.
        let (places, count) = places(&self.positions);
        let mut points = vec![DVec3::ZERO; count];
        places.iter().zip(&self.positions).for_each(|(place, position)| points[*place as usize] = *position);
        let mut first = first_near(&points, within);
        for corners in &self.triangles {
            let [a, b, c] = corners.map(|corner| places[corner as usize]);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                if from != to && first[from as usize] == first[to as usize] {
                    [from, to].into_iter().for_each(|place| first[place as usize] = place);
                }
            }
        }
        let mut moved = 0;
        for (position, place) in
            self.positions.iter_mut().zip(places).filter(|(_, place)| first[*place as usize] != *place)
        {
            *position = points[first[place as usize] as usize];
            moved += 1;
        }
        (self, moved)
    }
}

/// For every point the first one within a distance [m] that stands for others, which may be itself.
fn first_near(points: &[DVec3], within: f64) -> Vec<u32> {
    let side = CELL * within;
    let mut first_of: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut first = Vec::with_capacity(points.len());
    for (number, point) in (0..).zip(points) {
        let scaled = *point / side + OFF_GRID;
        // A point near a border of its cell may be near one of the next cell.
        let [low, high] = [-1.0, 1.0].map(|turn| (scaled + turn / CELL).floor().as_i64vec3());
        let cells =
            (low.x..=high.x).flat_map(|x| (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| [x, y, z])));
        let near = |other: &&u32| points[**other as usize].distance_squared(*point) <= within * within;
        let found = cells.filter_map(|cell| first_of.get(&cell)?.iter().find(near).copied()).min();
        first.push(found.unwrap_or(number));
        if found.is_none() {
            first_of.entry(scaled.floor().as_i64vec3().to_array()).or_default().push(number);
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_differ_by_rounding_have_one_place() {
        // A ring in f32 whose last point is the first one again, at 2 pi, and both again beside borders of cells of every size.
        for scale in [1.0f32, 0.37, 55.0] {
            let at = |step: u32| {
                let turn = step as f32 / 12.0 * std::f32::consts::TAU;
                DVec3::new(f64::from(scale * turn.cos()), f64::from(scale * turn.sin()), f64::from(scale))
            };
            let points: Vec<DVec3> = (0..=12).map(at).collect();
            assert_ne!(points[0], points[12]);
            let within = ROUNDING * 2.0 * f64::from(scale);
            let first = first_near(&points, within);
            assert_eq!(first[..12], (0..12).collect::<Vec<u32>>());
            assert_eq!(first[12], 0);
            // A distance that is more than rounding stays.
            assert_eq!(first_near(&[points[0], points[0] + 1.1 * within * DVec3::X], within), [0, 1]);
            for step in 0..200 {
                let apart = DVec3::new(0.4, -0.6, 0.5) * within;
                let point = points[3] + f64::from(step) * 1.7 * within * DVec3::ONE;
                assert_eq!(first_near(&[point, point + apart], within), [0, 0], "{step}");
            }
        }
    }

    #[test]
    fn no_triangle_loses_a_corner() {
        let [near, beside] = [DVec3::new(1e-7, 0.0, 0.0), DVec3::new(0.0, 1e-7, 0.0)];
        // The last triangle has a corner of its own where the sliver has one.
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y, near, beside, near];
        let triangles = vec![[0, 1, 2], [0, 1, 3], [4, 1, 2], [5, 1, 2]];
        let model = Model { positions: positions.to_vec(), triangles, ..Model::default() };
        let (model, moved) = model.snap();
        assert_eq!(moved, 1);
        assert_eq!(model.positions, [DVec3::ZERO, DVec3::X, DVec3::Y, near, DVec3::ZERO, near]);
    }
}
