//! `[camera]`: a pinhole camera and its pose.

use glam::{DMat3, DQuat, DVec3};

use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use super::vector::{direction, parallel, point, quaternion};
use super::{Camera, CameraFrame};

/// Largest image side [px]. Vulkan devices commonly allow this much.
const MOST_PIXELS: u32 = 16384;

const FRAMES: [(&str, CameraFrame); 3] =
    [("body", CameraFrame::Body), ("orbit", CameraFrame::Orbit), ("inertial", CameraFrame::Inertial)];

pub(super) fn read(section: &Section, assumptions: &mut Vec<String>) -> Result<Camera, SceneError> {
    let width = section.whole("width", 1..=MOST_PIXELS)?;
    let width = section.required("width", width, "the image's width in pixels")?;
    let height = section.whole("height", 1..=MOST_PIXELS)?;
    let height = section.required("height", height, "the image's height in pixels")?;
    let focal = focal(section, width)?;
    let frame = section.choice("frame", &FRAMES)?.unwrap_or_else(|| {
        assumptions.push("The camera follows the craft (camera.frame is absent: 'body').".to_string());
        CameraFrame::Body
    });
    let position = point(section, "position")?;
    let position = section.required("position", position, "where the camera is, [x, y, z] in its frame [m]")?;
    let frame_from_camera = rotation(section, frame, position, assumptions)?;
    let near = section.number("near", Quantity::positive("m"))?.unwrap_or_else(|| {
        assumptions.push("Nothing nearer than 0.1 m to the camera is seen (camera.near is absent).".to_string());
        0.1
    });
    let centre = [f64::from(width) / 2.0, f64::from(height) / 2.0];
    Ok(Camera { width, height, focal: [focal; 2], centre, frame, position, frame_from_camera, near })
}

/// Focal length [px]. The file states it in one of three ways.
fn focal(section: &Section, width: u32) -> Result<f64, SceneError> {
    section.exclusive("fov_deg", "focal_length")?;
    section.exclusive("fov_deg", "focal_px")?;
    section.exclusive("focal_length", "focal_px")?;
    let pitch = section.number("pixel_pitch", Quantity::positive("m"))?;
    if let Some(length) = section.number("focal_length", Quantity::positive("m"))? {
        let pitch = section.required("pixel_pitch", pitch, "focal_length needs the distance between pixels [m]")?;
        return Ok(length / pitch);
    }
    if pitch.is_some() {
        return Err(section.error("pixel_pitch", "needs focal_length, which is missing"));
    }
    if let Some(pixels) = section.number("focal_px", Quantity::positive("pixels"))? {
        return Ok(pixels);
    }
    let fov = section.number("fov_deg", Quantity::between(0.0, 180.0, "deg"))?;
    let what = "the horizontal field of view [deg], or focal_length and pixel_pitch [m], or focal_px";
    let fov = section.required("fov_deg", fov, what)?;
    Ok(f64::from(width) / 2.0 / (fov.to_radians() / 2.0).tan())
}

fn rotation(
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
