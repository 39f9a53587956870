//! Albedo for every Sun zenith angle of a scene: tables at chosen angles, built once, and one blended for a tick.

use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;

use super::albedo::{AlbedoTable, RESOLUTION, albedo_factor, grid_direction};
use super::sky::{dark_zenith, horizon_angle};

/// Tables over the Sun's zenith angle below the craft, for one distance.
///
/// While all that the craft sees is lit, the albedo is a sum of a sine and a cosine of the zenith angle: two tables give
/// it without error. From there to the dark, where the terminator crosses the visible cap, tables stand at equal steps and
/// a cubic through the four nearest gives what lies between.
#[derive(Debug, Clone, PartialEq)]
pub struct AlbedoField {
    /// Zenith angle from which on the terminator is in sight [rad].
    terminator_in_sight: f64,
    /// Zenith angle from which on all is dark [rad].
    dark: f64,
    /// Sun in the zenith.
    noon: AlbedoTable,
    /// `CROSSING_INTERVALS + 1` tables from `terminator_in_sight` to `dark`.
    crossing: Vec<AlbedoTable>,
}

/// Steps of the zenith angle while the terminator crosses the visible cap.
pub const CROSSING_INTERVALS: usize = 20;

impl AlbedoField {
    /// The field for a distance to the planet's centre over its radius, > 1. Some 2e5 integrals, on all cores.
    pub fn new(distance_ratio: f64) -> Self {
        let terminator_in_sight = FRAC_PI_2 - horizon_angle(distance_ratio);
        let dark = dark_zenith(distance_ratio);
        let step = (dark - terminator_in_sight) / CROSSING_INTERVALS as f64;
        Self {
            terminator_in_sight,
            dark,
            noon: tabulate(distance_ratio, 0.0),
            crossing: (0..=CROSSING_INTERVALS)
                .map(|level| tabulate(distance_ratio, terminator_in_sight + step * level as f64))
                .collect(),
        }
    }

    /// The table for a zenith angle of the Sun [rad], in [0, pi]; `None` where all that the craft sees is dark.
    pub fn table(&self, sun_zenith: f64) -> Option<AlbedoTable> {
        if sun_zenith >= self.dark {
            return None;
        }
        if sun_zenith <= self.terminator_in_sight {
            let scale = self.terminator_in_sight.sin().recip();
            let noon = (self.terminator_in_sight - sun_zenith).sin() * scale;
            return Some(blend(&[
                (&self.noon, noon),
                (&self.crossing[0], sun_zenith.sin() * scale),
            ]));
        }
        let crossed =
            (sun_zenith - self.terminator_in_sight) / (self.dark - self.terminator_in_sight);
        let position = crossed * CROSSING_INTERVALS as f64;
        let first = (position as usize).clamp(1, CROSSING_INTERVALS - 2) - 1;
        let t = position - first as f64;
        let weights = [
            -(t - 1.0) * (t - 2.0) * (t - 3.0) / 6.0,
            t * (t - 2.0) * (t - 3.0) / 2.0,
            -t * (t - 1.0) * (t - 3.0) / 2.0,
            t * (t - 1.0) * (t - 2.0) / 6.0,
        ];
        let mut terms = self.crossing[first..first + 4].iter().zip(weights);
        Some(blend(
            &[(); 4].map(|()| terms.next().unwrap_or((&self.noon, 0.0))),
        ))
    }
}

/// The table of exact values for one zenith angle of the Sun.
fn tabulate(distance_ratio: f64, sun_zenith: f64) -> AlbedoTable {
    let side = RESOLUTION + 1;
    let value = |index: usize| {
        grid_direction(index % side, index / side).map_or(0.0, |direction| {
            let length = direction.length();
            length * albedo_factor(direction / length, distance_ratio, sun_zenith)
        })
    };
    AlbedoTable {
        values: (0..side * side).into_par_iter().map(value).collect(),
    }
}

/// Weighted sum of tables. A cubic can dip below 0 by its own error where the truth is 0; a negative flux would have no
/// balance temperature, so 0 is taken there.
fn blend(terms: &[(&AlbedoTable, f64)]) -> AlbedoTable {
    let values = (0..(RESOLUTION + 1) * (RESOLUTION + 1))
        .map(|index| {
            terms
                .iter()
                .map(|(table, weight)| table.values[index] * weight)
                .sum::<f64>()
                .max(0.0)
        })
        .collect();
    AlbedoTable { values }
}
