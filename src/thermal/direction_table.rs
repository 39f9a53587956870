//! A table of values over all directions, on an octahedron that is unfolded into a square (Cigolle et al. 2014). Twin: `planet_mean` in glsl/reflection.glsl.

use glam::{DVec2, DVec3, Vec2Swizzles};
use rayon::prelude::*;

/// Places along each side of the square. The outer ones lie on its border.
pub(crate) const SIDE: usize = 73;

/// Values at the places of the square, row after row. Between four places a value is bilinear.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DirectionTable {
    pub(crate) values: Vec<f32>,
}

impl DirectionTable {
    /// A table whose values follow from the directions.
    pub(crate) fn new(value: impl Fn(DVec3) -> f64 + Sync) -> Self {
        let along = |number: usize| 2.0 * number as f64 / (SIDE - 1) as f64 - 1.0;
        let at = |cell: usize| value(folded(DVec2::new(along(cell % SIDE), along(cell / SIDE)))) as f32;
        Self { values: (0..SIDE * SIDE).into_par_iter().map(at).collect() }
    }

    /// Value in a direction.
    pub(crate) fn at(&self, direction: DVec3) -> f64 {
        let flat = direction.truncate() / direction.abs().element_sum();
        let place = if direction.z < 0.0 { turned(flat) } else { flat };
        let place = 0.5 * (place + 1.0) * (SIDE - 1) as f64;
        let cell = place.floor().min(DVec2::splat((SIDE - 2) as f64));
        let way = place - cell;
        let first = cell.y as usize * SIDE + cell.x as usize;
        let of_row = |first: usize| {
            let [west, east] = [first, first + 1].map(|place| f64::from(self.values[place]));
            west + way.x * (east - west)
        };
        let (above, below) = (of_row(first), of_row(first + SIDE));
        above + way.y * (below - above)
    }
}

/// The direction of a place.
fn folded(place: DVec2) -> DVec3 {
    let height = 1.0 - place.abs().element_sum();
    (if height < 0.0 { turned(place) } else { place }).extend(height).normalize()
}

/// A place of the lower half of the octahedron, which is folded over an edge: to the square and back.
fn turned(place: DVec2) -> DVec2 {
    let sign = DVec2::ONE.copysign(place);
    (1.0 - place.yx().abs()) * sign
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_gives_back_a_smooth_function_in_every_direction() {
        let value = |way: DVec3| 2.0 + way.x + 0.5 * way.y * way.z - way.z;
        let (table, mirrored) = (DirectionTable::new(value), DirectionTable::new(|way| value(-way)));
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let (mut worst, mut wrong) = (0.0_f64, 0.0_f64);
        for number in 0..5000 {
            let z = 1.0 - 2.0 * (f64::from(number) + 0.5) / 5000.0;
            let (sin, cos) = (golden * f64::from(number)).sin_cos();
            let way = ((1.0 - z * z).sqrt() * DVec2::new(cos, sin)).extend(z);
            worst = worst.max((table.at(way) - value(way)).abs());
            wrong = wrong.max((mirrored.at(way) - value(way)).abs());
        }
        for axis in [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z] {
            assert!((table.at(axis) - value(axis)).abs() < 1e-6, "{axis}");
        }
        assert!(worst < 2e-3 && wrong > 1.0, "{worst:.1e}, {wrong}");
    }
}
