//! The metadata of an image in a file, and checks of the image.

use glam::DMat4;

use super::OutputError;
use super::finite::finite;
use crate::simulation::image::Image;
use crate::thermal::planck::Band;

/// Channels of a temperature from the ratio of two bands, and of its error.
pub(super) const TEMPERATURE: &str = "T_ratio";
pub(super) const TEMPERATURE_ERROR: &str = "T_ratio_error";

/// Refuses an image whose radiance, temperature or depth is not finite. `shown` says what a pixel shows.
///
/// # Errors
/// [`OutputError::NotFinite`] with step, pixel and what it shows.
pub(crate) fn check_finite(image: &Image, step: u32, shown: impl Fn(usize) -> String) -> Result<(), OutputError> {
    if let Some((what, pixel, value)) = image.not_finite() {
        let width = image.camera.width.max(1) as usize;
        let name =
            || format!("step {step}: the {what} in pixel ({}, {}) of {}", pixel % width, pixel / width, shown(pixel));
        finite(f64::from(value), name)?;
    }
    Ok(())
}

/// Refuses lists that do not fill the image.
pub(crate) fn check_size(image: &Image) -> Result<(), OutputError> {
    let optional = |list: &[f32]| if list.is_empty() { image.part.len() } else { list.len() };
    let pixels = image.part.len();
    let of_bands = image.bands.images.iter().map(|band| ("L of a band", band.radiance.len()));
    let of_ratio = image.bands.ratio.iter().flat_map(|ratio| [&ratio.temperature, &ratio.error]);
    let further: Vec<(&str, usize)> = of_bands.chain(of_ratio.map(|list| (TEMPERATURE, list.len()))).collect();
    check_channels(image.size(), &further)?;
    check_channels(
        image.size(),
        &[
            ("L", image.radiance.len()),
            ("T", image.temperature.len()),
            ("Z", image.depth.len()),
            ("part", image.part.len()),
            ("material", image.material.len()),
            ("coverage", optional(&image.coverage)),
            ("reflected", optional(&image.reflected)),
            ("T_error", optional(&image.error)),
            ("T_sigma", optional(&image.sigma.temperature)),
            ("L_sigma", optional(&image.sigma.radiance)),
            ("cause", if image.sigma.cause.is_empty() { pixels } else { image.sigma.cause.len() }),
            ("Q_sun", if image.budget.is_empty() { pixels } else { image.budget.len() }),
        ],
    )
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
    /// Name and ends of each `[[band]]`.
    pub bands: Vec<(String, Band)>,
    /// Number of the step; 0 is the initial state. An image at its own time lies in the interval of this step.
    pub step: u32,
    /// Number of an image at its own time. `None` at the end of a step.
    pub image: Option<u32>,
    /// Camera pose: maps orbit coordinates to camera coordinates (OpenCV axes) [m]. Its origin is that of the body frame. `None` in a file of an earlier version.
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
