//! The meaning of a picture's pixels, for protocols that carry a PNG without stating it.

use std::io::Cursor;

use serde_json::json;

use crate::output::OutputError;
use crate::output::apparent::Apparent;
use crate::output::gray::{png_8, png_16};
use crate::scene::Scene;
use crate::simulation::image::Image;

/// Kelvin of a count of a picture of 16 bits.
pub(crate) const KELVIN_PER_COUNT: f64 = 0.01;
/// Range of a picture of 8 bits where nobody states one [K].
pub(crate) const DEFAULT_RANGE: [f64; 2] = [150.0, 400.0];

/// A kind of picture. Colder is black, hotter is white. More than 8 bits of a sensor stand at the upper end of 16.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum PictureKind {
    /// Brightness temperature in 8 bits over --range
    Apparent,
    /// Brightness temperature in 16 bits, 10 mK a count
    Apparent16,
    /// Surface temperature in 16 bits, 10 mK a count
    Surface16,
    /// Digital numbers of the scene's [sensor]
    Sensor,
}

/// How a server draws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureStyle {
    /// The kind.
    pub kind: PictureKind,
    /// Range of 8 bits [K]. `None` takes `output.colour_range` of the scene, or [`DEFAULT_RANGE`].
    pub range: Option<[f64; 2]>,
}

pub(crate) struct Painter {
    kind: PictureKind,
    range: [f64; 2],
    bits: u32,
    apparent: Apparent,
}

impl Painter {
    pub(crate) fn new(picture: PictureStyle, scene: &Scene) -> Self {
        Self {
            kind: picture.kind,
            range: picture.range.or(scene.colour_range).unwrap_or(DEFAULT_RANGE),
            bits: scene.sensor.as_ref().map_or(16, |sensor| sensor.bits).clamp(1, 16),
            apparent: Apparent::new(scene.passband()),
        }
    }

    /// The PNG of an image. A text chunk `isotherm` states the meaning of the numbers.
    ///
    /// # Errors
    /// An image that can not be encoded.
    pub(crate) fn png(&self, image: &Image) -> Result<Vec<u8>, OutputError> {
        let size = image.size();
        let text = |json: serde_json::Value| [("isotherm", json.to_string())];
        let in_counts = |kelvin: &dyn Fn(usize) -> f32, quantity: &str| {
            let count = |pixel| (f64::from(kelvin(pixel)) / KELVIN_PER_COUNT).round() as u16;
            let counts: Vec<u16> = (0..image.part.len()).map(count).collect();
            let meaning = json!({"quantity": quantity, "kelvin": "scale x value", "scale": KELVIN_PER_COUNT});
            png_16(size, &counts, &text(meaning))
        };
        match self.kind {
            PictureKind::Apparent => {
                let [low, high] = self.range;
                let kelvin = |radiance: &f32| f64::from(self.apparent.temperature(*radiance));
                let values: Vec<u8> =
                    image.radiance.iter().map(|radiance| grey(kelvin(radiance), self.range)).collect();
                let meaning = json!({"quantity": "brightness temperature", "kelvin": "offset + scale x value",
                    "offset": low, "scale": (high - low) / 255.0});
                png_8(size, &values, &text(meaning))
            }
            PictureKind::Apparent16 => {
                in_counts(&|pixel| self.apparent.temperature(image.radiance[pixel]), "brightness temperature")
            }
            PictureKind::Surface16 => in_counts(&|pixel| image.temperature[pixel], "surface temperature"),
            PictureKind::Sensor => {
                let numbers = image.digital_numbers.as_deref().unwrap_or_default();
                let meaning =
                    |shift| text(json!({"quantity": "digital number", "value": "number x 2^shift", "shift": shift}));
                if self.bits <= 8 {
                    let bytes: Vec<u8> = numbers.iter().map(|number| *number as u8).collect();
                    png_8(size, &bytes, &meaning(0))
                } else {
                    let shift = 16 - self.bits;
                    let values: Vec<u16> = numbers.iter().map(|number| number << shift).collect();
                    png_16(size, &values, &meaning(shift))
                }
            }
        }
    }
}

/// A temperature [K] in 8 bits, from black at `low` to white at `high`.
pub(crate) fn grey(kelvin: f64, [low, high]: [f64; 2]) -> u8 {
    // The conversion to u8 clamps a value out of the range.
    (255.0 * (kelvin - low) / (high - low)).round() as u8
}

/// A picture of depth in the three bytes of a colour: depth = far (R/255 + G/255^2 + B/255^3), along the camera's axis. A surface at `far` [m] or
/// beyond is white.
///
/// # Errors
/// An image that can not be encoded.
pub(crate) fn depth_png(image: &Image, far: f64) -> Result<Vec<u8>, OutputError> {
    let pixel = |pixel: usize| match image.part[pixel] {
        0 => [255; 3],
        _ => depth_colour(f64::from(image.depth[pixel]) / far),
    };
    let bytes: Vec<u8> = (0..image.part.len()).flat_map(pixel).collect();
    let failed = |error: png::EncodingError| OutputError::Encode("PNG image".to_owned(), error.to_string());
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(Cursor::new(&mut file), image.size()[0], image.size()[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&bytes).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(file)
}

/// The colour of a share of the far distance.
fn depth_colour(share: f64) -> [u8; 3] {
    if share >= 1.0 {
        return [255; 3];
    }
    let mut rest = 255.0 * share.max(0.0);
    let digits: [f64; 3] = std::array::from_fn(|place| {
        let digit = if place == 2 { rest.round() } else { rest.floor() };
        rest = 255.0 * (rest - digit);
        digit
    });
    digits.map(|digit| digit as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_bytes_hold_a_depth_to_a_part_in_ten_million() {
        let value = |[r, g, b]: [u8; 3]| f64::from(r) / 255.0 + f64::from(g) / 65025.0 + f64::from(b) / 16_581_375.0;
        for step in 0..9999 {
            let share = f64::from(step) / 1e4 + 1.234e-5;
            assert!((value(depth_colour(share)) - share).abs() < 3.1e-8, "{share}");
        }
        assert_eq!([1.0, 2.0, f64::INFINITY].map(depth_colour), [[255; 3]; 3]);
        assert_eq!(depth_colour(0.0), [0; 3]);
        assert_eq!(depth_colour(f64::from(17u8) / 255.0), [17, 0, 0]);
    }
}
