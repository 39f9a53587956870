//! A band of wavelengths and how well each of them is seen.

use std::sync::Arc;

use super::planck::{
    BOLTZMANN, Band, LIGHT_SPEED, PLANCK, SECOND_RADIATION, scaled_radiance, scaled_radiance_cold, scaled_radiance_hot,
};
use crate::environment::quadrature::GaussLegendre;

/// A band with its relative response. Without a response all its wavelengths count alike.
#[derive(Debug, Clone, PartialEq)]
pub struct Passband {
    /// Its ends.
    pub(crate) band: Band,
    /// Rising wavelengths [m] and the response at each, linear in between, at most 1.
    response: Option<Arc<Vec<[f64; 2]>>>,
}

impl From<Band> for Passband {
    fn from(band: Band) -> Self {
        Self { band, response: None }
    }
}

/// A response curve that is none.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum ResponseFault {
    /// Fewer than two points.
    #[error("has {0} rows with numbers: a response needs at least two")]
    Short(usize),
    /// More points than are read.
    #[error("has {0} rows: a response has at most {MOST_POINTS}")]
    Long(usize),
    /// A wavelength that is not above the one before it.
    #[error("row {row}: wavelengths must rise, found {found} um after {before} um")]
    Unsorted {
        /// Row of numbers, from 1.
        row: usize,
        /// The wavelength [um].
        found: f64,
        /// The wavelength before it [um].
        before: f64,
    },
    /// A negative response.
    #[error("row {row}: a response must not be below 0, found {found}")]
    Negative {
        /// Row of numbers, from 1.
        row: usize,
        /// The response.
        found: f64,
    },
    /// A response of 0 everywhere.
    #[error("has a response of 0 at all wavelengths")]
    Dark,
}

/// Most points of a response.
const MOST_POINTS: usize = 2000;
/// Width in y beyond which the weight e^-y is less than 1e-17 of its sum.
const CUT: f64 = 50.0;

impl Passband {
    /// A band whose response is linear between points [um, response]. The largest response counts as 1.
    ///
    /// # Errors
    /// Points that are no curve.
    pub(crate) fn of_response(points: &[[f64; 2]]) -> Result<Self, ResponseFault> {
        if points.len() < 2 {
            return Err(ResponseFault::Short(points.len()));
        }
        if points.len() > MOST_POINTS {
            return Err(ResponseFault::Long(points.len()));
        }
        if let Some(index) = (1..points.len()).find(|index| points[*index][0] <= points[index - 1][0]) {
            let (found, before) = (points[index][0], points[index - 1][0]);
            return Err(ResponseFault::Unsorted { row: index + 1, found, before });
        }
        if let Some(index) = points.iter().position(|point| point[1] < 0.0) {
            return Err(ResponseFault::Negative { row: index + 1, found: points[index][1] });
        }
        let largest = points.iter().map(|point| point[1]).fold(0.0, f64::max);
        let bright = |index: &usize| points[*index][1] > 0.0;
        let (Some(first), Some(last)) = ((0..points.len()).find(bright), (0..points.len()).rfind(bright)) else {
            return Err(ResponseFault::Dark);
        };
        let seen = &points[first.saturating_sub(1)..=(last + 1).min(points.len() - 1)];
        let response: Vec<[f64; 2]> = seen.iter().map(|[um, value]| [um / 1e6, value / largest]).collect();
        let band = Band { lower: response[0][0], upper: response[response.len() - 1][0] };
        Ok(Self { band, response: Some(Arc::new(response)) })
    }

    /// The pieces of the response, from the longest wavelength on: both ends [m] and the response there.
    pub(crate) fn pieces(&self) -> Vec<[[f64; 2]; 2]> {
        match &self.response {
            None => vec![[[self.band.upper, 1.0], [self.band.lower, 1.0]]],
            Some(points) => points.windows(2).rev().map(|pair| [pair[1], pair[0]]).collect(),
        }
    }

    /// `planck::scaled_radiance`, weighed with the response.
    pub(crate) fn scaled_radiance(&self, temperature: f64) -> f64 {
        if self.response.is_none() {
            return scaled_radiance(self.band, temperature);
        }
        let sum: f64 = self.weights(temperature).map(|(_, weight)| weight).sum();
        2.0 * LIGHT_SPEED * BOLTZMANN * (BOLTZMANN * temperature / (PLANCK * LIGHT_SPEED)).powi(3) * sum
    }

    /// Limit of `scaled_radiance` for a cold body. 0 for a response that ends at 0.
    pub(crate) fn scaled_radiance_cold(&self) -> f64 {
        scaled_radiance_cold(self.band) * self.pieces()[0][0][1]
    }

    /// Limit of `scaled_radiance` for a hot body: the integral of 2 c k / lambda^4 with the response.
    pub(crate) fn scaled_radiance_hot(&self) -> f64 {
        if self.response.is_none() {
            return scaled_radiance_hot(self.band);
        }
        // In u = 1 / lambda the integrand is a polynomial of the second degree on each piece.
        let rule = GaussLegendre::new(3);
        let of_piece = |[long, short]: [[f64; 2]; 2]| {
            let at = |u: f64| long[1] + (short[1] - long[1]) * (long[0] - 1.0 / u) / (long[0] - short[0]);
            rule.on(1.0 / long[0], 1.0 / short[0]).map(|(u, weight)| weight * u * u * at(u)).sum::<f64>()
        };
        2.0 * LIGHT_SPEED * BOLTZMANN * self.pieces().into_iter().map(of_piece).sum::<f64>()
    }

    /// Wavelengths [m] and weights of Planck's law with the response at a temperature [K], whose sum is the integral of z^3 e^-y / (1 - e^-z) over y: z is
    /// c2 / (lambda T), and y is z less its value at the longest wavelength.
    pub(crate) fn weights(&self, temperature: f64) -> impl Iterator<Item = (f64, f64)> {
        self.weights_between(temperature, &[])
    }

    /// The same with the pieces cut at further wavelengths [m].
    pub(crate) fn weights_between(&self, temperature: f64, cuts: &[f64]) -> impl Iterator<Item = (f64, f64)> {
        let rules = [GaussLegendre::new(16), GaussLegendre::new(6)];
        let upper = self.band.upper;
        let edge = SECOND_RADIATION / (upper * temperature);
        let place = move |wavelength: f64| SECOND_RADIATION * (upper - wavelength) / (upper * wavelength * temperature);
        let mut all = Vec::new();
        for [long, short] in self.pieces() {
            let mut ends: Vec<f64> = cuts.iter().copied().filter(|cut| (short[0]..long[0]).contains(cut)).collect();
            ends.extend([long[0], short[0]]);
            ends.sort_by(|a, b| b.total_cmp(a));
            for pair in ends.windows(2) {
                let [start, end] = [pair[0], pair[1]].map(|wavelength| place(wavelength).min(CUT));
                let panels = (end - start).ceil().max(1.0);
                let rule = &rules[usize::from(end - start < 0.25)];
                for panel in 0..panels as usize {
                    let at = |number: usize| start + (end - start) * number as f64 / panels;
                    all.extend(rule.on(at(panel), at(panel + 1)).map(|(y, weight)| {
                        let z = edge + y;
                        let wavelength = SECOND_RADIATION / (z * temperature);
                        let share = (long[0] - wavelength) / (long[0] - short[0]);
                        let response = long[1] + (short[1] - long[1]) * share;
                        (wavelength, weight * response * z * z * z * (-y).exp() / -(-z).exp_m1())
                    }));
                }
            }
        }
        all.into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_curve_is_refused() {
        let cases: [(&[[f64; 2]], &str); 5] = [
            (&[], "has 0 rows"),
            (&[[8.0, 1.0]], "has 1 rows"),
            (&[[8.0, 1.0], [7.0, 1.0]], "row 2: wavelengths must rise, found 7 um after 8 um"),
            (&[[8.0, 1.0], [9.0, -0.1]], "row 2: a response must not be below 0, found -0.1"),
            (&[[8.0, 0.0], [9.0, 0.0]], "a response of 0 at all wavelengths"),
        ];
        for (points, expected) in cases {
            let message = Passband::of_response(points).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}
