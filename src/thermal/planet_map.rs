//! A planet that is not uniform: its temperatures over latitude and longitude, and their means over the part that a surface sees (docs/numerics.md
//! 5a).

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::environment::view_factor::ApparentRadius;

/// Values over latitude and longitude in equal steps. The first row lies at the pole +Z, and the first column begins at the longitude -180 deg. Longitude 0 is +X
/// and 90 deg is +Y. Between the centres of four cells a value is bilinear. A pole has the mean of the row beside it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Equirectangular {
    /// Cells of a row, at least 1.
    pub(crate) columns: usize,
    /// Rows, at least 2.
    pub(crate) rows: usize,
    /// The values: the pole +Z for each column, then row after row, and the other pole for each column.
    pub(crate) values: Vec<f32>,
}

impl Equirectangular {
    /// A map of the values of its cells, row after row.
    pub(crate) fn new(columns: usize, rows: usize, cells: &[f32]) -> Self {
        let pole = |row: &[f32]| {
            let mean = row.iter().map(|value| f64::from(*value)).sum::<f64>() / columns as f64;
            vec![mean as f32; columns]
        };
        let poles = [pole(&cells[..columns]), pole(&cells[(rows - 1) * columns..])];
        Self { columns, rows, values: [&poles[0], cells, &poles[1]].concat() }
    }

    /// A map of this many columns and rows whose values follow from the direction of each cell's centre.
    pub(crate) fn of_directions([columns, rows]: [usize; 2], value: impl Fn(DVec3) -> f64 + Sync) -> Self {
        let of_cell = |cell: usize| value(centre_of(cell % columns, cell / columns, [columns, rows])) as f32;
        let cells: Vec<f32> = (0..columns * rows).into_par_iter().map(of_cell).collect();
        Self::new(columns, rows, &cells)
    }

    /// The values of the cells, row after row.
    pub(crate) fn cells(&self) -> &[f32] {
        &self.values[self.columns..(self.rows + 1) * self.columns]
    }

    /// Value in a direction, a unit vector.
    pub(crate) fn at(&self, direction: DVec3) -> f64 {
        let longitude = direction.y.atan2(direction.x);
        let polar = direction.truncate().length().atan2(direction.z);
        let column = (longitude / TAU + 0.5) * self.columns as f64 - 0.5;
        let (rows, down) = (self.rows as f64, polar / PI * self.rows as f64);
        // The poles lie half a row from the centres beside them.
        let row = (2.0 * down).min(down + 0.5).max(2.0 * down - rows + 1.0);
        let (left, top) = (column.floor(), row.floor().min(rows));
        let (u, v) = (column - left, row - top);
        let west = if left < 0.0 { self.columns - 1 } else { left as usize };
        let east = if west + 1 < self.columns { west + 1 } else { 0 };
        let of_row = |row: usize| {
            let value = |column: usize| f64::from(self.values[row * self.columns + column]);
            value(west) + u * (value(east) - value(west))
        };
        let (above, below) = (of_row(top as usize), of_row(top as usize + 1));
        above + v * (below - above)
    }

    /// Mean over the sphere.
    pub(crate) fn mean(&self) -> f64 {
        let weight = |row: usize| ((row as f64 + 0.5) / self.rows as f64 * PI).sin();
        let of_row =
            |row: usize| self.cells()[row * self.columns..][..self.columns].iter().map(|v| f64::from(*v)).sum::<f64>();
        let whole: f64 = (0..self.rows).map(weight).sum();
        (0..self.rows).map(|row| weight(row) * of_row(row)).sum::<f64>() / (whole * self.columns as f64)
    }
}

fn centre_of(column: usize, row: usize, [columns, rows]: [usize; 2]) -> DVec3 {
    let (sin, cos) = ((row as f64 + 0.5) / rows as f64 * PI).sin_cos();
    let (y, x) = (((column as f64 + 0.5) / columns as f64 - 0.5) * TAU).sin_cos();
    DVec3::new(sin * x, sin * y, cos)
}

/// How the axes of a planet's map turn in the inertial frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum MapAxes {
    /// +Z leads to the Sun.
    Sun,
    /// The axes of the Earth, on a trajectory.
    Earth,
    /// A planet with its own rotation.
    Turning {
        /// Direction of the pole, inertial frame.
        pole: DVec3,
        /// Longitude under the inertial +X at time 0 [rad].
        longitude: f64,
        /// Rate of its rotation [rad/s].
        rate: f64,
    },
}

/// Temperatures of a planet, or its albedos.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanetPattern {
    /// Brightness temperatures in the band [K], or shares of sunlight that are reflected.
    pub(crate) temperatures: Equirectangular,
    pub(crate) axes: MapAxes,
}

/// Law of the temperature between day and night.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DayLaw {
    /// One temperature on the side of the Sun and one on the other. Between them lies the width of the Sun, half a degree.
    Step,
    /// T^4 = night^4 + (day^4 - night^4) cos z, with the Sun's zenith angle z. At night T = night.
    Cosine,
}

const DAY_ROWS: usize = 720;

impl PlanetPattern {
    /// A planet with these temperatures by day (below the Sun) and by night [K].
    pub fn day_night(day: f64, night: f64, law: DayLaw) -> Self {
        let of_row = |row: usize| {
            let height = ((row as f64 + 0.5) / DAY_ROWS as f64 * PI).cos();
            match law {
                DayLaw::Step if height > 0.0 => day,
                DayLaw::Step => night,
                DayLaw::Cosine => (night.powi(4) + (day.powi(4) - night.powi(4)) * height.max(0.0)).sqrt().sqrt(),
            }
        };
        let cells: Vec<f32> = (0..DAY_ROWS).map(|row| of_row(row) as f32).collect();
        Self { temperatures: Equirectangular::new(1, DAY_ROWS, &cells), axes: MapAxes::Sun }
    }
}

impl MapAxes {
    /// Rotates inertial vectors into the axes of the map at a time [s]. `sun` is the direction from the planet to the Sun, and `earth` rotates
    /// inertial vectors into the axes of the Earth.
    pub(crate) fn map_from_inertial(&self, time: f64, sun: DVec3, earth: impl Fn() -> DMat3) -> DMat3 {
        match *self {
            Self::Sun => {
                let across = sun.any_orthonormal_vector();
                DMat3::from_cols(across, sun.cross(across), sun).transpose()
            }
            Self::Earth => earth(),
            Self::Turning { pole, longitude, rate } => {
                let upright = DVec3::X.reject_from(pole).try_normalize();
                let x = upright
                    .filter(|_| pole.x.abs() < 1.0 - 1e-9)
                    .unwrap_or_else(|| DVec3::Y.reject_from(pole).normalize());
                DMat3::from_rotation_z(longitude - rate * time) * DMat3::from_cols(x, pole.cross(x), pole).transpose()
            }
        }
    }
}

/// Direction from the planet's centre to the point that is seen along a ray which meets the planet. `nadir` leads to the centre; both are unit vectors.
pub(crate) fn seen_point(direction: DVec3, nadir: DVec3, disc: ApparentRadius) -> DVec3 {
    let (along, across) = (direction.dot(nadir), direction.cross(nadir).length());
    let (inside, outside) = (along * disc.sin - across * disc.cos, along * disc.sin + across * disc.cos);
    // The angle at the point, against its vertical, and the angle at the planet's centre.
    let (sine, cosine) = ((across / disc.sin).min(1.0), (inside * outside).max(0.0).sqrt() / disc.sin);
    let sideways = (direction - along * nadir) / across.max(1e-20);
    (sine * along - cosine * across) * sideways - (cosine * along + sine * across) * nadir
}

/// Cells of the means of a planet over the direction of a surface.
pub(crate) const MEAN_COLUMNS: usize = 96;
pub(crate) const MEAN_ROWS: usize = 48;
pub(crate) const MEAN_VALUES: usize = MEAN_COLUMNS * (MEAN_ROWS + 2);

const DISC_POINTS: usize = 2048;

/// The radiances that surfaces see of a planet that is not uniform, over the radiance of the planet's own temperature.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SeenPlanet {
    pub(crate) map: Arc<Equirectangular>,
    /// Mean over the part of the disc that a surface sees: of a diffuse one over its normal, then of rough mirrors over the mirror direction. All are
    /// in the axes of the map.
    pub(crate) means: Vec<Equirectangular>,
}

impl SeenPlanet {
    /// The means of a planet whose centre is in the direction `nadir` of its map's axes, for mirrors of these roughnesses.
    pub(crate) fn new(map: &Arc<Equirectangular>, nadir: DVec3, disc: ApparentRadius, roughnesses: &[f64]) -> Self {
        let points = disc
            .directions(nadir, DISC_POINTS)
            .map(|direction| (direction, map.at(seen_point(direction, nadir, disc))));
        let points: Vec<(DVec3, f64)> = points.collect();
        let plain = points.iter().map(|(_, value)| value).sum::<f64>() / points.len() as f64;
        let over = |weight: &(dyn Fn(f64) -> f64 + Sync)| {
            let mean = |cell: usize| {
                let direction = centre_of(cell % MEAN_COLUMNS, cell / MEAN_COLUMNS, [MEAN_COLUMNS, MEAN_ROWS]);
                let add = |(sum, whole): (f64, f64), (point, value): &(DVec3, f64)| {
                    let weight = weight(direction.dot(*point));
                    (sum + weight * value, whole + weight)
                };
                let (sum, whole) = points.iter().fold((0.0, 0.0), add);
                (if whole > 0.0 { sum / whole } else { plain }) as f32
            };
            let cells: Vec<f32> = (0..MEAN_COLUMNS * MEAN_ROWS).into_par_iter().map(mean).collect();
            Equirectangular::new(MEAN_COLUMNS, MEAN_ROWS, &cells)
        };
        let mut means = vec![over(&|cosine: f64| cosine.max(0.0))];
        means.extend(roughnesses.iter().map(|roughness| {
            let flat = 1.0 - roughness * roughness;
            // Facets between a straight view and the light (GGX).
            over(&move |cosine: f64| (1.0 - 0.5 * (1.0 + cosine) * flat).powi(-2))
        }));
        Self { map: Arc::clone(map), means }
    }
}

/// Angle by which the planet's centre may move in its map before the means are made anew [rad].
pub(crate) const MEANS_ANGLE: f64 = 0.1 * PI / 180.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::lobe::{Lobe, PlanetPlace};

    /// A smooth pattern: 1 + 0.3 z + 0.2 x y.
    fn pattern(point: DVec3) -> f64 {
        1.0 + 0.3 * point.z + 0.4 * point.x * point.y
    }

    fn map(rows: usize) -> Arc<Equirectangular> {
        let cell = |cell: usize| pattern(centre_of(cell % (2 * rows), cell / (2 * rows), [2 * rows, rows])) as f32;
        let map = Equirectangular::new(2 * rows, rows, &(0..2 * rows * rows).map(cell).collect::<Vec<_>>());
        Arc::new(map)
    }

    fn directions(count: usize) -> impl Iterator<Item = DVec3> {
        (0..count).map(move |number| {
            let (z, azimuth) = (1.0 - (2.0 * number as f64 + 1.0) / count as f64, 2.4 * number as f64);
            DVec3::new((1.0 - z * z).sqrt() * azimuth.cos(), (1.0 - z * z).sqrt() * azimuth.sin(), z)
        })
    }

    #[test]
    fn a_map_is_read_where_its_cells_are() {
        let map = map(90);
        for row in [0, 7, 89] {
            for column in [0, 3, 179] {
                let computed = map.at(centre_of(column, row, [180, 90]));
                assert!((computed - f64::from(map.cells()[row * 180 + column])).abs() < 1e-6);
            }
        }
        let beside = [DVec3::new(1e-9, 0.0, 1.0), DVec3::new(-1e-9, 1e-9, 1.0)].map(|pole| map.at(pole));
        assert!((beside[0] - beside[1]).abs() < 1e-6 && (beside[0] - pattern(DVec3::Z)).abs() < 1e-3, "{beside:?}");
        let worst = directions(500).map(|direction| (map.at(direction) - pattern(direction)).abs()).fold(0.0, f64::max);
        assert!(worst < 6e-3, "{worst}");
        assert!((map.mean() - 1.0).abs() < 1e-3);
    }

    #[test]
    fn the_point_that_is_seen_lies_on_ray_and_sphere() {
        for ratio in [1.001, 1.064, 6.6, 60.0] {
            let disc = ApparentRadius::new(ratio);
            let nadir = DVec3::new(0.36, -0.48, 0.8);
            for direction in disc.directions(nadir, 300) {
                let point = seen_point(direction, nadir, disc);
                assert!((point.length() - 1.0).abs() < 1e-9);
                // From the craft at -ratio x nadir to the point.
                let way = point + ratio * nadir;
                assert!(way.normalize().distance(direction) < 1e-9 && point.dot(direction) <= 1e-9, "the near side");
            }
        }
    }

    /// Against sums over many points of the disc.
    #[test]
    fn means_are_those_of_the_disc() {
        let map = map(180);
        for (ratio, roughness) in [(1.064, 0.05), (1.064, 0.3), (1.064, 1.0), (6.6, 0.3)] {
            let disc = ApparentRadius::new(ratio);
            let nadir = DVec3::new(0.36, -0.48, 0.8);
            let seen = SeenPlanet::new(&map, nadir, disc, &[roughness]);
            let points: Vec<DVec3> = disc.directions(nadir, 20_000).collect();
            let lobe = Lobe::new(roughness, disc);
            let (mut diffuse_off, mut rough_off, mut uniform_off) = (0.0_f64, 0.0_f64, 0.0_f64);
            for direction in directions(60).filter(|direction| direction.dot(nadir) > -0.3 * disc.sin) {
                let mean = |weight: &dyn Fn(DVec3) -> f64| {
                    let whole: f64 = points.iter().map(|point| weight(*point)).sum();
                    let sum: f64 =
                        points.iter().map(|point| weight(*point) * map.at(seen_point(*point, nadir, disc))).sum();
                    sum / whole
                };
                let diffuse = mean(&|point| direction.dot(point).max(0.0));
                if diffuse.is_finite() {
                    diffuse_off = diffuse_off.max((seen.means[0].at(direction) - diffuse).abs());
                    uniform_off = uniform_off.max((1.0 - diffuse).abs());
                }
                // A mirror that is seen at 45 deg, by its exact lobe.
                let normal = (direction + direction.any_orthonormal_vector()).normalize();
                let view = normal.dot(direction);
                let camera = 2.0 * view * normal - direction;
                let share = lobe.share(PlanetPlace::new(normal, view, direction, nadir, disc));
                let exact = mean(&|point| {
                    let light = normal.dot(point);
                    lobe.glint(normal, camera, (point, 0.0)) * light.max(0.0)
                });
                if exact.is_finite() {
                    rough_off = rough_off.max(share * (seen.means[1].at(direction) - exact).abs());
                }
            }
            println!(
                "ratio {ratio}, roughness {roughness}: diffuse {diffuse_off:.1e}, rough {rough_off:.1e}, uniform {uniform_off:.1e}"
            );
            assert!(diffuse_off < 0.003 && rough_off < 0.005 && uniform_off > 0.02, "{diffuse_off}, {rough_off}");
        }
    }

    #[test]
    fn day_lies_on_the_side_of_the_sun() {
        let sun = DVec3::new(0.6, 0.0, -0.8);
        let step = PlanetPattern::day_night(300.0, 240.0, DayLaw::Step);
        let from_inertial = step.axes.map_from_inertial(7.0, sun, || DMat3::NAN);
        let at = |pattern: &PlanetPattern, direction: DVec3| pattern.temperatures.at(from_inertial * direction);
        let beside = sun.any_orthonormal_vector();
        assert_eq!((at(&step, sun), at(&step, -sun)), (300.0, 240.0));
        assert!((at(&step, beside) - 270.0).abs() < 1e-6, "the terminator lies between them");
        let cosine = PlanetPattern::day_night(300.0, 240.0, DayLaw::Cosine);
        let halfway = (0.5 * sun + 0.75_f64.sqrt() * beside).normalize();
        let expected = (240.0_f64.powi(4) + 0.5 * (300.0_f64.powi(4) - 240.0_f64.powi(4))).sqrt().sqrt();
        assert!((at(&cosine, halfway) - expected).abs() < 1e-3);
        assert!((at(&cosine, beside) - expected).abs() > 1.0);
    }

    #[test]
    fn a_planet_turns_to_the_east() {
        let day = 86_164.1;
        let axes = MapAxes::Turning { pole: DVec3::Z, longitude: 0.5, rate: TAU / day };
        let longitude = |time: f64| {
            let below = axes.map_from_inertial(time, DVec3::X, || DMat3::NAN) * DVec3::X;
            below.y.atan2(below.x)
        };
        assert!((longitude(0.0) - 0.5).abs() < 1e-12);
        assert!((longitude(day / 8.0) - (0.5 - PI / 4.0)).abs() < 1e-9, "what is below +X lies farther west");
        let tilted = MapAxes::Turning { pole: DVec3::X, longitude: 0.0, rate: 0.0 };
        let rotation = tilted.map_from_inertial(0.0, DVec3::X, || DMat3::NAN);
        assert!((rotation * DVec3::X - DVec3::Z).length() < 1e-12 && (rotation.determinant() - 1.0).abs() < 1e-12);
    }
}
