//! An image as bytes: a header in JSON, and planes of whole numbers.
//!
//! `ISOT`, the length of the header as u32, the header, and the planes that it lists. Header and planes each fill up a multiple of 4 bytes. All numbers are
//! little-endian.

use serde::Serialize;

use crate::simulation::image::ImageSigma;

/// The first bytes of an image.
pub(crate) const MAGIC: &[u8; 4] = b"ISOT";

/// Finest step between two temperatures [K].
const FINEST: f64 = 0.01;

/// Finest step between two errors of temperatures [K].
const FINEST_ERROR: f64 = 1e-4;

/// The quantity of a plane, and how its numbers are read.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Plane {
    /// `temperature`, `error`, `sigma`, `apparent`, `counts`, `part`, `material`, `cause`, or a cause of the budget.
    pub(crate) name: &'static str,
    /// Bytes of a number: 1 or 2.
    pub(crate) bytes: usize,
    /// The value is this many times the number, and the offset.
    pub(crate) scale: f64,
    pub(crate) offset: f64,
}

/// Finest step between two gains of a budget [W/m2].
const FINEST_GAIN: f64 = 0.01;

/// Planes with their bytes.
#[derive(Debug, Default)]
pub(crate) struct Planes {
    /// The quantity of each plane.
    pub(crate) listed: Vec<Plane>,
    bytes: Vec<u8>,
}

impl Planes {
    /// Adds temperatures [K]. The step between two numbers is 0.01 K below 655 K, and twice, four times ... as much where an image is hotter.
    pub(crate) fn temperatures(&mut self, name: &'static str, values: &[f32]) {
        self.scaled(name, values, FINEST);
    }

    /// Adds errors of temperatures [K]. The step between two numbers is 0.1 mK below 6.5 K, and twice, four times ... as much where an error is larger.
    pub(crate) fn errors(&mut self, name: &'static str, values: &[f32]) {
        self.scaled(name, values, FINEST_ERROR);
    }

    /// Adds the uncertainty of temperatures [K], and its causes.
    pub(crate) fn uncertainty(&mut self, sigma: &ImageSigma) {
        self.errors("sigma", &sigma.temperature);
        self.labels("cause", &sigma.cause, sigma.cause.iter().copied().max().unwrap_or(0) as usize);
    }

    /// Adds the gains by a cause of the budget [W/m2]. The step between two numbers is 0.01 W/m2 up to 327 W/m2, and twice, four times ... as much where a gain is larger.
    pub(crate) fn gains(&mut self, name: &'static str, values: impl Iterator<Item = f32> + Clone) {
        let half = f64::from(i16::MAX);
        let most = values.clone().map(|value| f64::from(value.abs())).fold(0.0, f64::max);
        let mut scale = FINEST_GAIN;
        while most > scale * half && scale < 1e30 {
            scale *= 2.0;
        }
        let numbers = values.map(|value| (f64::from(value) / scale + half).round() as u16);
        self.words(Plane { name, bytes: 2, scale, offset: -half * scale }, numbers);
    }

    fn scaled(&mut self, name: &'static str, values: &[f32], finest: f64) {
        let most = f64::from(values.iter().copied().fold(0.0, f32::max));
        let mut scale = finest;
        while most > scale * f64::from(u16::MAX) && scale < 1e30 {
            scale *= 2.0;
        }
        let rounded = values.iter().map(|value| (f64::from(*value) / scale).round() as u16);
        self.words(Plane { name, bytes: 2, scale, offset: 0.0 }, rounded);
    }

    pub(crate) fn counts(&mut self, values: &[u16]) {
        self.words(Plane { name: "counts", bytes: 2, scale: 1.0, offset: 0.0 }, values.iter().copied());
    }

    /// Adds labels up to `count`. Each takes a byte where all of them fit, and two bytes otherwise.
    pub(crate) fn labels(&mut self, name: &'static str, values: &[u32], count: usize) {
        if count < 256 {
            self.listed.push(Plane { name, bytes: 1, scale: 1.0, offset: 0.0 });
            self.bytes.extend(values.iter().map(|value| *value as u8));
            self.fill();
        } else {
            let short = values.iter().map(|value| u16::try_from(*value).unwrap_or(u16::MAX));
            self.words(Plane { name, bytes: 2, scale: 1.0, offset: 0.0 }, short);
        }
    }

    fn words(&mut self, plane: Plane, values: impl Iterator<Item = u16>) {
        self.listed.push(plane);
        self.bytes.extend(values.flat_map(u16::to_le_bytes));
        self.fill();
    }

    fn fill(&mut self) {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
    }

    pub(crate) fn packet(&self, header: &str) -> Vec<u8> {
        let length = header.len().next_multiple_of(4);
        let mut packet = Vec::with_capacity(8 + length + self.bytes.len());
        packet.extend_from_slice(MAGIC);
        packet.extend_from_slice(&(length as u32).to_le_bytes());
        packet.extend_from_slice(header.as_bytes());
        packet.resize(8 + length, b' ');
        packet.extend_from_slice(&self.bytes);
        packet
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_has_its_parts_in_order() {
        let mut planes = Planes::default();
        planes.temperatures("temperature", &[0.0, 300.004, 655.35]);
        planes.labels("part", &[0, 1, 255], 255);
        planes.labels("material", &[0, 1, 300], 300);
        let packet = planes.packet("{}");
        assert_eq!(&packet[..12], b"ISOT\x04\0\0\0{}  ");
        let words: Vec<u16> = packet[12..18].chunks(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
        assert_eq!(words, [0, 30000, 65535]);
        assert_eq!(&packet[20..24], [0, 1, 255, 0]);
        assert_eq!(&packet[24..], [0, 0, 1, 0, 44, 1, 0, 0]);
        assert_eq!(planes.listed.iter().map(|plane| plane.bytes).collect::<Vec<_>>(), [2, 1, 2]);
    }

    #[test]
    fn gains_have_signs() {
        let mut planes = Planes::default();
        planes.gains("Q_sun", [-327.0f32, 0.0, 100.0].into_iter());
        planes.gains("Q_emitted", [-500.0f32].into_iter());
        assert_eq!(planes.listed.iter().map(|plane| plane.scale).collect::<Vec<_>>(), [0.01, 0.02]);
        let numbers: Vec<f64> =
            planes.bytes.chunks(2).map(|pair| f64::from(u16::from_le_bytes([pair[0], pair[1]]))).collect();
        let value = |plane: usize, number: f64| planes.listed[plane].scale * number + planes.listed[plane].offset;
        for (plane, place, known) in [(0, 0, -327.0), (0, 1, 0.0), (0, 2, 100.0), (1, 4, -500.0)] {
            assert!((value(plane, numbers[place]) - known).abs() < 0.011, "{known}");
        }
    }

    #[test]
    fn a_hot_image_has_coarser_steps() {
        let mut planes = Planes::default();
        planes.temperatures("temperature", &[1200.0]);
        assert_eq!(planes.listed[0].scale, 0.02);
        assert_eq!(planes.bytes[..2], 60000u16.to_le_bytes());
    }
}
