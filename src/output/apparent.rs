//! Brightness temperature: the temperature at which a blackbody has the radiance of a pixel.

use crate::simulation::image::Image;
use crate::thermal::brightness::{BrightnessTable, brightness_temperature};
use crate::thermal::passband::Passband;
use crate::thermal::radiance::RadianceTable;

/// Brightness temperatures of a band.
pub struct Apparent {
    table: RadianceTable,
    guesses: BrightnessTable,
}

impl Apparent {
    /// Brightness temperatures of radiances in a band.
    pub fn new(passband: impl Into<Passband>) -> Self {
        let table = RadianceTable::new(passband);
        Self { guesses: BrightnessTable::new(&table), table }
    }

    /// Brightness temperature [K]. 0 where a radiance has none.
    pub fn temperature(&self, radiance: f32) -> f32 {
        brightness_temperature(&self.table, &self.guesses, f64::from(radiance))
            .map_or(0.0, |temperature| temperature as f32)
    }

    /// The frame with brightness temperatures in place of the surfaces' temperatures. A pixel without radiance counts as background.
    pub(crate) fn frame(&self, frame: &Image) -> Image {
        let temperature: Vec<f32> = frame.radiance.iter().map(|radiance| self.temperature(*radiance)).collect();
        let part = temperature.iter().map(|temperature| u32::from(*temperature > 0.0)).collect();
        Image { temperature, part, ..frame.clone() }
    }

    /// Smallest and largest brightness temperature of a frame [K].
    pub(crate) fn range(&self, frame: &Image) -> Option<[f32; 2]> {
        let sent = frame.radiance.iter().copied().filter(|radiance| *radiance > f32::MIN_POSITIVE);
        let ends = sent.map(|radiance| [radiance, radiance]).reduce(super::ticks::union)?;
        Some(ends.map(|radiance| self.temperature(radiance)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::frame::tests::sphere;
    use crate::thermal::planck::Band;
    use crate::thermal::radiance::band_radiance;

    #[test]
    fn a_grey_surface_looks_colder_and_a_black_one_as_it_is() {
        let band = Band { lower: 8e-6, upper: 14e-6 };
        let (table, apparent) = (RadianceTable::new(band), Apparent::new(band));
        let mut frame = sphere(40, 30, 0);
        let emissivity = |part: u32| if part == 1 { 1.0 } else { 0.3 };
        for pixel in (0..frame.part.len()).filter(|pixel| frame.part[*pixel] != 0).collect::<Vec<_>>() {
            let radiance = band_radiance(&table, f64::from(frame.temperature[pixel]));
            frame.radiance[pixel] = (emissivity(frame.part[pixel]) * radiance) as f32;
        }
        let seen = apparent.frame(&frame);
        for pixel in 0..frame.part.len() {
            match frame.part[pixel] {
                0 => assert_eq!((seen.part[pixel], seen.temperature[pixel]), (0, 0.0)),
                1 => assert!((seen.temperature[pixel] - frame.temperature[pixel]).abs() < 1e-3),
                _ => assert!(seen.temperature[pixel] < frame.temperature[pixel] - 10.0),
            }
        }
        assert_eq!(apparent.range(&frame), seen.range());
    }
}
