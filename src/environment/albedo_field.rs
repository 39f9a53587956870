//! Albedo for every Sun zenith angle of a scene: tables at chosen angles, each built when first needed, and one blended from them.
//!
//! On a trajectory the distance changes. Fields then stand at altitudes 15 % apart, built when they are first needed, and a step's table is a
//! cubic between four of them.

use std::f64::consts::FRAC_PI_2;
use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::albedo::{AlbedoTable, RESOLUTION, albedo_factor, grid_direction};
use super::sky::horizon_angle;

/// Tables over the Sun's zenith angle below the craft, for one distance.
///
/// While all that the craft sees is lit, the albedo is a sum of a sine and a cosine of the zenith angle: two tables
/// give it without error. From there to the dark, where the terminator crosses the visible cap, a cubic through the
/// four nearest tables gives what lies between. Those tables stand close where the terminator passes below the craft,
/// for there the albedo changes over an angle of the order of altitude / radius: at 90 deg + s sinh(k u), u in equal
/// steps.
#[derive(Debug, Clone, PartialEq)]
pub struct AlbedoField {
    /// Distance to the planet's centre over its radius.
    distance_ratio: f64,
    /// Angle of the horizon from the point below the craft, at the planet's centre [rad].
    horizon: f64,
    /// s above [rad].
    spread: f64,
    /// Sun in the zenith.
    noon: OnceLock<AlbedoTable>,
    /// `CROSSING_INTERVALS + 1` tables, from the terminator at one side of the cap to the terminator at the other.
    crossing: Vec<OnceLock<AlbedoTable>>,
}

/// Steps of the zenith angle while the terminator crosses the visible cap.
pub const CROSSING_INTERVALS: usize = 24;

impl AlbedoField {
    /// The field for a distance to the planet's centre over its radius, > 1.
    pub fn new(distance_ratio: f64) -> Self {
        let horizon = horizon_angle(distance_ratio);
        let spread = spread(distance_ratio, horizon);
        let crossing = vec![OnceLock::new(); CROSSING_INTERVALS + 1];
        Self { distance_ratio, horizon, spread, noon: OnceLock::new(), crossing }
    }

    /// The table with the Sun in the zenith.
    fn noon(&self) -> &AlbedoTable {
        self.noon.get_or_init(|| tabulate(self.distance_ratio, 0.0))
    }

    /// One of the tables while the terminator crosses the visible cap.
    fn crossing(&self, level: usize) -> &AlbedoTable {
        self.crossing[level].get_or_init(|| {
            let reach = (self.horizon / self.spread).asinh();
            let u = 2.0 * level as f64 / CROSSING_INTERVALS as f64 - 1.0;
            tabulate(self.distance_ratio, FRAC_PI_2 + self.spread * (reach * u).sinh())
        })
    }

    /// The table for a zenith angle of the Sun [rad], in [0, pi]; `None` where all that the craft sees is dark.
    pub fn table(&self, sun_zenith: f64) -> Option<AlbedoTable> {
        let (tables, weights) = self.terms(shares(self.horizon, self.spread, sun_zenith)?, sun_zenith);
        Some(blend(&tables, &weights))
    }

    /// The tables of which one for a zenith angle is the weighted sum.
    fn terms(&self, shares: Shares, sun_zenith: f64) -> (Vec<&AlbedoTable>, Vec<f64>) {
        match shares {
            Shares::AllLit => {
                let scale = self.horizon.cos().recip();
                let noon = (FRAC_PI_2 - sun_zenith - self.horizon).sin() * scale;
                (vec![self.noon(), self.crossing(0)], vec![noon, sun_zenith.sin() * scale])
            }
            Shares::Crossing { first, weights } => {
                ((0..4).map(|offset| self.crossing(first + offset)).collect(), weights.to_vec())
            }
        }
    }
}

/// How the table of a zenith angle is put together.
#[derive(Debug, Clone, Copy)]
enum Shares {
    /// From the noon and the first crossing table: all that the craft sees is lit.
    AllLit,
    /// From four crossing tables.
    Crossing { first: usize, weights: [f64; 4] },
}

/// `None` in the dark. `horizon` and `spread` as in [`AlbedoField`].
fn shares(horizon: f64, spread: f64, sun_zenith: f64) -> Option<Shares> {
    let past_crossing = sun_zenith - FRAC_PI_2;
    if past_crossing >= horizon {
        return None;
    }
    if past_crossing <= -horizon {
        return Some(Shares::AllLit);
    }
    let u = (past_crossing / spread).asinh() / (horizon / spread).asinh();
    let position = 0.5 * (u + 1.0) * CROSSING_INTERVALS as f64;
    let first = (position as usize).clamp(1, CROSSING_INTERVALS - 2) - 1;
    Some(Shares::Crossing { first, weights: cubic(position - first as f64) })
}

/// Weights of the values at 0, 1, 2, 3 of a cubic's value at `t`.
fn cubic(t: f64) -> [f64; 4] {
    [
        -(t - 1.0) * (t - 2.0) * (t - 3.0) / 6.0,
        t * (t - 2.0) * (t - 3.0) / 2.0,
        -t * (t - 1.0) * (t - 3.0) / 2.0,
        t * (t - 1.0) * (t - 2.0) / 6.0,
    ]
}

/// Fields of many distances, each built when it is first needed: the albedo along an orbit that is not circular.
///
/// They stand at altitudes in equal ratios ([`RATIO`]); a cubic through the four nearest, at the same place of the
/// terminator in the visible cap, gives what lies between.
#[derive(Debug, Clone, PartialEq)]
pub struct AlbedoFields {
    fields: Vec<OnceLock<Arc<AlbedoField>>>,
}

/// Altitude of one field over that of the one below.
pub const RATIO: f64 = 1.15;

/// Lowest and highest altitude over the planet's radius: 64 m and 6.4e9 km over Earth.
const LOWEST: f64 = 1e-5;
const HIGHEST: f64 = 1e6;

impl Default for AlbedoFields {
    fn default() -> Self {
        let count = ((HIGHEST / LOWEST).ln() / RATIO.ln()).ceil() as usize + 1;
        Self { fields: vec![OnceLock::new(); count] }
    }
}

impl AlbedoFields {
    /// The table for a distance to the planet's centre over its radius and a zenith angle of the Sun [rad]; `None`
    /// where all that the craft sees is dark.
    ///
    /// Beyond the altitudes that the fields stand for, the table of exact values is made, which takes long.
    pub fn table(&self, distance_ratio: f64, sun_zenith: f64) -> Option<AlbedoTable> {
        let horizon = horizon_angle(distance_ratio);
        let shares = shares(horizon, spread(distance_ratio, horizon), sun_zenith)?;
        let altitude = distance_ratio - 1.0;
        if !(LOWEST..=HIGHEST).contains(&altitude) {
            return Some(tabulate(distance_ratio, sun_zenith));
        }
        let position = (altitude / LOWEST).ln() / RATIO.ln();
        let first = (position as usize).clamp(1, self.fields.len() - 3) - 1;
        let (mut tables, mut weights) = (Vec::new(), Vec::new());
        for (offset, share) in cubic(position - first as f64).into_iter().enumerate() {
            let (more, shares) = self.field(first + offset).terms(shares, sun_zenith);
            tables.extend(more);
            weights.extend(shares.into_iter().map(|weight| weight * share));
        }
        Some(blend(&tables, &weights))
    }

    fn field(&self, index: usize) -> &AlbedoField {
        let altitude = LOWEST * RATIO.powi(index as i32);
        self.fields[index].get_or_init(|| Arc::new(AlbedoField::new(1.0 + altitude)))
    }
}

/// The width s of the terminator's crossing in [`AlbedoField`].
fn spread(distance_ratio: f64, horizon: f64) -> f64 {
    (distance_ratio - 1.0).min(horizon)
}

/// The table of exact values for one zenith angle of the Sun: some 8,000 integrals, on all cores.
fn tabulate(distance_ratio: f64, sun_zenith: f64) -> AlbedoTable {
    let side = RESOLUTION + 1;
    let value = |index: usize| {
        grid_direction(index % side, index / side).map_or(0.0, |direction| {
            let length = direction.length();
            length * albedo_factor(direction / length, distance_ratio, sun_zenith)
        })
    };
    AlbedoTable { values: (0..side * side).into_par_iter().map(value).collect() }
}

/// Weighted sum of tables. A cubic can dip below 0 by its own error where the truth is 0; a negative flux would have no
/// balance temperature, so 0 is taken there.
fn blend(tables: &[&AlbedoTable], weights: &[f64]) -> AlbedoTable {
    let sum =
        |index: usize| tables.iter().zip(weights).map(|(table, weight)| table.values[index] * weight).sum::<f64>();
    AlbedoTable { values: (0..tables[0].values.len()).map(|index| sum(index).max(0.0)).collect() }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DVec3;

    use super::super::albedo::albedo_table_lookup;
    use super::*;

    /// Unit normals spread evenly (a spiral).
    fn normals(count: u32, turn: f64) -> impl ParallelIterator<Item = DVec3> {
        (0..count).into_par_iter().map(move |index| {
            let z = (2.0 * f64::from(index) + 1.0) / f64::from(count) - 1.0;
            let across = (1.0 - z * z).sqrt();
            let angle = f64::from(index) * PI * (3.0 - 5.0_f64.sqrt()) + turn;
            DVec3::new(across * angle.cos(), across * angle.sin(), z)
        })
    }

    /// Largest error over directions of the table that a field gives for a zenith angle, read against the integral.
    fn error(field: &AlbedoField, distance_ratio: f64, sun_zenith: f64) -> f64 {
        let table = field.table(sun_zenith).expect("some of the cap is lit");
        normals(400, sun_zenith)
            .map(|normal| {
                let exact = albedo_factor(normal, distance_ratio, sun_zenith);
                (albedo_table_lookup(&table, normal) - exact).abs()
            })
            .reduce(|| 0.0, f64::max)
    }

    #[test]
    fn tables_agree_with_the_integral_from_low_orbit_to_geostationary() {
        for altitude in [100.0, 408.0, 772.0, 20_000.0, 35_786.0] {
            let ratio = 1.0 + altitude / 6371.0;
            let field = AlbedoField::new(ratio);
            let dark = FRAC_PI_2 + horizon_angle(ratio);
            let sample = |index: u32| dark * (f64::from(index) + 0.37) / 40.0;
            let worst = (0..40).map(|index| error(&field, ratio, sample(index))).fold(0.0, f64::max);
            println!("{altitude} km: largest error of the albedo table {worst:.1e}");
            assert!(worst < 1e-4, "{altitude} km: {worst:e}");
            assert!(field.table(dark + 1e-12).is_none() && field.table(PI).is_none());
            assert!(field.table(dark - 1e-6).is_some_and(|table| table.values.iter().all(|&value| value >= 0.0)));
        }
    }

    #[test]
    fn fields_of_many_distances_give_those_between() {
        let fields = AlbedoFields::default();
        for altitude in [130.0, 419.0, 8000.0] {
            let ratio = 1.0 + altitude / 6371.0;
            let dark = FRAC_PI_2 + horizon_angle(ratio);
            let error = |sun_zenith: f64, ratio: f64, read: f64| {
                let table = fields.table(read, sun_zenith).expect("some of the cap is lit");
                normals(400, sun_zenith)
                    .map(|normal| {
                        let exact = albedo_factor(normal, ratio, sun_zenith);
                        (albedo_table_lookup(&table, normal) - exact).abs()
                    })
                    .reduce(|| 0.0, f64::max)
            };
            let zenith = |index: u32| dark * (f64::from(index) + 0.37) / 20.0;
            let worst = (0..20).map(|index| error(zenith(index), ratio, ratio)).fold(0.0, f64::max);
            println!("{altitude} km: largest error of the albedo table between distances {worst:.1e}");
            assert!(worst < 1e-4, "{altitude} km: {worst:e}");
            assert!(error(0.5, ratio, 1.01 * ratio) > 1e-3, "another distance is seen");
            assert!(fields.table(ratio, dark + 1e-12).is_none());
        }
    }

    #[test]
    fn a_field_of_another_distance_or_a_zenith_off_by_a_degree_is_seen() {
        let ratio = 1.0 + 408.0 / 6371.0;
        assert!(error(&AlbedoField::new(1.0 + 400.0 / 6371.0), ratio, 0.5) > 1e-3);
        let field = AlbedoField::new(ratio);
        let table = field.table(1.0 + PI / 180.0).unwrap();
        assert!((albedo_table_lookup(&table, DVec3::Z) - albedo_factor(DVec3::Z, ratio, 1.0)).abs() > 5e-3);
    }

    #[test]
    fn corners_creases_and_the_equator_of_the_table_are_read() {
        let ratio = 1.0 + 408.0 / 6371.0;
        let table = AlbedoField::new(ratio).table(1.2).unwrap();
        let diagonal = 0.5_f64.sqrt();
        let directions = [
            DVec3::X,
            DVec3::NEG_X,
            DVec3::Y,
            DVec3::NEG_Y,
            DVec3::Z,
            DVec3::NEG_Z,
            DVec3::new(diagonal, 0.0, diagonal),
            DVec3::new(-diagonal, 0.0, diagonal),
            DVec3::new(0.0, diagonal, diagonal),
            DVec3::new(0.6, 0.0, -0.8),
        ];
        for direction in directions {
            let (found, exact) = (albedo_table_lookup(&table, direction), albedo_factor(direction, ratio, 1.2));
            assert!((found - exact).abs() < 1e-4, "{direction}: {found} against {exact}");
        }
    }

    #[test]
    fn a_field_close_to_the_ground_is_finite_and_right_at_noon() {
        let ratio = 1.0 + 1e-9;
        let field = AlbedoField::new(ratio);
        for sun_zenith in [0.0, 1.0, FRAC_PI_2 - 1e-5, FRAC_PI_2, FRAC_PI_2 + 1e-5] {
            let table = field.table(sun_zenith).unwrap();
            assert!(table.values.iter().all(|value| (0.0..=1.001).contains(value)), "{sun_zenith}");
        }
        // A wide flat ground under a high Sun: the plate's view of a half-space.
        let noon = field.table(0.0).unwrap();
        assert!((albedo_table_lookup(&noon, DVec3::Z) - 1.0).abs() < 1e-6);
        assert!((albedo_table_lookup(&noon, DVec3::Y) - 0.5).abs() < 1e-4);
    }
}
