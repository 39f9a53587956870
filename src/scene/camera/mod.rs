//! `[camera]`: a camera with its lens, its pose or path, and the samples of a pixel.

mod lens;
mod path;
mod pose;

use std::path::PathBuf;
use std::sync::Arc;

use super::error::SceneError;
use super::preset::Preset;
use super::quantity::Quantity;
use super::section::Section;
use super::vector::point;
use super::{Camera, CameraFrame};

pub(super) use path::PathOrbit;
pub(crate) use path::{Poses, read_poses};

use super::motion::Motion;

/// Largest image side [px]. Vulkan devices commonly allow this much.
const MOST_PIXELS: u32 = 16384;

const SAMPLES: [u32; 4] = [1, 4, 8, 16];

const FRAMES: [(&str, CameraFrame); 3] =
    [("body", CameraFrame::Body), ("orbit", CameraFrame::Orbit), ("inertial", CameraFrame::Inertial)];

pub(super) fn read(
    section: &Section,
    preset: Option<&Preset>,
    around: &PathOrbit<'_>,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Camera, SceneError> {
    let width = section.whole("width", 1..=MOST_PIXELS)?.or(preset.map(|preset| preset.size[0]));
    let width = section.required("width", width, "the image's width in pixels")?;
    let height = section.whole("height", 1..=MOST_PIXELS)?.or(preset.map(|preset| preset.size[1]));
    let height = section.required("height", height, "the image's height in pixels")?;
    let lens = lens::read(section, preset, [width, height], assumptions)?;
    let samples = section.whole("samples", 1..=16)?.unwrap_or(1);
    if !SAMPLES.contains(&samples) {
        return Err(section.error("samples", format!("must be 1, 4, 8 or 16, found {samples}")));
    }
    let line_time = section.number("line_time", Quantity::within(0.0, 1.0, "s"))?.unwrap_or(0.0);
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
    Ok(Camera { width, height, lens, samples, line_time, motion, frame, position, frame_from_camera, near })
}
