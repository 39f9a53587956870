//! How much work a run is, before its first step: steps, images, bytes of files and a rough time.
//!
//! The time comes from the rates below and not from a measurement, so it is good to a factor of three or so. The rates of a node on a processor were
//! measured on two cores of an Intel Xeon: in `docs/benchmarks.md`, and for the station without images in f64. The other rates are estimates, and the
//! rates of a GPU lie on the slow side. While a run goes on, its progress tells the time that is left from measured times.

use super::prepare::Prepared;
use super::target::Target;
use crate::scene::work;

/// Bytes of a pixel in the EXR before compression, and of a pixel in the PNG.
const PIXEL_BYTES: f64 = 20.0 + 3.0;
/// Bytes of a number in the series: `287.123456,`.
const NUMBER_BYTES: f64 = 11.0;
/// Bytes of a time or of the position of a joint: 17 digits.
const LONG_NUMBER_BYTES: f64 = 20.0;

/// Rough cost of the work of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rate {
    /// Whose rate it is.
    pub(crate) of: &'static str,
    /// Of a node in a step [s].
    pub(crate) node: f64,
    /// Of a pixel of an image, its files included [s].
    pub(crate) pixel: f64,
    /// Of a step for the host: loads, series and calls [s].
    pub(crate) step: f64,
}

impl Rate {
    pub(crate) const REFERENCE: Self = Self { of: "the f64 reference", node: 150e-9, pixel: 1e-6, step: 60e-6 };
    /// A Vulkan driver that computes on the processor.
    pub(crate) const PROCESSOR: Self =
        Self { of: "a Vulkan driver on the processor", node: 60e-9, pixel: 400e-9, step: 400e-6 };
    pub(crate) const GPU: Self = Self { of: "a GPU", node: 1e-9, pixel: 150e-9, step: 150e-6 };

    pub(crate) fn of(target: &Target) -> Self {
        match target.device() {
            None => Self::REFERENCE,
            Some(context) if context.info.kind == "cpu" => Self::PROCESSOR,
            Some(_) => Self::GPU,
        }
    }
}

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
    pub(crate) nodes: u64,
    /// Bytes of all files, before compression.
    pub(crate) file_bytes: f64,
    /// Whether a network takes sub-steps, whose number is not known before.
    pub(crate) network: bool,
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
            nodes: prepared.nodes.count as u64,
            file_bytes: rows * row + images as f64 * pixels as f64 * PIXEL_BYTES,
            network: prepared.network.is_some(),
        }
    }

    pub(crate) fn without_warm_up(self) -> Self {
        Self { warm_up: 0, warm_up_is_most: false, ..self }
    }

    /// The same steps with one image, and no series.
    pub(crate) fn of_one_image(self) -> Self {
        Self { images: 1, file_bytes: self.pixels as f64 * PIXEL_BYTES, ..self }
    }

    /// A rough time [s]. A network counts as one sub-step a step.
    pub(crate) fn seconds(&self, rate: Rate) -> f64 {
        let steps = (self.warm_up + self.steps) as f64;
        steps * (rate.step + self.nodes as f64 * rate.node) + self.images as f64 * self.pixels as f64 * rate.pixel
    }

    /// The work in words, with the memory of the device [bytes], where there is one.
    pub(crate) fn entries(&self, rates: &[Rate], memory: Option<u64>) -> Vec<(String, String)> {
        let most = if self.warm_up_is_most { "at most " } else { "" };
        let least = if self.network { "at least " } else { "" };
        let mut entries = vec![
            ("steps of the warm-up".to_owned(), format!("{most}{}", self.warm_up)),
            ("steps after it".to_owned(), self.steps.to_string()),
            ("images".to_owned(), self.images.to_string()),
            ("files".to_owned(), format!("at most {}", bytes(self.file_bytes))),
        ];
        entries.extend(memory.map(|memory| ("memory of the device".to_owned(), bytes(memory as f64))));
        for rate in rates {
            let time = format!("{least}about {}, roughly", duration(self.seconds(*rate)));
            entries.push((format!("time on {}", rate.of), time));
        }
        entries
    }

    /// The work in a sentence.
    pub(crate) fn sentence(&self, rate: Rate) -> String {
        let most = if self.warm_up_is_most { "at most " } else { "" };
        let network = if self.network { "at least " } else { "" };
        format!(
            "forecast: {most}{} steps of warm-up, {} steps and {} images; at most {} of files; {network}about {} (a rough rate of {})",
            self.warm_up,
            self.steps,
            self.images,
            bytes(self.file_bytes),
            duration(self.seconds(rate)),
            rate.of
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

/// A time to one or two digits.
pub(crate) fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "1 s".to_owned(),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.0} h", s / 3600.0),
        s => format!("{:.0} days", s / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10 steps of warm-up and 90 steps of 1000 nodes at 150 ns and 60 us; 2 images of 100 pixels at 1 us.
    #[test]
    fn the_time_is_the_sum_of_its_rates() {
        let forecast = Forecast {
            warm_up: 10,
            warm_up_is_most: false,
            steps: 90,
            images: 2,
            pixels: 100,
            nodes: 1000,
            file_bytes: 4.2e6,
            network: false,
        };
        let seconds = forecast.seconds(Rate::REFERENCE);
        assert!((seconds - (100.0 * (60e-6 + 150e-6) + 200e-6)).abs() < 1e-12, "{seconds}");
        let said = forecast.sentence(Rate::REFERENCE);
        assert!(
            said.starts_with(
                "forecast: 10 steps of warm-up, 90 steps and 2 images; at most 4.2 MB of files; about 1 s"
            ),
            "{said}"
        );
    }

    #[test]
    fn figures_have_units() {
        for (count, text) in
            [(0.0, "0 bytes"), (999.0, "999 bytes"), (1500.0, "1.5 kB"), (2.64e8, "264.0 MB"), (5e13, "50.0 TB")]
        {
            assert_eq!(bytes(count), text);
        }
        for (seconds, text) in [(0.2, "1 s"), (90.0, "90 s"), (600.0, "10 min"), (36_000.0, "10 h"), (1e6, "12 days")] {
            assert_eq!(duration(seconds), text);
        }
    }
}
