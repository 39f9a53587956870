//! The fixed pose of a camera: its rotation.

use glam::{DQuat, DVec3};

use super::super::CameraFrame;
use super::super::error::SceneError;
use super::super::section::Section;
use super::super::vector::{direction, parallel, point, quaternion};
use crate::environment::pose_path::look;

/// Rotation from camera axes to the camera's frame. The file states it as `quaternion`, or as `look_at` and `up`.
pub(super) fn rotation(
    section: &Section,
    frame: CameraFrame,
    position: DVec3,
    assumptions: &mut Vec<String>,
) -> Result<DQuat, SceneError> {
    section.exclusive("look_at", "quaternion")?;
    if let Some(rotation) = quaternion(section, "quaternion", assumptions)? {
        section.exclusive("quaternion", "up")?;
        return Ok(rotation);
    }
    let what = "the point that the camera looks at, or a quaternion [w, x, y, z]";
    let target = section.required("look_at", point(section, "look_at")?, what)?;
    let Some(forward) = (target - position).try_normalize() else {
        return Err(section.clash(
            "look_at",
            &["position"],
            "is the camera's own position: there is no direction to look in",
        ));
    };
    let up = up(section, frame, assumptions)?;
    if parallel(forward, up) {
        let message = format!("{up} is parallel to the view from position to look_at: state another up");
        return Err(section.clash("up", &["position", "look_at", "frame"], message));
    }
    Ok(look(forward, up))
}

/// The direction that is up in the image, in the camera's frame.
pub(super) fn up(section: &Section, frame: CameraFrame, assumptions: &mut Vec<String>) -> Result<DVec3, SceneError> {
    Ok(direction(section, "up")?.unwrap_or_else(|| {
        // +Z of the orbit frame points to nadir, so up is -Z.
        let (up, name) = match frame {
            CameraFrame::Orbit => (DVec3::NEG_Z, "[0, 0, -1]"),
            CameraFrame::Body | CameraFrame::Inertial => (DVec3::Z, "[0, 0, 1]"),
        };
        assumptions.push(format!("Up in the image is {name} of the camera's frame (camera.up is absent)."));
        up
    }))
}
