//! `[camera]`: a pinhole camera and its pose.

mod lens;
mod pose;

use super::error::SceneError;
use super::preset::Preset;
use super::quantity::Quantity;
use super::section::Section;
use super::vector::point;
use super::{Camera, CameraFrame};

/// Largest image side [px]. Vulkan devices commonly allow this much.
const MOST_PIXELS: u32 = 16384;

const FRAMES: [(&str, CameraFrame); 3] =
    [("body", CameraFrame::Body), ("orbit", CameraFrame::Orbit), ("inertial", CameraFrame::Inertial)];

pub(super) fn read(
    section: &Section,
    preset: Option<&Preset>,
    assumptions: &mut Vec<String>,
) -> Result<Camera, SceneError> {
    let width = section.whole("width", 1..=MOST_PIXELS)?.or(preset.map(|preset| preset.size[0]));
    let width = section.required("width", width, "the image's width in pixels")?;
    let height = section.whole("height", 1..=MOST_PIXELS)?.or(preset.map(|preset| preset.size[1]));
    let height = section.required("height", height, "the image's height in pixels")?;
    let focal = lens::focal(section, preset, width)?;
    let frame = section.choice("frame", &FRAMES)?.unwrap_or_else(|| {
        assumptions.push("The camera follows the craft (camera.frame is absent: 'body').".to_string());
        CameraFrame::Body
    });
    let position = point(section, "position")?;
    let position = section.required("position", position, "where the camera is, [x, y, z] in its frame [m]")?;
    let frame_from_camera = pose::rotation(section, frame, position, assumptions)?;
    let near = section.number("near", Quantity::positive("m"))?.unwrap_or_else(|| {
        assumptions.push("Nothing nearer than 0.1 m to the camera is seen (camera.near is absent).".to_string());
        0.1
    });
    let centre = [f64::from(width) / 2.0, f64::from(height) / 2.0];
    Ok(Camera { width, height, focal: [focal; 2], centre, frame, position, frame_from_camera, near })
}
