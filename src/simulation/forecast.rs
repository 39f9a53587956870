//! How much work a run is, before its first step: steps, images and bytes of files.
//!
//! No time is told here. Rates of nodes and pixels missed the time of the repository's scenes by a factor of three, because rays, networks and checks
//! follow no such rate. While a run goes on, its progress tells the time that is left from measured times.

use super::prepare::Prepared;
use crate::scene::work;

/// Bytes of a pixel in the EXR before compression, and of a pixel in the PNG.
const PIXEL_BYTES: f64 = 20.0 + 3.0;
/// Bytes of a number in the series: `287.123456,`.
const NUMBER_BYTES: f64 = 11.0;
/// Bytes of a time or of the position of a joint: 17 digits.
const LONG_NUMBER_BYTES: f64 = 20.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Forecast {
    /// Steps of the warm-up. A periodic warm-up ends as soon as it can, so this number is the most.
    pub(crate) warm_up: u64,
    /// Whether the warm-up may end earlier.
    pub(crate) warm_up_is_most: bool,
    /// Steps after the warm-up.
    pub(crate) steps: u64,
    pub(crate) images: u64,
    /// Pixels of an image.
    pub(crate) pixels: u64,
    /// Bytes of all files, before compression.
    pub(crate) file_bytes: f64,
    /// Peak memory of this process [B], where it is forecast.
    pub(crate) memory: Option<u64>,
}

impl Forecast {
    /// The work of a scene's run.
    pub(crate) fn of(prepared: &Prepared) -> Self {
        let (scene, time) = (&prepared.scene, &prepared.scene.time);
        let pixels = scene.camera.as_ref().map_or(0, |camera| u64::from(camera.width) * u64::from(camera.height));
        let images = if pixels > 0 { work::images(time) } else { 0 };
        let columns = 3 * (1 + prepared.parts.len() + prepared.materials.len()) + scene.probes.len();
        let joints = prepared.loads.joints().joints().len();
        let long = 1 + if joints > 0 { 1 + joints } else { 0 };
        let row = columns as f64 * NUMBER_BYTES + long as f64 * LONG_NUMBER_BYTES;
        let rows = f64::from(time.steps) + 1.0;
        Self {
            warm_up: work::warm_up_steps(time, &scene.orbit) as u64,
            warm_up_is_most: time.periodic.is_some(),
            steps: u64::from(time.steps),
            images,
            pixels,
            file_bytes: rows * row + images as f64 * pixels as f64 * PIXEL_BYTES,
            memory: None,
        }
    }

    pub(crate) fn without_warm_up(self) -> Self {
        Self { warm_up: 0, warm_up_is_most: false, ..self }
    }

    /// The same steps with one image, and no series.
    pub(crate) fn of_one_image(self) -> Self {
        Self { images: 1, file_bytes: self.pixels as f64 * PIXEL_BYTES, ..self }
    }

    /// The work in words, with the memory of the device [bytes], where there is one.
    pub(crate) fn entries(&self, device: Option<u64>) -> Vec<(String, String)> {
        let most = if self.warm_up_is_most { "at most " } else { "" };
        let mut entries = vec![
            ("steps of the warm-up".to_owned(), format!("{most}{}", self.warm_up)),
            ("steps after it".to_owned(), self.steps.to_string()),
            ("images".to_owned(), self.images.to_string()),
            ("files".to_owned(), format!("at most {}", bytes(self.file_bytes))),
        ];
        entries.extend(device.map(|device| ("memory of the device".to_owned(), bytes(device as f64))));
        entries
    }

    /// The work in a sentence.
    pub(crate) fn sentence(&self) -> String {
        let most = if self.warm_up_is_most { "at most " } else { "" };
        let memory =
            self.memory.map(|memory| format!("; about {} of memory", bytes(memory as f64))).unwrap_or_default();
        format!(
            "forecast: {most}{} steps of warm-up, {} steps and {} images; at most {} of files{memory}",
            self.warm_up,
            self.steps,
            self.images,
            bytes(self.file_bytes)
        )
    }
}

/// Bytes with a unit.
pub(crate) fn bytes(count: f64) -> String {
    let units = ["bytes", "kB", "MB", "GB", "TB"];
    let place = if count < 1.0 { 0 } else { ((count.log10() / 3.0) as usize).min(units.len() - 1) };
    let value = count / 1e3f64.powi(place as i32);
    if place == 0 { format!("{value:.0} bytes") } else { format!("{value:.1} {}", units[place]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_units() {
        for (count, text) in
            [(0.0, "0 bytes"), (999.0, "999 bytes"), (1500.0, "1.5 kB"), (2.64e8, "264.0 MB"), (5e13, "50.0 TB")]
        {
            assert_eq!(bytes(count), text);
        }
    }
}
