//! Brightness temperature: the inverse of band radiance (docs/numerics.md 5).

use thiserror::Error;

use crate::thermal::radiance::{RadianceTable, band_radiance};

/// Highest temperature of the inverse [K].
pub const MAX_TEMPERATURE: f64 = 20_000.0;
/// Shift of an f32's bits that leaves its octave and eighth of an octave, the index of the first guess.
pub(crate) const GUESS_SHIFT: u32 = 20;
/// Newton steps after the guess. The guess is within 1e-2 in ln L, so the second step reaches f32 rounding.
pub(crate) const NEWTON_STEPS: u32 = 4;

/// Table of 1/T over radiance, the first guess of the inverse. The table is linear in L between entries. With eight entries an octave this is nearly
/// linear in ln L. The index comes from the bits of an f32, which spares the device a logarithm.
#[derive(Debug, Clone, PartialEq)]
pub struct BrightnessTable {
    /// 1/T [1/K] at the radiances whose f32 bits are `(first_index + i) << GUESS_SHIFT`.
    pub(crate) inverse_temperatures: Vec<f64>,
    /// Index of the least normal f32.
    pub(crate) first_index: u32,
    /// Least radiance of the inverse [W m-2 sr-1]: the least normal f32.
    pub(crate) min_radiance: f64,
    /// Temperature of `min_radiance` [K].
    pub min_temperature: f64,
    /// Radiance at `MAX_TEMPERATURE` [W m-2 sr-1].
    pub max_radiance: f64,
}

/// An error of the inverse: a radiance without a brightness temperature.
#[derive(Debug, Clone, PartialEq, Error)]
pub(crate) enum BrightnessError {
    /// A radiance that is not positive and finite.
    #[error("radiance {0} W m-2 sr-1 has no brightness temperature: it must be positive and finite")]
    NotPositive(f64),
    /// A radiance below the least normal f32.
    #[error(
        "radiance {radiance:e} W m-2 sr-1 is below {floor:e}, the least that a 32-bit float holds \
         (a blackbody at {floor_temperature:.2} K in this band)"
    )]
    BelowFloor {
        /// Given radiance [W m-2 sr-1].
        radiance: f64,
        /// The least normal f32.
        floor: f64,
        /// Temperature of that radiance [K].
        floor_temperature: f64,
    },
    /// A radiance above a blackbody at `MAX_TEMPERATURE`.
    #[error("radiance {radiance:e} W m-2 sr-1 is above {ceiling:e}, a blackbody at {MAX_TEMPERATURE} K in this band")]
    AboveCeiling {
        /// Given radiance [W m-2 sr-1].
        radiance: f64,
        /// Radiance at `MAX_TEMPERATURE` [W m-2 sr-1].
        ceiling: f64,
    },
}

impl BrightnessTable {
    /// Tabulates the inverse of a band's radiance.
    pub fn new(table: &RadianceTable) -> Self {
        let min_radiance = f64::from(f32::MIN_POSITIVE);
        let max_radiance = band_radiance(table, MAX_TEMPERATURE);
        let first_index = f32::MIN_POSITIVE.to_bits() >> GUESS_SHIFT;
        let mut inverse_temperatures = Vec::new();
        for index in first_index.. {
            let radiance = f64::from(f32::from_bits(index << GUESS_SHIFT));
            inverse_temperatures.push(bisect(table, radiance.ln()));
            if radiance > max_radiance {
                break;
            }
        }
        let min_temperature = 1.0 / inverse_temperatures[0];
        Self { inverse_temperatures, first_index, min_radiance, min_temperature, max_radiance }
    }

    /// Checks that the inverse exists.
    pub(crate) fn check(&self, radiance: f64) -> Result<(), BrightnessError> {
        if !(radiance > 0.0 && radiance.is_finite()) {
            return Err(BrightnessError::NotPositive(radiance));
        }
        if radiance < self.min_radiance {
            let (floor, floor_temperature) = (self.min_radiance, self.min_temperature);
            return Err(BrightnessError::BelowFloor { radiance, floor, floor_temperature });
        }
        if radiance > self.max_radiance {
            return Err(BrightnessError::AboveCeiling { radiance, ceiling: self.max_radiance });
        }
        Ok(())
    }

    /// First guess of 1/T [1/K] for a radiance that `check` passes.
    pub(crate) fn guess(&self, radiance: f32) -> f64 {
        let bits = radiance.to_bits();
        let cell = ((bits >> GUESS_SHIFT) - self.first_index) as usize;
        let within = f64::from(bits & ((1 << GUESS_SHIFT) - 1)) / f64::from(1 << GUESS_SHIFT);
        let (low, high) = (self.inverse_temperatures[cell], self.inverse_temperatures[cell + 1]);
        low + (high - low) * within
    }
}

/// Temperature of a blackbody of this radiance [W m-2 sr-1] in the table's band [K].
///
/// Newton's iteration for u = 1/T works on ln L, which is nearly linear in u: d ln L / du = -(T + c2/lambda_max + T^2 d ln G/dT).
pub(crate) fn brightness_temperature(
    table: &RadianceTable,
    guesses: &BrightnessTable,
    radiance: f64,
) -> Result<f64, BrightnessError> {
    guesses.check(radiance)?;
    let target = radiance.ln();
    let mut t = 1.0 / guesses.guess(radiance as f32);
    for _ in 0..NEWTON_STEPS {
        let (ln_scaled, slope) = table.ln_scaled(t);
        let excess = target - (t.ln() + ln_scaled - table.edge_temperature / t);
        let steepness = t + table.edge_temperature + t * t * slope;
        t /= 1.0 - t * excess / steepness;
    }
    Ok(t)
}

/// 1/T [1/K] at a value of ln L, by bisection over the whole range of the inverse.
fn bisect(table: &RadianceTable, ln_radiance: f64) -> f64 {
    let (mut low, mut high) = (0.25 / MAX_TEMPERATURE, 1.0);
    for _ in 0..80 {
        let u = 0.5 * (low + high);
        if table.ln_scaled(1.0 / u).0 - u.ln() - table.edge_temperature * u > ln_radiance {
            low = u;
        } else {
            high = u;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::planck::band_radiance_exact;
    use crate::thermal::radiance::tests::{BANDS, microns};

    /// From the least to the greatest radiance.
    fn temperatures(guesses: &BrightnessTable) -> impl Iterator<Item = f64> {
        let (low, high) = (guesses.min_temperature * (1.0 + 1e-6), MAX_TEMPERATURE * (1.0 - 1e-9));
        (0..400).map(move |i| low * (high / low).powf(f64::from(i) / 399.0))
    }

    #[test]
    fn inverts_the_exact_radiance() {
        for band in BANDS {
            let table = RadianceTable::new(band);
            let guesses = BrightnessTable::new(&table);
            let worst = |gain: f64| {
                temperatures(&guesses)
                    .filter(|t| (30.0..=1000.0).contains(t))
                    .map(|t| {
                        let inverse = brightness_temperature(&table, &guesses, gain * band_radiance_exact(band, t));
                        (inverse.unwrap_or(f64::NAN) - t).abs()
                    })
                    .fold(0.0, f64::max)
            };
            // Measured: 5e-7 K at most (7-7.001 um).
            assert!(worst(1.0) < 5e-6, "{band:?}: {:e} K", worst(1.0));
            assert!(worst(1.0 + 1e-5) > 5e-6);
        }
    }

    #[test]
    fn inverts_the_table_over_its_whole_domain() {
        for band in BANDS {
            let table = RadianceTable::new(band);
            let guesses = BrightnessTable::new(&table);
            for t in temperatures(&guesses) {
                let inverse = brightness_temperature(&table, &guesses, band_radiance(&table, t));
                assert!(inverse.as_ref().is_ok_and(|i| (i / t - 1.0).abs() < 1e-11), "{band:?} {t} K: {inverse:?}");
            }
        }
    }

    #[test]
    fn outside_the_domain_is_an_error() {
        let table = RadianceTable::new(microns(8.0, 14.0));
        let guesses = BrightnessTable::new(&table);
        assert!((guesses.min_temperature - 11.3).abs() < 0.05, "docs/numerics.md 5: {} K", guesses.min_temperature);
        let ask = |radiance| brightness_temperature(&table, &guesses, radiance);
        assert!(matches!(ask(1e-39), Err(BrightnessError::BelowFloor { .. })));
        assert!(matches!(ask(guesses.max_radiance * 1.01), Err(BrightnessError::AboveCeiling { .. })));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(ask(bad), Err(BrightnessError::NotPositive(_))));
        }
        assert!(ask(guesses.min_radiance).is_ok() && ask(guesses.max_radiance).is_ok());
    }
}
