//! Albedo tables of a scene for every Sun zenith angle and distance, interpolated between tables that are built when first needed.
//!
//! On a trajectory the distance changes. Tables then stand at altitudes 15 % apart, and a step interpolates cubically between four of them.

use std::f64::consts::FRAC_PI_2;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::albedo::{AlbedoTable, RESOLUTION, grid_direction, reached_columns};
use super::albedo_series::{AT_ONCE, AlbedoSeries};
use super::sky::horizon_angle;

/// Albedo tables over the Sun's zenith angle below the craft, for one distance.
///
/// While everything that the craft sees is lit, the albedo is a cosine plus a sine of the zenith angle, and two tables give it exactly. While the
/// terminator crosses the visible cap, a cubic interpolates between the four nearest tables. Near the terminator the albedo changes over an angle of about
/// altitude / radius. The tables are therefore dense there: they stand at 90 deg + s sinh(k u), with u equally spaced.
#[derive(Debug, Clone, PartialEq)]
pub struct AlbedoField {
    /// Distance to the planet's centre over its radius.
    distance_ratio: f64,
    /// Angle at the planet's centre between the horizon and the point below the craft [rad].
    horizon: f64,
    /// The width s of the spacing above [rad].
    spread: f64,
    /// The table for the Sun in the zenith.
    noon: OnceLock<AlbedoTable>,
    /// `CROSSING_INTERVALS + 1` tables while the terminator crosses the visible cap from one side to the other.
    crossing: Vec<OnceLock<AlbedoTable>>,
    /// Fields from which its tables are interpolated. `None` where it integrates its own.
    between: Option<Arc<AlbedoFields>>,
}

/// Intervals of the zenith angle while the terminator crosses the visible cap.
pub(crate) const CROSSING_INTERVALS: usize = 24;

impl AlbedoField {
    /// The field for a distance to the planet's centre over its radius, > 1.
    pub fn new(distance_ratio: f64) -> Self {
        let horizon = horizon_angle(distance_ratio);
        let spread = spread(distance_ratio, horizon);
        let crossing = vec![OnceLock::new(); CROSSING_INTERVALS + 1];
        Self { distance_ratio, horizon, spread, noon: OnceLock::new(), crossing, between: None }
    }

    /// The field for a distance, with tables that are interpolated between fields of other distances. A step then blends a few tables of one distance.
    pub(super) fn between(fields: &Arc<AlbedoFields>, distance_ratio: f64) -> Self {
        let between = AlbedoFields::holds(distance_ratio).then(|| Arc::clone(fields));
        Self { between, ..Self::new(distance_ratio) }
    }

    /// Whether both fields are of one distance.
    pub(super) fn is_as_far_as(&self, other: &Self) -> bool {
        self.distance_ratio == other.distance_ratio
    }

    fn noon(&self) -> &AlbedoTable {
        self.noon.get_or_init(|| match &self.between {
            Some(fields) => fields.interpolate(self.distance_ratio, Self::noon),
            None => tabulate(self.distance_ratio, 0.0),
        })
    }

    fn crossing(&self, level: usize) -> &AlbedoTable {
        self.crossing[level].get_or_init(|| {
            if let Some(fields) = &self.between {
                return fields.interpolate(self.distance_ratio, |field| field.crossing(level));
            }
            let reach = (self.horizon / self.spread).asinh();
            let u = 2.0 * level as f64 / CROSSING_INTERVALS as f64 - 1.0;
            tabulate(self.distance_ratio, FRAC_PI_2 + self.spread * (reach * u).sinh())
        })
    }

    /// The table for a zenith angle of the Sun [rad], in [0, pi]. `None` where everything that the craft sees is dark.
    pub fn table(&self, sun_zenith: f64) -> Option<AlbedoTable> {
        let (tables, weights) = self.terms(shares(self.horizon, self.spread, sun_zenith)?, sun_zenith);
        Some(blend(&tables, &weights))
    }

    /// The tables, and the weight of each, whose weighted sum is the table of a zenith angle.
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

/// How the table of a zenith angle is interpolated.
#[derive(Debug, Clone, Copy)]
enum Shares {
    /// Everything that the craft sees is lit: from the noon table and the first crossing table.
    AllLit,
    /// From four crossing tables.
    Crossing { first: usize, weights: [f64; 4] },
}

/// `None` in the dark. `horizon` and `spread` are fields of [`AlbedoField`].
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

/// Weights with which a cubic through its values at 0, 1, 2 and 3 gives its value at `t`.
fn cubic(t: f64) -> [f64; 4] {
    [
        -(t - 1.0) * (t - 2.0) * (t - 3.0) / 6.0,
        t * (t - 2.0) * (t - 3.0) / 2.0,
        -t * (t - 1.0) * (t - 3.0) / 2.0,
        t * (t - 1.0) * (t - 2.0) / 6.0,
    ]
}

/// Albedo fields of many distances, each built when first needed, for an orbit that is not circular and for the many orbits of a data set.
///
/// The altitudes of the fields rise by the factor [`RATIO`]. A cubic interpolates between the four nearest fields, each read with the
/// terminator at the same place of the visible cap.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AlbedoFields {
    fields: Vec<OnceLock<Arc<AlbedoField>>>,
}

/// Altitude of a field over the altitude of the field below it.
pub(crate) const RATIO: f64 = 1.15;

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
    /// The table for a distance ratio and a zenith angle of the Sun [rad]. `None` where everything that the craft sees is dark.
    ///
    /// Outside the altitudes of the fields it computes a table for this distance and angle alone, which is slow.
    pub(crate) fn table(&self, distance_ratio: f64, sun_zenith: f64) -> Option<AlbedoTable> {
        let horizon = horizon_angle(distance_ratio);
        let shares = shares(horizon, spread(distance_ratio, horizon), sun_zenith)?;
        if !Self::holds(distance_ratio) {
            return Some(tabulate(distance_ratio, sun_zenith));
        }
        let (mut tables, mut weights) = (Vec::new(), Vec::new());
        for (field, share) in self.around(distance_ratio) {
            let (more, shares) = field.terms(shares, sun_zenith);
            tables.extend(more);
            weights.extend(shares.into_iter().map(|weight| weight * share));
        }
        Some(blend(&tables, &weights))
    }

    /// A table for a distance ratio between the tables that `table` takes from the nearest fields.
    fn interpolate(&self, distance_ratio: f64, table: impl Fn(&AlbedoField) -> &AlbedoTable) -> AlbedoTable {
        let (tables, weights): (Vec<_>, Vec<_>) =
            self.around(distance_ratio).into_iter().map(|(field, weight)| (table(field), weight)).unzip();
        blend(&tables, &weights)
    }

    /// Whether a distance ratio lies within the altitudes of the fields.
    fn holds(distance_ratio: f64) -> bool {
        (LOWEST..=HIGHEST).contains(&(distance_ratio - 1.0))
    }

    /// The four nearest fields to a distance ratio, each with its weight.
    fn around(&self, distance_ratio: f64) -> [(&AlbedoField, f64); 4] {
        let position = ((distance_ratio - 1.0) / LOWEST).ln() / RATIO.ln();
        let first = (position as usize).clamp(1, self.fields.len() - 3) - 1;
        let weights = cubic(position - first as f64);
        [0, 1, 2, 3].map(|offset| (self.field(first + offset), weights[offset]))
    }

    fn field(&self, index: usize) -> &AlbedoField {
        let altitude = LOWEST * RATIO.powi(index as i32);
        self.fields[index].get_or_init(|| Arc::new(AlbedoField::new(1.0 + altitude)))
    }
}

fn spread(distance_ratio: f64, horizon: f64) -> f64 {
    (distance_ratio - 1.0).min(horizon)
}

/// The table for one zenith angle of the Sun.
fn tabulate(distance_ratio: f64, sun_zenith: f64) -> AlbedoTable {
    let series = AlbedoSeries::new(distance_ratio, sun_zenith);
    let side = RESOLUTION + 1;
    let point = |index: usize| Some((index, grid_direction(index % side, index / side)?));
    let points: Vec<(usize, DVec3)> = (0..side * side).filter_map(point).collect();
    let mut values = vec![0.0; side * side];
    for some in points.chunks(AT_ONCE) {
        let mut normals = [DVec3::Z; AT_ONCE];
        normals.iter_mut().zip(some).for_each(|(normal, (_, v))| *normal = *v / v.length());
        for (factor, (index, v)) in series.factors(&normals).into_iter().zip(some) {
            values[*index] = v.length() * factor;
        }
    }
    AlbedoTable { values }
}

/// Weighted sum of tables. A cubic can fall below 0 by its own error. Such values become 0, because a negative flux has no balance temperature.
fn blend(tables: &[&AlbedoTable], weights: &[f64]) -> AlbedoTable {
    let side = RESOLUTION + 1;
    let mut values = vec![0.0; side * side];
    for (row, sums) in values.chunks_exact_mut(side).enumerate() {
        // Half of the grid stays 0.
        let reached = reached_columns(row);
        let sums = &mut sums[reached.clone()];
        // Table after table: the compiler makes vectors of this loop.
        for (table, weight) in tables.iter().zip(weights) {
            let values = &table.values[row * side..][reached.clone()];
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value * weight);
        }
        sums.iter_mut().for_each(|sum| *sum = sum.max(0.0));
    }
    AlbedoTable { values }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DVec3;
    use rayon::prelude::*;

    use super::super::albedo::{albedo_factor, albedo_table_lookup};
    use super::*;

    /// Unit normals on a spiral, evenly spread.
    fn normals(count: u32, turn: f64) -> impl ParallelIterator<Item = DVec3> {
        (0..count).into_par_iter().map(move |index| {
            let z = (2.0 * f64::from(index) + 1.0) / f64::from(count) - 1.0;
            let across = (1.0 - z * z).sqrt();
            let angle = f64::from(index) * PI * (3.0 - 5.0_f64.sqrt()) + turn;
            DVec3::new(across * angle.cos(), across * angle.sin(), z)
        })
    }

    /// Largest error over directions of a field's table at a zenith angle, against the integral.
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
        let fields = Arc::new(AlbedoFields::default());
        for (altitude, circular) in
            [130.0, 419.0, 8000.0].into_iter().flat_map(|altitude| [(altitude, false), (altitude, true)])
        {
            let ratio = 1.0 + altitude / 6371.0;
            let dark = FRAC_PI_2 + horizon_angle(ratio);
            let at = |ratio: f64, sun_zenith: f64| match circular {
                true => AlbedoField::between(&fields, ratio).table(sun_zenith),
                false => fields.table(ratio, sun_zenith),
            };
            let error = |sun_zenith: f64, ratio: f64, read: f64| {
                let table = at(read, sun_zenith).expect("some of the cap is lit");
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
            assert!(at(ratio, dark + 1e-12).is_none());
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
            let (computed, exact) = (albedo_table_lookup(&table, direction), albedo_factor(direction, ratio, 1.2));
            assert!((computed - exact).abs() < 1e-4, "{direction}: {computed} against {exact}");
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
