//! The sensor of a thermal camera: what its optics, its microbolometer and its digits make of the radiance of an image.
//!
//! The stages, in order: point spread and stray light ([`spread`], [`halo`]), vignetting and the optics' own emission, the lag of the
//! bolometer, noise and fixed pattern ([`noise`]), digital numbers, and temperatures from them ([`reading`]). [`twin`] joins them in f64.
//! [`gain_control`] maps digital numbers to the 8 bits of a display.
//!
//! The *signal* of a pixel is the radiance that arrives at the detector [W m-2 sr-1]: the scene's times the transmission of the lens, plus what the
//! optics emit.

pub mod gain_control;
pub mod halo;
pub mod noise;
pub mod reading;
pub mod spread;
pub mod twin;

use gain_control::GainControl;
use halo::Halo;
use spread::Spread;

/// Most pixels of an image with a sensor: one dispatch of 65,535 workgroups of 256 pixels.
pub const MOST_PIXELS: u64 = 65_535 * 256;

/// A sensor. What is `None` or 0 is absent.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Seed of all noise.
    pub seed: u32,
    /// Point spread of the optics and of the pixel.
    pub spread: Option<Spread>,
    /// Stray light (size-of-source effect).
    pub halo: Option<Halo>,
    /// Loss of light towards the corners.
    pub vignetting: Option<Vignetting>,
    /// What the optics pass and emit.
    pub optics: Optics,
    /// Thermal time constant of the bolometer [s].
    pub time_constant: Option<f64>,
    /// Temporal noise.
    pub noise: Option<Netd>,
    /// Fixed pattern.
    pub pattern: Option<Pattern>,
    /// Share of bad pixels. Half of them always read 0, and half the largest digital number.
    pub bad_pixels: f64,
    /// Bits of a digital number: 8, 14 or 16.
    pub bits: u32,
    /// Brightness temperatures at digital number 0 and at the largest one [K], in the middle of the image.
    pub range: [f64; 2],
    /// Brightness temperature of one count of the radiometric output [K].
    pub kelvin_per_count: Option<f64>,
    /// Mapping to 8 bits for a display.
    pub gain_control: GainControl,
}

/// Loss of light towards the corners.
#[derive(Debug, Clone, PartialEq)]
pub enum Vignetting {
    /// Fourth power of the cosine between the line of sight and the axis.
    Cos4,
    /// Share of the light that arrives at each pixel, above 0 and at most 1, row after row.
    Map(Vec<f64>),
}

/// What the optics pass and emit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optics {
    /// Share of the light that the lens passes. It emits the rest at its own temperature.
    pub transmission: f64,
    /// Temperature of the lens [K]. Without one it emits nothing.
    pub lens: Option<f64>,
    /// Temperature of the housing [K], which is seen where the image is vignetted. Without one it emits nothing.
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
    /// Time between corrections [s]. The first is at time 0. Without one there is no other.
    pub interval: Option<f64>,
    /// Temperature of the shutter [K], at which gains have no effect.
    pub shutter: f64,
}

/// What changes from image to image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// Time in microseconds, the counter of the temporal noise.
    pub counter: u64,
    /// Share of the last state that is left.
    pub decay: f64,
    /// Number of shutter corrections since time 0.
    pub shutter: u32,
    /// Time since the last correction [s].
    pub age: f64,
}

impl Sensor {
    /// A sensor without any effect but its digits, of this many bits from one brightness temperature to another [K].
    pub fn ideal(bits: u32, range: [f64; 2]) -> Self {
        Self {
            seed: 0,
            spread: None,
            halo: None,
            vignetting: None,
            optics: Optics { transmission: 1.0, lens: None, housing: None },
            time_constant: None,
            noise: None,
            pattern: None,
            bad_pixels: 0.0,
            bits,
            range,
            kelvin_per_count: None,
            gain_control: GainControl::default(),
        }
    }

    /// The exposure at a time [s] after one at `last`. Without an earlier one the bolometer has settled.
    pub fn exposure(&self, time: f64, last: Option<f64>) -> Exposure {
        let shutter =
            self.pattern.and_then(|pattern| pattern.interval).map_or(0.0, |interval| (time / interval).floor());
        let interval = self.pattern.and_then(|pattern| pattern.interval).unwrap_or(0.0);
        Exposure {
            counter: (time * 1e6).round() as u64,
            decay: decay(self.time_constant, last.map(|last| time - last)),
            shutter: shutter as u32,
            age: (time - shutter * interval).max(0.0),
        }
    }
}

/// Share of the bolometer's state that is left after an interval [s]. An interval that is not above 0 is that of another sequence, so nothing is left.
pub fn decay(time_constant: Option<f64>, interval: Option<f64>) -> f64 {
    match (time_constant, interval) {
        (Some(constant), Some(interval)) if interval > 0.0 => (-interval / constant).exp(),
        _ => 0.0,
    }
}

#[cfg(test)]
pub(crate) mod tests;
