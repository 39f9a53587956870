//! An image as plain lists of numbers, one for each quantity.

use std::sync::Arc;

use glam::DAffine3;

use crate::raster::changes::PixelChanges;
use crate::scene::Camera;
use crate::thermal::budget::CAUSES;

/// Uncertainty of the pixels of an image by the ranges of parameters.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImageSigma {
    /// One standard deviation of the temperature [K].
    pub temperature: Vec<f32>,
    /// One standard deviation of the radiance [W m-2 sr-1].
    pub radiance: Vec<f32>,
    /// The parameter that contributes most to the temperature: its index + 1, or 0 where none does.
    pub cause: Vec<u32>,
    /// Names of the parameters.
    pub causes: Arc<Vec<String>>,
}

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
    /// One standard deviation of the temperature's error [K]. Empty where the scene does not ask for it.
    pub error: Vec<f32>,
    /// Budget: what the surface gains by each cause [W/m2], in the order of `thermal::budget::CHANNELS`. Empty where the scene does not ask for it.
    pub budget: Vec<[f32; CAUSES]>,
    /// Uncertainty by the ranges of parameters. Its lists are empty where the scene does not ask for it.
    pub sigma: ImageSigma,
    /// Digital numbers of the sensor. `None` without one.
    pub digital_numbers: Option<Vec<u16>>,
    /// Counts of the sensor's radiometric output (`kelvin_per_count`). `None` where it has none.
    pub counts: Option<Vec<u16>>,
    /// What the camera sees in several bands.
    pub bands: BandImages,
    /// What light of their own adds to the temperatures of pixels. `None` where all pixels show their nodes.
    pub changes: Option<Arc<PixelChanges>>,
}

/// What a camera with several bands sees.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BandImages {
    /// The images of the bands, in the order of the scene. Empty without `[[band]]`.
    pub images: Vec<BandImage>,
    /// Temperatures from the ratio of two bands, where the scene asks for them.
    pub ratio: Option<RatioImage>,
}

/// What a camera sees in one of its bands.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BandImage {
    /// Radiance in the band [W m-2 sr-1].
    pub radiance: Vec<f32>,
    /// Digital numbers of the band's sensor. `None` without one.
    pub digital_numbers: Option<Vec<u16>>,
    /// Counts of its radiometric output. `None` where it has none.
    pub counts: Option<Vec<u16>>,
}

/// Temperatures from the ratio of two bands. Both are 0 in a pixel whose ratio tells none.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RatioImage {
    /// Temperature of a grey body [K].
    pub temperature: Vec<f32>,
    /// One standard deviation of its error by the noise of both bands [K].
    pub error: Vec<f32>,
}

impl Image {
    /// An image without pixels, at a time [s].
    pub fn blank(camera: Camera, camera_from_body: DAffine3, time: f64) -> Self {
        Self {
            time,
            camera,
            camera_from_body,
            radiance: Vec::new(),
            temperature: Vec::new(),
            depth: Vec::new(),
            part: Vec::new(),
            material: Vec::new(),
            coverage: Vec::new(),
            reflected: Vec::new(),
            error: Vec::new(),
            budget: Vec::new(),
            sigma: ImageSigma::default(),
            digital_numbers: None,
            counts: None,
            bands: BandImages::default(),
            changes: None,
        }
    }

    /// Takes what the sensor reads: digital number and count of each pixel.
    pub(crate) fn with_readings(self, readings: Option<&[[u16; 2]]>) -> Self {
        let reading = |i: usize| readings.map(|all| all.iter().map(|pixel| pixel[i]).collect());
        Self { digital_numbers: reading(0), counts: reading(1), ..self }
    }

    /// Radiance, temperature and depth of a pixel.
    pub fn values(&self, pixel: usize) -> [f32; 3] {
        [self.radiance[pixel], self.temperature[pixel], self.depth[pixel]]
    }

    /// Part and material of a pixel, each plus 1.
    pub fn labels(&self, pixel: usize) -> [u32; 2] {
        [self.part[pixel], self.material[pixel]]
    }

    /// Smallest and largest finite temperature of a surface [K]. `None` without surfaces.
    pub fn range(&self) -> Option<[f32; 2]> {
        let shown = self.temperature.iter().zip(&self.part).filter(|(value, part)| **part != 0 && value.is_finite());
        shown.map(|(&value, _)| [value, value]).reduce(|[low, high], [least, most]| [low.min(least), high.max(most)])
    }

    /// Width and height in pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.camera.width, self.camera.height]
    }

    /// The first number that is not finite: radiance, temperature or depth, its pixel, and itself.
    pub(crate) fn not_finite(&self) -> Option<(&'static str, usize, f32)> {
        let lists = [("radiance", &self.radiance), ("temperature", &self.temperature), ("depth", &self.depth)];
        // Without a way out in the middle a processor tests many values at once.
        let any = |values: &[f32]| values.iter().fold(false, |any, value| any | !value.is_finite());
        lists.into_iter().filter(|(_, values)| any(values)).find_map(|(name, values)| {
            let (pixel, value) = values.iter().enumerate().find(|(_, value)| !value.is_finite())?;
            Some((name, pixel, *value))
        })
    }
}
