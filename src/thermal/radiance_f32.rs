//! Band radiance and its inverse in f32, operation by operation as in the shader, to predict the device's rounding.
//!
//! The arithmetic does not depend on compilers and drivers. It uses only + - * / and bit masks, no fma, no two-sum (a driver may simplify `(x + y) - x`),
//! no device `exp` and `log`. The quotient x = c2 / (lambda_max T) reaches 105. One f32 rounding of x then changes L by 4e-6, and a division with 2.5 ulp
//! of error (which Vulkan allows) by 2e-5. x is therefore the sum of a high part of 12 bits and a low part.

use crate::thermal::brightness::{BrightnessTable, GUESS_SHIFT};
use crate::thermal::radiance::{INTERVALS, MIDDLE_TEMPERATURE, RadianceTable};

/// Mask that keeps sign, exponent and the upper 12 bits of the significand. The product of two such numbers is exact.
const HIGH_PART: u32 = 0xffff_f000;
/// ln 2 rounded to 9 bits. Its product with an integer below 2^15 is exact (Cody & Waite 1980, with the constants of Cephes `expf`).
const LN2_HIGH: f32 = 355.0 / 512.0;
const LN2_LOW: f32 = -2.121_944_4e-4;
/// Largest exponent of two factors 2^-126. Beyond it the radiance is 0 in f32.
const MAX_EXPONENT: f32 = 252.0;
/// Temperature below which every band up to 50 um is 0 in f32 [K]. It also avoids a division by T = 0.
const MIN_TEMPERATURE: f32 = 1.0;
const NEWTON_STEPS: u32 = 2;

/// The tables of a band on the device.
#[derive(Debug, Clone, PartialEq)]
pub struct RadianceTableF32 {
    /// c2 / lambda_max [K], rounded.
    pub edge_high: f32,
    /// Rounding error of `edge_temperature` [K].
    pub edge_low: f32,
    /// ln G, guards included.
    pub values: Vec<f32>,
    /// 1/T of the inverse's first guess [1/K].
    pub inverse_temperatures: Vec<f32>,
    /// Index of the first guess in the table.
    pub first_index: u32,
}

impl RadianceTableF32 {
    /// Rounds the f64 tables.
    pub fn new(table: &RadianceTable, guesses: &BrightnessTable) -> Self {
        let edge_high = table.edge_temperature as f32;
        Self {
            edge_high,
            edge_low: (table.edge_temperature - f64::from(edge_high)) as f32,
            values: table.values.iter().map(|&v| v as f32).collect(),
            inverse_temperatures: guesses.inverse_temperatures.iter().map(|&u| u as f32).collect(),
            first_index: guesses.first_index,
        }
    }
}

/// Radiance as `significand * 2^-exponent`, and d ln G / dv for the inverse.
struct ScaledRadiance {
    significand: f32,
    exponent: f32,
    slope: f32,
}

/// Radiance of a blackbody [W m-2 sr-1].
pub fn band_radiance_f32(table: &RadianceTableF32, temperature: f32) -> f32 {
    let scaled = scaled_radiance_f32(table, temperature.max(MIN_TEMPERATURE));
    scale(scaled.significand, -scaled.exponent)
}

/// Brightness temperature [K] of a radiance between the floor and the ceiling of `BrightnessTable::check`.
pub fn brightness_temperature_f32(table: &RadianceTableF32, radiance: f32) -> f32 {
    let bits = radiance.to_bits();
    let cell = ((bits >> GUESS_SHIFT) - table.first_index) as usize;
    let within = (bits & ((1 << GUESS_SHIFT) - 1)) as f32 / (1 << GUESS_SHIFT) as f32;
    let (low, high) = (table.inverse_temperatures[cell], table.inverse_temperatures[cell + 1]);
    let mut t = 1.0 / (low + (high - low) * within);
    for _ in 0..NEWTON_STEPS {
        let found = scaled_radiance_f32(table, t);
        let excess = ln_ratio(scale(radiance, found.exponent), found.significand);
        let v = t / (t + MIDDLE_TEMPERATURE as f32);
        let steepness = t + table.edge_high + MIDDLE_TEMPERATURE as f32 * v * v * found.slope;
        t /= 1.0 - t * excess / steepness;
    }
    t
}

/// T G e^-x without its power of two, for T >= `MIN_TEMPERATURE`.
fn scaled_radiance_f32(table: &RadianceTableF32, t: f32) -> ScaledRadiance {
    let v = t / (t + MIDDLE_TEMPERATURE as f32);
    let place = v * INTERVALS as f32;
    let cell = place.floor().min(INTERVALS as f32 - 1.0);
    let i = cell as usize;
    let (ln_g, slope) =
        cubic([table.values[i], table.values[i + 1], table.values[i + 2], table.values[i + 3]], place - cell);

    // x = x_high + x_low. The remainder of the division by the high part is exact except for its last operation.
    let x = table.edge_high / t;
    let x_high = high_part(x);
    let t_high = high_part(t);
    let t_low = t - t_high;
    let remainder = (table.edge_high - x_high * t_high) - x_high * t_low + table.edge_low;
    let x_low = remainder / t;

    // e^(ln G - x) = e^f 2^-m, |f| <= ln 2 / 2.
    let m = ((x - ln_g) * std::f32::consts::LOG2_E + 0.5).floor().min(MAX_EXPONENT);
    let f = (m * LN2_HIGH - x_high) + ((ln_g - x_low) + m * LN2_LOW);
    ScaledRadiance { significand: t * exp_reduced(f), exponent: m, slope: slope * INTERVALS as f32 }
}

/// The number with only the upper 12 bits of its significand.
fn high_part(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & HIGH_PART)
}

/// Lagrange's cubic through values at -1, 0, 1, 2, and its derivative, at `t` in [0, 1].
fn cubic(f: [f32; 4], t: f32) -> (f32, f32) {
    let c3 = (f[3] - f[0]) * (1.0 / 6.0) + 0.5 * (f[1] - f[2]);
    let c2 = 0.5 * ((f[0] - f[1]) + (f[2] - f[1]));
    let c1 = (f[2] - f[1]) - c2 - c3;
    (f[1] + t * (c1 + t * (c2 + t * c3)), c1 + t * (2.0 * c2 + 3.0 * t * c3))
}

/// e^f for |f| <= ln 2 / 2 (polynomial of Cephes `expf`, 2e-8 relative before rounding).
fn exp_reduced(f: f32) -> f32 {
    let mut p = 1.987_569_1e-4;
    p = p * f + 1.398_2e-3;
    p = p * f + 8.333_452e-3;
    p = p * f + 4.166_579_6e-2;
    p = p * f + 1.666_666_5e-1;
    p = p * f + 0.5;
    1.0 + (f + f * f * p)
}

/// ln(a / b) for a near b, by the series of 2 artanh((a - b) / (a + b)). It keeps its relative accuracy near 0, unlike a device's `log` near 1. For
/// ln(a / b)| <= 0.2 the first omitted term is below 1e-9 of it.
fn ln_ratio(a: f32, b: f32) -> f32 {
    let z = (a - b) / (a + b);
    let z2 = z * z;
    2.0 * z * (1.0 + z2 * (1.0 / 3.0 + z2 * (0.2 + z2 * (1.0 / 7.0))))
}

/// `value * 2^exponent` for an integer |exponent| <= `MAX_EXPONENT`, by two normal factors.
fn scale(value: f32, exponent: f32) -> f32 {
    let half = (exponent * 0.5).floor();
    value * power_of_two(half) * power_of_two(exponent - half)
}

/// 2^n for an integer n from -126 to 127.
fn power_of_two(n: f32) -> f32 {
    f32::from_bits(((n as i32 + 127) << 23) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::brightness::MAX_TEMPERATURE;
    use crate::thermal::planck::Band;
    use crate::thermal::planck::band_radiance_exact;
    use crate::thermal::radiance::tests::{BANDS, microns, temperatures};

    fn tables(band: Band) -> RadianceTableF32 {
        let table = RadianceTable::new(band);
        RadianceTableF32::new(&table, &BrightnessTable::new(&table))
    }

    /// The naive form: one rounding of x, and the library's exponential.
    fn plain(table: &RadianceTableF32, t: f32) -> f32 {
        let v = t / (t + MIDDLE_TEMPERATURE as f32);
        let place = v * INTERVALS as f32;
        let i = place as usize;
        let (ln_g, _) =
            cubic([table.values[i], table.values[i + 1], table.values[i + 2], table.values[i + 3]], place - i as f32);
        t * (ln_g - table.edge_high / t).exp()
    }

    /// Largest relative error over 30 to 1000 K where the radiance is a normal f32.
    fn worst_radiance(band: Band, radiance: impl Fn(f32) -> f32) -> f64 {
        temperatures()
            .map(|t| (t as f32, band_radiance_exact(band, f64::from(t as f32))))
            .filter(|&(_, exact)| exact >= f64::from(f32::MIN_POSITIVE))
            .map(|(t, exact)| (f64::from(radiance(t)) / exact - 1.0).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn radiance_within_2e_5() {
        let mut plain_worst: f64 = 0.0;
        for band in BANDS {
            let table = tables(band);
            // The bound is 2e-5. Measured: 2.4e-7 (8-14 um) to 1.5e-6 (1-1.1 um).
            let error = worst_radiance(band, |t| band_radiance_f32(&table, t));
            assert!(error < 2.5e-6, "{band:?}: {error:e}");
            plain_worst = plain_worst.max(worst_radiance(band, |t| plain(&table, t)));
        }
        assert!(plain_worst > 5e-6, "the plain evaluation must show its rounding of x: {plain_worst:e}");
    }

    #[test]
    fn inverse_within_2_mk() {
        for band in BANDS {
            let table = tables(band);
            let worst = |gain: f32| {
                temperatures()
                    .map(|t| (t, band_radiance_exact(band, t)))
                    .filter(|&(_, exact)| exact >= 1.01 * f64::from(f32::MIN_POSITIVE))
                    .map(|(t, exact)| (f64::from(brightness_temperature_f32(&table, gain * exact as f32)) - t).abs())
                    .fold(0.0, f64::max)
            };
            // The bound is 2 mK. Measured: 0.1 mK (1-2 um) to 0.5 mK (49-50 um).
            assert!(worst(1.0) < 1e-3, "{band:?}: {:e} K", worst(1.0));
            assert!(worst(1.0001) > 1e-3);
        }
    }

    #[test]
    fn inverse_from_the_floor_to_the_ceiling() {
        for band in BANDS {
            let table = RadianceTable::new(band);
            let guesses = BrightnessTable::new(&table);
            let rounded = RadianceTableF32::new(&table, &guesses);
            let (low, high) = (guesses.min_temperature * 1.001, MAX_TEMPERATURE * 0.999);
            for i in 0..500 {
                let t = low * (high / low).powf(f64::from(i) / 499.0);
                let inverse = brightness_temperature_f32(&rounded, band_radiance_exact(band, t) as f32);
                assert!((f64::from(inverse) / t - 1.0).abs() < 3e-6, "{band:?}: {t} K gives {inverse} K");
            }
        }
    }

    #[test]
    fn cold_is_zero() {
        for band in BANDS {
            let table = tables(band);
            for t in [0.0, 1e-30, 1.0, 2.7] {
                assert_eq!(band_radiance_f32(&table, t), 0.0, "{band:?} {t} K");
            }
        }
        assert!(band_radiance_f32(&tables(microns(8.0, 14.0)), 11.5) > f32::MIN_POSITIVE);
    }

    #[test]
    fn logarithm_of_a_ratio_is_accurate_near_one() {
        for difference in [1e-6_f32, -3e-4, 0.02, -0.15, 0.2] {
            let a = 1.0 + difference;
            let expected = f64::from(a).ln();
            assert!((f64::from(ln_ratio(a, 1.0)) / expected - 1.0).abs() < 3e-7, "{difference}");
        }
    }

    #[test]
    fn exponential_is_accurate() {
        for i in -347..=347 {
            let f = i as f32 * 1e-3;
            let error = (f64::from(exp_reduced(f)) / f64::from(f).exp() - 1.0).abs();
            assert!(error < 1.3e-7, "{f}: {error:e}");
        }
    }
}
