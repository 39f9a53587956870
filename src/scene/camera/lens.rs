//! The lens of a camera: its focal length.

use super::super::error::SceneError;
use super::super::preset::Preset;
use super::super::quantity::Quantity;
use super::super::section::Section;

/// Focal length [px]. The file states it in one of three ways.
pub(super) fn focal(section: &Section, preset: Option<&Preset>, width: u32) -> Result<f64, SceneError> {
    section.exclusive("fov_deg", "focal_length")?;
    section.exclusive("fov_deg", "focal_px")?;
    section.exclusive("focal_length", "focal_px")?;
    let stated = section.number("pixel_pitch", Quantity::positive("m"))?;
    let pitch = stated.or(preset.and_then(|preset| preset.pitch));
    if let Some(length) = section.number("focal_length", Quantity::positive("m"))? {
        let pitch = section.required("pixel_pitch", pitch, "focal_length needs the distance between pixels [m]")?;
        return Ok(length / pitch);
    }
    if stated.is_some() {
        return Err(section.error("pixel_pitch", "needs focal_length, which is missing"));
    }
    if let Some(pixels) = section.number("focal_px", Quantity::positive("pixels"))? {
        return Ok(pixels);
    }
    let fov = section.number("fov_deg", Quantity::between(0.0, 180.0, "deg"))?;
    let fov = fov.or(preset.and_then(|preset| preset.fov_deg));
    let what = "the horizontal field of view [deg], or focal_length and pixel_pitch [m], or focal_px";
    let fov = section.required("fov_deg", fov, what)?;
    Ok(f64::from(width) / 2.0 / (fov.to_radians() / 2.0).tan())
}
