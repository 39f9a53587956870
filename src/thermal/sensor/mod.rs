//! The sensor of a thermal camera: how its optics, its microbolometer and its digits turn the radiance of an image into a signal and numbers.
//!
//! The stages, in order: point spread and stray light ([`spread`], [`halo`]), vignetting and the optics' own emission, the lag of the
//! bolometer, noise and fixed pattern ([`noise`]), digital numbers, and temperatures from them ([`reading`]). [`twin`] joins them in f64.
//! [`gain_control`] maps digital numbers to the 8 bits of a display.
//!
//! The *signal* of a pixel is the radiance that arrives at the detector [W m-2 sr-1]: the scene's times the transmission of the lens, plus the
//! emission of the optics.

pub(crate) mod gain_control;
pub(crate) mod halo;
pub(crate) mod noise;
pub(crate) mod reading;
pub(crate) mod spread;
pub(crate) mod twin;

use gain_control::GainControl;
use halo::Halo;
use spread::Spread;

/// Most pixels of an image with a sensor: one dispatch of 65,535 workgroups of 256 pixels.
pub(crate) const MOST_PIXELS: u64 = 65_535 * 256;

/// A sensor. A part that is `None` or 0 is absent.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Seed of the temporal noise.
    pub seed: u32,
    /// The detector itself.
    pub detector: Detector,
    /// Point spread of the optics and of the pixel.
    pub spread: Option<Spread>,
    /// Stray light (size-of-source effect).
    pub halo: Option<Halo>,
    /// Loss of light towards the corners.
    pub vignetting: Option<Vignetting>,
    /// Transmission and emission of the optics.
    pub optics: SensorOptics,
    /// Thermal time constant of the bolometer [s].
    pub time_constant: Option<f64>,
    /// Temporal noise.
    pub noise: Option<Netd>,
    /// Fixed pattern.
    pub pattern: Option<Pattern>,
    /// Bits of a digital number: 8, 14 or 16.
    pub bits: u32,
    /// Brightness temperatures at digital number 0 and at the largest one [K], in the middle of the image.
    pub range: [f64; 2],
    /// Brightness temperature of one count of the radiometric output [K].
    pub kelvin_per_count: Option<f64>,
    /// Mapping to 8 bits for a display.
    pub gain_control: GainControl,
}

/// A detector, by which cameras of one make differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detector {
    /// Serial number of the camera. Fixed pattern and bad pixels follow from it, whatever the seed of the noise is.
    pub serial: u32,
    /// Share of bad pixels. Half of them always read 0, and half the largest digital number.
    pub bad_pixels: f64,
}

/// Loss of light towards the corners.
#[derive(Debug, Clone, PartialEq)]
pub enum Vignetting {
    /// Fourth power of the cosine between the line of sight and the axis.
    Cos4,
    /// Share of the light that arrives at each pixel, above 0 and at most 1, row after row.
    Map(Vec<f64>),
}

/// Transmission and emission of the optics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorOptics {
    /// Share of the light that the lens passes. The lens emits the rest at its own temperature.
    pub transmission: f64,
    /// Temperature of the lens [K]. `None` emits nothing.
    pub lens: Option<f64>,
    /// Temperature of the housing [K], which is seen where the image is vignetted. `None` emits nothing.
    pub housing: Option<f64>,
}

/// Temporal noise by its noise-equivalent temperature difference (NETD).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Netd {
    /// Standard deviation [K].
    pub kelvin: f64,
    /// Temperature of the scene that it is stated for [K].
    pub temperature: f64,
    /// f-number that it is stated for.
    pub stated_f_number: f64,
    /// f-number of the camera.
    pub f_number: f64,
}

/// Fixed pattern, and its correction by a shutter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pattern {
    /// Standard deviation of the offsets after a correction [K at the temperature of the NETD].
    pub offset: f64,
    /// Standard deviation of the gains.
    pub gain: f64,
    /// Standard deviation of the offsets' drift since the last correction [K/s].
    pub drift: f64,
    /// Time between corrections [s]. The first is at time 0, and with `None` the only one.
    pub interval: Option<f64>,
    /// Temperature of the shutter [K], at which gains have no effect.
    pub shutter: f64,
}

/// Values that change from image to image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Exposure {
    /// Time in microseconds, the counter of the temporal noise.
    pub(crate) counter: u64,
    /// Share of the last state that is left.
    pub(crate) decay: f64,
    /// Share of the signal's change since the last image by which the state is behind.
    pub(crate) behind: f64,
    /// Number of shutter corrections since time 0.
    pub(crate) shutter: u32,
    /// Time since the last correction [s].
    pub(crate) age: f64,
}

impl Sensor {
    /// A sensor without any effect but its digits, of this many bits from one brightness temperature to another [K].
    pub fn ideal(bits: u32, range: [f64; 2]) -> Self {
        Self {
            seed: 0,
            detector: Detector { serial: 0, bad_pixels: 0.0 },
            spread: None,
            halo: None,
            vignetting: None,
            optics: SensorOptics { transmission: 1.0, lens: None, housing: None },
            time_constant: None,
            noise: None,
            pattern: None,
            bits,
            range,
            kelvin_per_count: None,
            gain_control: GainControl::default(),
        }
    }

    /// The exposure at a time [s] after one at `last`. Without an earlier one the bolometer has settled.
    pub(crate) fn exposure(&self, time: f64, last: Option<f64>) -> Exposure {
        let shutter =
            self.pattern.and_then(|pattern| pattern.interval).map_or(0.0, |interval| (time / interval).floor());
        let interval = self.pattern.and_then(|pattern| pattern.interval).unwrap_or(0.0);
        let (decay, behind) = lag(self.time_constant, last.map(|last| time - last));
        Exposure {
            counter: (time * 1e6).round() as u64,
            decay,
            behind,
            shutter: shutter as u32,
            age: (time - shutter * interval).max(0.0),
        }
    }
}

/// Share of the bolometer's state that is left after an interval [s], and share of the signal's change by which the state is behind. The signal changes
/// evenly over the interval: y' = S' + (y - S) e^(-dt/tau) - (S' - S) (1 - e^(-dt/tau)) tau/dt solves tau dy/dt = S - y. So a ramp is behind by tau at any
/// rate of images. An interval that is not above 0 begins another sequence, so nothing is left.
pub(crate) fn lag(time_constant: Option<f64>, interval: Option<f64>) -> (f64, f64) {
    match (time_constant, interval) {
        (Some(constant), Some(interval)) if interval > 0.0 => {
            let intervals = interval / constant;
            ((-intervals).exp(), -(-intervals).exp_m1() / intervals)
        }
        _ => (0.0, 0.0),
    }
}

#[cfg(test)]
pub(crate) mod tests;
