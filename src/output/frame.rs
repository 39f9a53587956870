//! One image as plain arrays, and its metadata.

use glam::DMat4;

use super::OutputError;
use super::finite::finite;
use super::ticks::union;
use crate::scene::Camera;
use crate::simulation::image::not_finite;
use crate::thermal::planck::Band;

/// The camera's image at one step. Rows run from top to bottom, pixels from left to right. Pixels without a surface are
/// 0 in every channel but the radiance. Their radiance is the sky's where a scene has a sky, otherwise 0. `part == 0` is the test for them. With
/// `coverage`, a surface beside the centre of the pixel adds to the radiance.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Number of the step; 0 is the initial state. An image at its own time lies in the interval of this step.
    pub step: u32,
    /// Number of an image at its own time. `None` at the end of a step.
    pub image: Option<u32>,
    /// Time since the start [s].
    pub time: f64,
    /// Radiance in the band [W m-2 sr-1].
    pub radiance: Vec<f32>,
    /// Surface temperature [K].
    pub temperature: Vec<f32>,
    /// Distance along the camera's +Z [m].
    pub depth: Vec<f32>,
    /// Index of the part + 1.
    pub part: Vec<u32>,
    /// Index of the material + 1.
    pub material: Vec<u32>,
    /// Share of the samples of a pixel that show a surface. Empty with one sample of a pixel. With several, the radiance is the mean of all samples,
    /// and the other channels hold the value at the pixel's centre.
    pub coverage: Vec<f32>,
    /// The reflected part of the radiance [W m-2 sr-1]. `None` where the scene does not ask for it.
    pub reflected: Option<Vec<f32>>,
}

impl Frame {
    /// Smallest and largest finite temperature of a surface [K]. `None` without surfaces.
    pub fn range(&self) -> Option<[f32; 2]> {
        let hit = self.temperature.iter().zip(&self.part).filter(|(value, part)| **part != 0 && value.is_finite());
        hit.map(|(&value, _)| [value, value]).reduce(union)
    }

    /// Refuses a surface whose radiance, temperature or depth is not finite.
    ///
    /// # Errors
    /// [`OutputError::NotFinite`] with step, pixel and part.
    pub(crate) fn check_finite(&self) -> Result<(), OutputError> {
        self.check_finite_of(|pixel| format!("part number {}", self.part.get(pixel).copied().unwrap_or(0)))
    }

    /// Refuses the same pixels. `shown` names the part and node at a pixel.
    ///
    /// # Errors
    /// [`OutputError::NotFinite`] with step, pixel, part and node.
    pub(crate) fn check_finite_of(&self, shown: impl Fn(usize) -> String) -> Result<(), OutputError> {
        if let Some((what, pixel, value)) = not_finite(&self.radiance, &self.temperature, &self.depth) {
            let (x, y) = (pixel % self.width.max(1) as usize, pixel / self.width.max(1) as usize);
            let name = || format!("step {}: the {what} in pixel ({x}, {y}) of {}", self.step, shown(pixel));
            finite(f64::from(value), name)?;
        }
        Ok(())
    }

    /// Refuses channels that do not fill the image.
    pub(crate) fn check(&self) -> Result<(), OutputError> {
        check_channels(
            [self.width, self.height],
            &[
                ("L", self.radiance.len()),
                ("T", self.temperature.len()),
                ("Z", self.depth.len()),
                ("part", self.part.len()),
                ("material", self.material.len()),
                ("coverage", if self.coverage.is_empty() { self.part.len() } else { self.coverage.len() }),
                ("reflected", self.reflected.as_ref().map_or(self.part.len(), Vec::len)),
            ],
        )
    }
}

/// Refuses channels that do not fill an image of this size. Each channel has a name and a length.
pub(super) fn check_channels([width, height]: [u32; 2], channels: &[(&str, usize)]) -> Result<(), OutputError> {
    let pixels = width as usize * height as usize;
    match channels.iter().find(|(_, values)| *values != pixels || *values == 0) {
        None => Ok(()),
        Some((channel, values)) => {
            Err(OutputError::Mismatch(format!("frame {width}x{height}: channel {channel} has {values} values")))
        }
    }
}

/// The metadata of a frame. Most of it is the same for a whole run.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameHeader {
    pub(crate) scene: String,
    /// SHA-256 of the scene and its files (hexadecimal).
    pub scene_sha256: String,
    pub(crate) device: String,
    /// Version of isotherm.
    pub version: String,
    /// Spectral band.
    pub band: Band,
    /// Intrinsics, and the pose in the camera's own frame.
    pub camera: Camera,
    /// Camera pose at this step: maps body coordinates to camera coordinates (OpenCV axes) [m].
    pub camera_from_body: DMat4,
    /// The same for the orbit frame with its origin moved to the body frame's. `None` in a file of an earlier version.
    pub camera_from_orbit: Option<DMat4>,
    /// The same for the inertial frame with its origin moved to the body frame's. `None` in a file of an earlier version.
    pub camera_from_inertial: Option<DMat4>,
    /// Camera pose at the time of the last row. `None` if all rows see one pose.
    pub(crate) last_row_from_body: Option<DMat4>,
    /// Name and pose of each joint at this step: maps places of its parts in the model's file to body coordinates [m].
    pub joints: Vec<(String, DMat4)>,
    /// Names of the parts. The first has pixel value 1.
    pub parts: Vec<String>,
    /// Names of the materials. The first has pixel value 1.
    pub materials: Vec<String>,
}

#[cfg(test)]
pub(crate) mod tests;
