//! Planck's law in a band by quadrature: exact to rounding, but slow.

use std::f64::consts::PI;
use std::sync::LazyLock;

use std::fmt::{self, Display, Formatter};

/// A rectangular spectral band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Lower wavelength [m].
    pub lower: f64,
    /// Upper wavelength [m].
    pub upper: f64,
}

/// `8 to 14 um`, to 1e-4 um.
impl Display for Band {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let [lower, upper] = [self.lower, self.upper].map(|wavelength| (wavelength * 1e10).round() / 1e4);
        write!(formatter, "{lower} to {upper} um")
    }
}

impl Band {
    /// Both wavelengths [um], without the rounding error of 7.3e-6 * 1e6.
    pub(crate) fn micrometres(&self) -> [f64; 2] {
        [self.lower, self.upper].map(|metres| (metres * 1e15).round() / 1e9)
    }
}

/// Planck constant [J s], exact (SI 2019).
pub(crate) const PLANCK: f64 = 6.626_070_15e-34;
/// Speed of light [m/s], exact (SI 2019).
pub(crate) const LIGHT_SPEED: f64 = 299_792_458.0;
/// Boltzmann constant [J/K], exact (SI 2019).
pub(crate) const BOLTZMANN: f64 = 1.380_649e-23;
/// Second radiation constant c2 = h c / k [m K].
pub(crate) const SECOND_RADIATION: f64 = PLANCK * LIGHT_SPEED / BOLTZMANN;

const POINTS: usize = 16;
/// Distance from the lower limit beyond which the integrand, which decays as e^-y, adds less than 1e-17 of the integral.
const CUT: f64 = 50.0;

/// Radiance of a blackbody in a band [W m-2 sr-1], to about 1e-14. Only where f64 underflows it is 0.
pub fn band_radiance_exact(band: Band, temperature: f64) -> f64 {
    scaled_radiance(band, temperature) * temperature * (-SECOND_RADIATION / (band.upper * temperature)).exp()
}

/// G = L e^x / T with x = c2 / (lambda_max T) [W m-2 sr-1 K-1]: the band radiance without the factor e^-x, which spans hundreds of decades
/// (docs/numerics.md 5). G is finite for every T > 0 [K] and in both limits (`scaled_radiance_cold`, `scaled_radiance_hot`).
///
/// With z = c2 / (lambda T), L is 2 k^4 T^4 / (h^3 c^2) times the integral of z^3 / (e^z - 1) over the band. y = z - x is integrated by Gauss-Legendre
/// panels of width at most 1, far from the poles at z = 2 pi i.
pub(crate) fn scaled_radiance(band: Band, temperature: f64) -> f64 {
    let x = SECOND_RADIATION / (band.upper * temperature);
    // The difference of the two limits is a product, so that a narrow band does not cancel.
    let width = SECOND_RADIATION * (band.upper - band.lower) / (band.upper * band.lower * temperature);
    let end = width.min(CUT);
    let panels = end.ceil().max(1.0);
    let half = 0.5 * end / panels;
    let integrand = |y: f64| {
        let z = x + y;
        z * z * z * (-y).exp() / -(-z).exp_m1()
    };
    let integral: f64 = (0..panels as u32)
        .map(|panel| {
            let middle = half * f64::from(2 * panel + 1);
            let sum: f64 = RULE.iter().map(|&(point, weight)| weight * integrand(middle + half * point)).sum();
            sum * half
        })
        .sum();
    let hc = PLANCK * LIGHT_SPEED;
    2.0 * LIGHT_SPEED * BOLTZMANN * (BOLTZMANN * temperature / hc).powi(3) * integral
}

/// Limit of `scaled_radiance` as T -> 0: 2 k c / lambda_max^3. Only the edge at lambda_max radiates, over a width of lambda_max^2 T / c2.
pub(crate) fn scaled_radiance_cold(band: Band) -> f64 {
    2.0 * BOLTZMANN * LIGHT_SPEED / band.upper.powi(3)
}

/// Limit of `scaled_radiance` as T -> infinity (Rayleigh-Jeans): the integral of 2 c k / lambda^4, (2 c k / 3) (lambda_min^-3 - lambda_max^-3), with
/// the difference of cubes as a product.
pub(crate) fn scaled_radiance_hot(band: Band) -> f64 {
    let (low, high) = (1.0 / band.upper, 1.0 / band.lower);
    let difference = (band.upper - band.lower) / (band.upper * band.lower);
    2.0 / 3.0 * LIGHT_SPEED * BOLTZMANN * difference * (high * high + high * low + low * low)
}

/// Points in [-1, 1] and weights of Gauss-Legendre quadrature.
static RULE: LazyLock<[(f64, f64); POINTS]> = LazyLock::new(gauss_legendre);

/// The rule, by Newton's iteration on the Legendre polynomial (Press et al., Numerical Recipes, section 4.6).
fn gauss_legendre() -> [(f64, f64); POINTS] {
    let n = POINTS as f64;
    std::array::from_fn(|i| {
        let mut x = (PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..8 {
            let (mut before, mut value) = (1.0, x);
            for degree in 2..=POINTS {
                let k = degree as f64;
                (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
            }
            slope = n * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::STEFAN_BOLTZMANN;

    const fn microns(lower: f64, upper: f64) -> Band {
        Band { lower: lower * 1e-6, upper: upper * 1e-6 }
    }

    #[test]
    fn a_band_is_shown_without_rounding_errors() {
        let shown = [microns(8.0, 14.0), microns(7.3, 13.5), microns(3.5, 5.0)].map(|band| band.to_string());
        assert_eq!(shown, ["8 to 14 um", "7.3 to 13.5 um", "3.5 to 5 um"]);
        assert_eq!(microns(7.3, 14.0).micrometres(), [7.3, 14.0]);
        assert_ne!(7.3e-6 * 1e6, 7.3, "the naive product rounds");
    }

    /// The integral of z^3/(e^z - 1) from x to infinity as a series in e^-nx (Widger & Woodall 1976, Bull. Amer. Meteor. Soc. 57). It is an independent
    /// check for wide bands, where the difference does not cancel.
    fn series(band: Band, temperature: f64) -> f64 {
        let above = |wavelength: f64| -> f64 {
            let x = SECOND_RADIATION / (wavelength * temperature);
            (1..2000)
                .map(|n| {
                    let n = f64::from(n);
                    (-n * x).exp() * (x.powi(3) / n + 3.0 * x * x / n.powi(2) + 6.0 * x / n.powi(3) + 6.0 / n.powi(4))
                })
                .sum()
        };
        let factor = 2.0 * (BOLTZMANN * temperature).powi(4) / (PLANCK.powi(3) * LIGHT_SPEED.powi(2));
        factor * (above(band.upper) - above(band.lower))
    }

    #[test]
    fn agrees_with_numerics_5() {
        let band = microns(8.0, 14.0);
        for (t, expected) in [(300.0, 54.93346), (267.0, 31.36853), (180.0, 2.95681)] {
            assert!(
                (band_radiance_exact(band, t) - expected).abs() < 5.1e-6,
                "{t} K: {}",
                band_radiance_exact(band, t)
            );
            assert!((band_radiance_exact(band, t + 1e-3) - expected).abs() > 1e-5);
        }
        let cold = band_radiance_exact(band, 2.7);
        assert!(cold > 3.5e-165 && cold < 4.5e-165, "L(2.7 K) = 4e-165 (docs/numerics.md 5): {cold:e}");
    }

    #[test]
    fn agrees_with_the_series() {
        for band in [microns(8.0, 14.0), microns(3.0, 5.0), microns(1.0, 50.0)] {
            for t in [10.0, 30.0, 180.0, 300.0, 1000.0, 6000.0] {
                let (exact, witness) = (band_radiance_exact(band, t), series(band, t));
                assert!((exact / witness - 1.0).abs() < 2e-12, "{band:?} {t} K: {exact:e} {witness:e}");
                assert!((band_radiance_exact(band, t * (1.0 + 1e-11)) / witness - 1.0).abs() > 2e-12);
            }
        }
    }

    #[test]
    fn all_wavelengths_give_stefan_boltzmann() {
        for t in [77.0, 300.0, 5772.0] {
            let share = band_radiance_exact(Band { lower: 1e-9, upper: 10.0 }, t) * PI / (STEFAN_BOLTZMANN * t.powi(4));
            assert!((share - 1.0).abs() < 1e-9, "{t} K: {share}");
        }
    }

    #[test]
    fn limits_are_approached() {
        for band in [microns(8.0, 14.0), microns(49.0, 50.0), microns(1.0, 50.0)] {
            let cold = scaled_radiance(band, 1e-4) / scaled_radiance_cold(band) - 1.0;
            let hot = scaled_radiance(band, 1e9) / scaled_radiance_hot(band) - 1.0;
            assert!(cold.abs() < 1e-4 && hot.abs() < 1e-4, "{band:?}: {cold:e} {hot:e}");
            assert!((scaled_radiance(band, 300.0) / scaled_radiance_hot(band) - 1.0).abs() > 1e-2);
        }
    }

    #[test]
    fn narrow_bands_do_not_cancel() {
        let (lower, upper) = (10e-6, 10.000001e-6);
        let spectral = |wavelength: f64| {
            let x = SECOND_RADIATION / (wavelength * 300.0);
            2.0 * PLANCK * LIGHT_SPEED * LIGHT_SPEED / wavelength.powi(5) / x.exp_m1()
        };
        let midpoint = spectral(0.5 * (lower + upper)) * (upper - lower);
        let exact = band_radiance_exact(Band { lower, upper }, 300.0);
        assert!((exact / midpoint - 1.0).abs() < 1e-12, "{exact:e} {midpoint:e}");
    }
}
