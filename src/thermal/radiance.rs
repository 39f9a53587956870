//! Band radiance from a table: the f64 twin of the fragment shader (docs/numerics.md 5).

use crate::thermal::passband::Passband;
use crate::thermal::planck::{Band, SECOND_RADIATION};

/// Intervals of the table over v in [0, 1].
pub(crate) const INTERVALS: usize = 1024;
/// Temperature at the middle of the table, where v = T / (T + 400 K) [K].
pub(crate) const MIDDLE_TEMPERATURE: f64 = 400.0;

/// Table of ln G of a band over v = T / (T + 400 K), with G = L e^x / T and x = c2 / (lambda_max T).
#[derive(Debug, Clone, PartialEq)]
pub struct RadianceTable {
    pub(crate) band: Band,
    /// c2 / lambda_max [K], so that x = `edge_temperature` / T.
    pub(crate) edge_temperature: f64,
    /// ln(G / (1 W m-2 sr-1 K-1)) at v = (i - 1) / `INTERVALS`. The first and last values lie outside [0, 1] and extend the cubic of the neighbouring
    /// interval to the end interval.
    pub(crate) values: Vec<f64>,
}

impl RadianceTable {
    /// Tabulates a band with 0 < lower < upper, with its response where it has one.
    pub fn new(passband: impl Into<Passband>) -> Self {
        let passband = passband.into();
        let band = passband.band;
        let inside = (1..INTERVALS).map(|i| {
            let v = i as f64 / INTERVALS as f64;
            passband.scaled_radiance(MIDDLE_TEMPERATURE * v / (1.0 - v)).ln()
        });
        let mut values = vec![0.0, passband.scaled_radiance_cold().ln()];
        values.extend(inside);
        values.extend([passband.scaled_radiance_hot().ln(), 0.0]);
        let last = values.len() - 1;
        if values[1] == f64::NEG_INFINITY {
            // A response that ends at 0 has the limit 0, which the cubic passes by below 1 K.
            values[1] = continue_cubic([values[2], values[3], values[4], values[5]]);
        }
        values[0] = continue_cubic([values[1], values[2], values[3], values[4]]);
        values[last] = continue_cubic([values[last - 1], values[last - 2], values[last - 3], values[last - 4]]);
        Self { band, edge_temperature: SECOND_RADIATION / band.upper, values }
    }

    /// ln G at a temperature [K] > 0, and its derivative [1/K].
    pub(crate) fn ln_scaled(&self, temperature: f64) -> (f64, f64) {
        let v = temperature / (temperature + MIDDLE_TEMPERATURE);
        let place = v * INTERVALS as f64;
        let cell = (place as usize).min(INTERVALS - 1);
        let f: [f64; 4] = std::array::from_fn(|i| self.values[cell + i]);
        let (value, slope) = cubic(f, place - cell as f64);
        let slope_in_v = slope * INTERVALS as f64;
        (value, slope_in_v * v * v * MIDDLE_TEMPERATURE / (temperature * temperature))
    }
}

/// Radiance of a blackbody in the table's band [W m-2 sr-1], 0 at 0 K and where f64 underflows.
pub fn band_radiance(table: &RadianceTable, temperature: f64) -> f64 {
    if temperature <= 0.0 {
        return 0.0;
    }
    let (ln_scaled, _) = table.ln_scaled(temperature);
    temperature * (ln_scaled - table.edge_temperature / temperature).exp()
}

/// Lagrange's cubic through values at -1, 0, 1, 2, and its derivative, at `t` in [0, 1].
fn cubic(f: [f64; 4], t: f64) -> (f64, f64) {
    // Coefficients of powers of t from differences of neighbours, so that little cancels.
    let c3 = (f[3] - f[0]) / 6.0 + 0.5 * (f[1] - f[2]);
    let c2 = 0.5 * ((f[0] - f[1]) + (f[2] - f[1]));
    let c1 = (f[2] - f[1]) - c2 - c3;
    (f[1] + t * (c1 + t * (c2 + t * c3)), c1 + t * (2.0 * c2 + 3.0 * t * c3))
}

/// The value one interval before f[0] on the cubic through f.
fn continue_cubic(f: [f64; 4]) -> f64 {
    4.0 * f[0] - 6.0 * f[1] + 4.0 * f[2] - f[3]
}

#[cfg(test)]
pub(super) mod tests;
