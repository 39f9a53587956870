//! From the signal of a pixel to its digital number, and back to a brightness temperature. Twin: `glsl/sensor_signal.glsl`.

use super::{Netd, Sensor};
use crate::thermal::brightness::{BrightnessTable, brightness_temperature};
use crate::thermal::radiance::{RadianceTable, band_radiance};

/// Largest count of the radiometric output.
pub(crate) const MOST_COUNT: f64 = 65_535.0;

/// The sensor's numbers in units of the signal [W m-2 sr-1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorConstants {
    /// Share of the scene's radiance in the signal.
    pub(crate) transmitted: f64,
    /// Signal of the lens.
    pub(crate) emitted: f64,
    /// Signal of the housing where nothing else is seen.
    pub(crate) housing: f64,
    /// Standard deviation of the temporal noise.
    pub(crate) noise: f64,
    /// Standard deviation of the offsets.
    pub(crate) offset_pattern: f64,
    /// Standard deviation of the gains.
    pub(crate) gain_pattern: f64,
    /// Standard deviation of the drift [1/s].
    pub(crate) drift: f64,
    /// Signal at which gains have no effect.
    pub(crate) level: f64,
    /// Digital numbers of a signal of 1.
    pub scale: f64,
    /// Digital number of a signal of 0.
    pub offset: f64,
    /// Largest digital number.
    pub(crate) most: f64,
    /// Share of bad pixels.
    pub(crate) bad: f64,
    /// Counts of a kelvin. 0 without a radiometric output.
    pub(crate) counts: f64,
}

impl SensorConstants {
    /// The constants of a sensor in a band.
    pub fn new(sensor: &Sensor, table: &RadianceTable) -> Self {
        let transmitted = sensor.optics.transmission;
        let emitted = sensor.optics.lens.map_or(0.0, |lens| (1.0 - transmitted) * band_radiance(table, lens));
        let signal = |temperature: f64| transmitted * band_radiance(table, temperature) + emitted;
        let most = f64::from((1u32 << sensor.bits) - 1);
        let [low, high] = sensor.range.map(signal);
        let scale = most / (high - low);
        let stated = sensor.noise.map_or(300.0, |netd| netd.temperature);
        let slope = transmitted * radiance_slope(table, stated);
        let pattern = sensor.pattern;
        Self {
            transmitted,
            emitted,
            housing: sensor.optics.housing.map_or(0.0, |housing| band_radiance(table, housing)),
            noise: sensor.noise.map_or(0.0, |netd| netd.at_f_number() * slope),
            offset_pattern: pattern.map_or(0.0, |pattern| pattern.offset * slope),
            gain_pattern: pattern.map_or(0.0, |pattern| pattern.gain),
            drift: pattern.map_or(0.0, |pattern| pattern.drift * slope),
            level: pattern.map_or(0.0, |pattern| signal(pattern.shutter)),
            scale,
            offset: -low * scale,
            most,
            bad: sensor.detector.bad_pixels,
            counts: sensor.kelvin_per_count.map_or(0.0, |kelvin| 1.0 / kelvin),
        }
    }

    /// Standard deviation of what looks like grain in an image of one temperature [digital numbers].
    pub(crate) fn grain(&self) -> f64 {
        self.noise.hypot(self.offset_pattern) * self.scale
    }

    /// Signal of a pixel that sees a radiance, with the share `vignette` of the light.
    pub(crate) fn signal(&self, radiance: f64, vignette: f64) -> f64 {
        vignette * (self.transmitted * radiance + self.emitted) + (1.0 - vignette) * self.housing
    }

    pub(crate) fn radiance(&self, signal: f64, vignette: f64) -> f64 {
        ((signal - (1.0 - vignette) * self.housing) / vignette - self.emitted) / self.transmitted
    }

    pub(crate) fn digital_number(&self, signal: f64) -> f64 {
        (signal * self.scale + self.offset + 0.5).floor().clamp(0.0, self.most)
    }

    /// Signal in the middle of the interval that a digital number stands for.
    pub(crate) fn signal_of(&self, number: f64) -> f64 {
        (number - self.offset) / self.scale
    }
}

impl Netd {
    /// The NETD at the camera's own f-number [K]: a detector receives 1 / (4 F^2 + 1) of the light of the half space.
    pub(crate) fn at_f_number(&self) -> f64 {
        let share = |f: f64| 4.0 * f * f + 1.0;
        self.kelvin * share(self.f_number) / share(self.stated_f_number)
    }
}

/// Change of the blackbody's radiance with its temperature [W m-2 sr-1 K-1].
pub fn radiance_slope(table: &RadianceTable, temperature: f64) -> f64 {
    let (_, slope) = table.ln_scaled(temperature);
    let relative = 1.0 / temperature + slope + table.edge_temperature / (temperature * temperature);
    band_radiance(table, temperature) * relative
}

/// Count of the radiometric output for a radiance. 0 where the radiance has no brightness temperature.
pub(crate) fn count(
    constants: &SensorConstants,
    table: &RadianceTable,
    guesses: &BrightnessTable,
    radiance: f64,
) -> f64 {
    let temperature = brightness_temperature(table, guesses, radiance.min(guesses.max_radiance)).unwrap_or(0.0);
    (temperature * constants.counts + 0.5).floor().clamp(0.0, MOST_COUNT)
}

#[cfg(test)]
mod tests {
    use super::super::SensorOptics;
    use super::super::tests::plain;
    use super::*;
    use crate::thermal::planck::Band;

    fn table() -> RadianceTable {
        RadianceTable::new(Band { lower: 8e-6, upper: 14e-6 })
    }

    #[test]
    fn the_range_has_its_ends_at_0_and_at_the_largest_number() {
        let optics = SensorOptics { transmission: 0.9, lens: Some(290.0), housing: Some(300.0) };
        let constants = SensorConstants::new(&Sensor { optics, ..plain() }, &table());
        let number = |t| constants.digital_number(constants.signal(band_radiance(&table(), t), 1.0));
        assert_eq!([number(200.0), number(400.0)], [0.0, 16_383.0]);
        assert_eq!([number(190.0), number(450.0)], [0.0, 16_383.0], "beyond the range it saturates");
        // L(300 K) = 54.9 W m-2 sr-1 in 8 to 14 um lies a quarter of the way.
        assert!((3000.0..5000.0).contains(&number(300.0)), "{}", number(300.0));
    }

    #[test]
    fn a_radiance_comes_back_from_its_signal() {
        let optics = SensorOptics { transmission: 0.85, lens: Some(310.0), housing: Some(300.0) };
        let constants = SensorConstants::new(&Sensor { optics, ..plain() }, &table());
        for vignette in [1.0, 0.6] {
            let back = constants.radiance(constants.signal(42.0, vignette), vignette);
            assert!((back - 42.0).abs() < 1e-12, "{back}");
            let number = constants.digital_number(constants.signal(42.0, vignette));
            let back = constants.radiance(constants.signal_of(number), vignette);
            assert!((back - 42.0).abs() < 0.51 / constants.scale / 0.85 / vignette, "{back}");
        }
    }

    #[test]
    fn the_slope_is_that_of_the_radiance() {
        let (table, h) = (table(), 1e-3);
        for t in [180.0, 300.0, 450.0] {
            let difference = (band_radiance(&table, t + h) - band_radiance(&table, t - h)) / (2.0 * h);
            assert!((radiance_slope(&table, t) / difference - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_slower_lens_has_a_larger_netd() {
        let netd = Netd { kelvin: 0.04, temperature: 300.0, stated_f_number: 1.0, f_number: 1.0 };
        assert_eq!(netd.at_f_number(), 0.04);
        let slow = Netd { f_number: 2.0, ..netd };
        assert!((slow.at_f_number() - 0.04 * 17.0 / 5.0).abs() < 1e-15);
    }

    #[test]
    fn counts_are_kelvin() {
        let (table, sensor) = (table(), Sensor { kelvin_per_count: Some(0.01), ..plain() });
        let guesses = BrightnessTable::new(&table);
        let constants = SensorConstants::new(&sensor, &table);
        let of = |radiance| count(&constants, &table, &guesses, radiance);
        assert_eq!(of(band_radiance(&table, 300.0)), 30_000.0);
        assert_eq!(of(band_radiance(&table, 300.02)), 30_002.0);
        assert_eq!([of(0.0), of(-1.0), of(1e9)], [0.0, 0.0, 65_535.0]);
    }
}
