//! The fixed pose of a camera: its rotation.

use glam::{DMat3, DQuat, DVec3};

use super::super::CameraFrame;
use super::super::error::SceneError;
use super::super::section::Section;
use super::super::vector::{direction, parallel, point, quaternion};

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
        return Err(section.error("look_at", "is the camera's own position: there is no direction to look in"));
    };
    let up = direction(section, "up")?.unwrap_or_else(|| {
        // +Z of the orbit frame points to nadir, so up is -Z.
        let (up, name) = match frame {
            CameraFrame::Orbit => (DVec3::NEG_Z, "[0, 0, -1]"),
            CameraFrame::Body | CameraFrame::Inertial => (DVec3::Z, "[0, 0, 1]"),
        };
        assumptions.push(format!("Up in the image is {name} of the camera's frame (camera.up is absent)."));
        up
    });
    if parallel(forward, up) {
        let message = format!("{up} is parallel to the view from position to look_at: state another up");
        return Err(section.error("up", message));
    }
    Ok(look(forward, up))
}

/// Rotation from OpenCV camera axes (+X right, +Y down, +Z forward). `up` must not be parallel to `forward`.
fn look(forward: DVec3, up: DVec3) -> DQuat {
    let right = forward.cross(up).normalize();
    DQuat::from_mat3(&DMat3::from_cols(right, forward.cross(right), forward)).normalize()
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use glam::DVec3;

    use super::look;

    #[test]
    fn axes_of_a_look_at_are_right_down_and_forward() {
        let rotation = look(DVec3::X, DVec3::new(0.3, 0.0, 1.0));
        // A camera that looks along +X with +Z up has +Y at its left.
        for (camera, frame) in [(DVec3::X, DVec3::NEG_Y), (DVec3::Y, DVec3::NEG_Z), (DVec3::Z, DVec3::X)] {
            assert_abs_diff_eq!((rotation * camera - frame).length(), 0.0, epsilon = 1e-15);
        }
        let upside_down = look(DVec3::X, DVec3::NEG_Z);
        assert!((upside_down * DVec3::X - DVec3::NEG_Y).length() > 1.0);
    }
}
