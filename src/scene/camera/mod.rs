//! `[camera]`: a pinhole camera and its pose or path.

mod lens;
mod path;
mod pose;

use std::path::PathBuf;
use std::sync::Arc;

use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use super::vector::point;
use super::{Camera, CameraFrame};

pub(super) use path::Around;
pub use path::{Poses, read_poses};

use super::motion::Motion;

/// Largest image side [px]. Vulkan devices commonly allow this much.
const MOST_PIXELS: u32 = 16384;

const FRAMES: [(&str, CameraFrame); 3] =
    [("body", CameraFrame::Body), ("orbit", CameraFrame::Orbit), ("inertial", CameraFrame::Inertial)];

pub(super) fn read(
    section: &Section,
    around: &Around<'_>,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Camera, SceneError> {
    let width = section.whole("width", 1..=MOST_PIXELS)?;
    let width = section.required("width", width, "the image's width in pixels")?;
    let height = section.whole("height", 1..=MOST_PIXELS)?;
    let height = section.required("height", height, "the image's height in pixels")?;
    let focal = lens::focal(section, width)?;
    let stated = section.choice("frame", &FRAMES)?;
    let path = path::read(section, stated, around, files, assumptions)?;
    let of_path = path.as_ref().and_then(|(frame, _)| *frame);
    let frame = stated.or(of_path).unwrap_or_else(|| {
        assumptions.push("The camera follows the craft (camera.frame is absent: 'body').".to_string());
        CameraFrame::Body
    });
    let (motion, position, frame_from_camera) = match path {
        Some((_, path)) => {
            let (position, rotation) = path.first();
            (Motion::Path(Arc::new(path)), position, rotation)
        }
        None => {
            let position = point(section, "position")?;
            let what = "where the camera is, [x, y, z] in its frame [m], or a camera.path";
            let position = section.required("position", position, what)?;
            (Motion::Still, position, pose::rotation(section, frame, position, assumptions)?)
        }
    };
    let near = section.number("near", Quantity::positive("m"))?.unwrap_or_else(|| {
        assumptions.push("Nothing nearer than 0.1 m to the camera is seen (camera.near is absent).".to_string());
        0.1
    });
    let centre = [f64::from(width) / 2.0, f64::from(height) / 2.0];
    Ok(Camera { width, height, focal: [focal; 2], centre, motion, frame, position, frame_from_camera, near })
}
