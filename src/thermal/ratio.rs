//! The temperature that the ratio of two radiances tells of a grey body, and its error.

use thiserror::Error;

use super::radiance::RadianceTable;

/// Temperatures between which a ratio is inverted [K].
const RANGE: [f64; 2] = [20.0, 6000.0];
/// Places in the table, at even distances of 1/T.
const PLACES: usize = 2048;
const NEWTON_STEPS: usize = 3;

/// Two bands whose ratio does not tell a temperature.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("tells no temperature: it stands still at {temperature:.0} K, as the bands overlap too much")]
pub(crate) struct RatioFault {
    temperature: f64,
}

/// ln of the ratio of the blackbody radiances of two bands over 1/T.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RatioTable {
    bands: [RadianceTable; 2],
    /// ln of the ratio at even distances of 1/T, from the hottest temperature on.
    values: Vec<f64>,
}

/// ln of the radiance of a blackbody, and its derivative [1/K].
fn ln_radiance(table: &RadianceTable, temperature: f64) -> (f64, f64) {
    let (scaled, slope) = table.ln_scaled(temperature);
    let exponent = table.edge_temperature / temperature;
    (temperature.ln() + scaled - exponent, 1.0 / temperature + slope + exponent / temperature)
}

/// Temperature [K] at a place of the table.
fn temperature_at(place: f64) -> f64 {
    let [hot, cold] = [1.0 / RANGE[1], 1.0 / RANGE[0]];
    1.0 / (hot + (cold - hot) * place / (PLACES - 1) as f64)
}

impl RatioTable {
    /// Tabulates the ratio of the first band to the second.
    ///
    /// # Errors
    /// A ratio that does not rise or fall with the temperature all the way.
    pub(crate) fn new(first: &RadianceTable, second: &RadianceTable) -> Result<Self, RatioFault> {
        let table = Self { bands: [first.clone(), second.clone()], values: Vec::new() };
        let at: Vec<f64> = (0..PLACES).map(|place| temperature_at(place as f64)).collect();
        let ratios: Vec<(f64, f64)> = at.iter().map(|temperature| table.ln_ratio(*temperature)).collect();
        let sign = ratios[PLACES / 2].1.signum();
        // In relative steps of the temperature, a ratio that changes by less than 1e-6 of itself is rounding.
        let still = at.iter().zip(&ratios).find(|(temperature, (_, slope))| slope * sign * **temperature < 1e-6);
        match still {
            Some((temperature, _)) => Err(RatioFault { temperature: *temperature }),
            None => Ok(Self { values: ratios.iter().map(|(ratio, _)| *ratio).collect(), ..table }),
        }
    }

    /// ln of the ratio at a temperature, and its derivative [1/K].
    fn ln_ratio(&self, temperature: f64) -> (f64, f64) {
        let [(first, first_slope), (second, second_slope)] =
            [&self.bands[0], &self.bands[1]].map(|table| ln_radiance(table, temperature));
        (first - second, first_slope - second_slope)
    }

    /// Temperature of a grey body of two radiances [K], and one standard deviation of its error by the noise of each radiance, to first order. `None` where no
    /// temperature of 20 to 6000 K has their ratio.
    pub(crate) fn temperature(&self, radiances: [f64; 2], noise: [f64; 2]) -> Option<[f64; 2]> {
        if !radiances.iter().all(|radiance| *radiance > 0.0) {
            return None;
        }
        let wanted = (radiances[0] / radiances[1]).ln();
        let rises = self.values[PLACES - 1] > self.values[0];
        let next = self.values.partition_point(|value| (*value < wanted) == rises);
        if next == 0 || next == PLACES {
            return None;
        }
        let [before, after] = [self.values[next - 1], self.values[next]];
        let mut temperature = temperature_at((next - 1) as f64 + (wanted - before) / (after - before));
        for _ in 0..NEWTON_STEPS {
            let (ratio, slope) = self.ln_ratio(temperature);
            // 1/T is nearly linear in ln of the ratio.
            temperature = 1.0 / (1.0 / temperature - (wanted - ratio) / (slope * temperature * temperature));
        }
        let relative = (noise[0] / radiances[0]).hypot(noise[1] / radiances[1]);
        Some([temperature, relative / self.ln_ratio(temperature).1.abs()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::planck::{Band, band_radiance_exact};

    const SHORT: Band = Band { lower: 8e-6, upper: 9.5e-6 };
    const LONG: Band = Band { lower: 11e-6, upper: 13e-6 };

    #[test]
    fn the_ratio_of_a_grey_body_tells_its_temperature() {
        let tables = [SHORT, LONG].map(RadianceTable::new);
        let [ratio, turned] = [[0, 1], [1, 0]].map(|[a, b]| RatioTable::new(&tables[a], &tables[b]).unwrap());
        for t in [30.0, 77.0, 180.0, 300.0, 411.0, 1500.0] {
            for grey in [1.0, 0.07] {
                let [short, long] = [SHORT, LONG].map(|band| grey * band_radiance_exact(band, t));
                let [found, _] = ratio.temperature([short, long], [0.0; 2]).unwrap();
                let [other, _] = turned.temperature([long, short], [0.0; 2]).unwrap();
                assert!((found / t - 1.0).abs() < 1e-6 && (other / t - 1.0).abs() < 1e-6, "{t} K: {found}, {other}");
                let [off, _] = ratio.temperature([1.01 * short, long], [0.0; 2]).unwrap();
                assert!((off / t - 1.0).abs() > 1e-4, "another ratio is another temperature");
            }
        }
        assert_eq!(ratio.temperature([0.0, 1.0], [0.0; 2]), None);
        assert_eq!(ratio.temperature([1e9, 1.0], [0.0; 2]), None);
    }

    /// The error of the inverse by differences of exact radiances.
    #[test]
    fn the_error_follows_from_the_noise() {
        let ratio = RatioTable::new(&RadianceTable::new(SHORT), &RadianceTable::new(LONG)).unwrap();
        let at = |t: f64| [SHORT, LONG].map(|band| band_radiance_exact(band, t));
        let noise = [0.02, 0.03];
        let [_, found] = ratio.temperature(at(280.0), noise).unwrap();
        let shifted = |number: usize| {
            let mut radiances = at(280.0);
            radiances[number] += noise[number];
            ratio.temperature(radiances, noise).unwrap()[0] - 280.0
        };
        let expected = shifted(0).hypot(shifted(1));
        assert!((found / expected - 1.0).abs() < 0.01, "{found} for {expected}");
    }

    #[test]
    fn one_band_twice_tells_nothing() {
        let table = RadianceTable::new(SHORT);
        assert!(RatioTable::new(&table, &table).is_err());
    }
}
