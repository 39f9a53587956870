//! An image as plain lists of numbers, one for each quantity.

use glam::DAffine3;

use super::engine::Pixels;
use crate::scene::Camera;

/// What a camera sees at one moment. Rows run from top to bottom, pixels from left to right. A pixel without a surface is 0 in every list but the
/// radiance, which is that of the sky where the scene has one. `part == 0` is the test for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Time since the start [s].
    pub time: f64,
    /// The camera with its pose at this time. Its size is that of the lists.
    pub camera: Camera,
    /// The same pose: takes body positions into camera axes (OpenCV) [m].
    pub camera_from_body: DAffine3,
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
    /// Share of the samples of a pixel that show a surface. Empty with one sample of a pixel.
    pub coverage: Vec<f32>,
    /// The part of the radiance that is reflected [W m-2 sr-1]. Empty where the scene does not ask for it.
    pub reflected: Vec<f32>,
    /// Digital numbers of the sensor. `None` without one.
    pub digital_numbers: Option<Vec<u16>>,
    /// Counts of the sensor's radiometric output (`kelvin_per_count`). `None` where it has none.
    pub counts: Option<Vec<u16>>,
}

impl Image {
    /// The image of a camera at a time [s] from its pixels.
    pub fn new(camera: Camera, camera_from_body: DAffine3, time: f64, pixels: Pixels) -> Self {
        let channel = |i: usize| pixels.radiance_temperature_depth.iter().map(|pixel| pixel[i]).collect();
        let label = |i: usize| pixels.identity.iter().map(|pixel| pixel[i]).collect();
        let reading = |i: usize| pixels.readings.as_ref().map(|all| all.iter().map(|pixel| pixel[i]).collect());
        Self {
            time,
            camera,
            camera_from_body,
            radiance: channel(0),
            temperature: channel(1),
            depth: channel(2),
            part: label(0),
            material: label(1),
            digital_numbers: reading(0),
            counts: reading(1),
            coverage: pixels.coverage,
            reflected: pixels.reflected,
        }
    }

    /// Width and height in pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.camera.width, self.camera.height]
    }

    /// The first pixel of a surface whose radiance, temperature or depth is not finite, and which of them it is.
    pub(crate) fn not_finite(&self) -> Option<(&'static str, usize)> {
        not_finite(&self.radiance, &self.temperature, &self.depth).map(|(what, pixel, _)| (what, pixel))
    }
}

/// The first number of an image that is not finite: its name, its pixel, and itself.
pub(crate) fn not_finite(radiance: &[f32], temperature: &[f32], depth: &[f32]) -> Option<(&'static str, usize, f32)> {
    [("radiance", radiance), ("temperature", temperature), ("depth", depth)].into_iter().find_map(|(name, values)| {
        let (pixel, value) = values.iter().enumerate().find(|(_, value)| !value.is_finite())?;
        Some((name, pixel, *value))
    })
}
