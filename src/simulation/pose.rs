//! The place of a camera for one image.

use glam::{DQuat, DVec3};

use crate::environment::pose_path::look;
use crate::lens::LensError;
use crate::scene::{Camera, CameraFrame, Motion, MotionBlur};

/// Pose of a camera for one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pose {
    /// The pose or the path that the camera has itself.
    OfCamera,
    /// A pose in a frame with its origin moved to the origin of the craft's body frame.
    Given {
        /// The frame.
        frame: CameraFrame,
        /// Position [m].
        position: DVec3,
        /// Rotates camera axes (OpenCV: +X right, +Y down, +Z forward) into the frame.
        frame_from_camera: DQuat,
    },
}

/// Why a camera has no image.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// A number that is out of range.
    #[error("camera: {what} must be {range}, not {value}")]
    Range {
        /// Name of the number.
        what: &'static str,
        /// The allowed range, in words.
        range: &'static str,
        /// The refused value.
        value: String,
    },
    /// A pose that is not finite, or a rotation that is none.
    #[error("camera: {0}")]
    Pose(&'static str),
    /// A lens that folds the image.
    #[error("camera: {0}")]
    Lens(#[from] LensError),
    /// A combination with other settings of the scene.
    #[error("camera: {0}")]
    Combination(&'static str),
}

/// Largest side of an image [px], as in a scene file.
const MOST_PIXELS: u32 = 16384;
/// Numbers of samples of a pixel.
const SAMPLES: [u32; 4] = [1, 4, 8, 16];
/// Deviation of a quaternion's length from 1 that counts as rounding.
const LENGTH_TOLERANCE: f64 = 1e-3;
/// Sine of the angle below which the line of sight counts as parallel to the direction that is up in the image.
const PARALLEL: f64 = 1e-6;

impl Pose {
    /// A pose in a frame: position [m] and a rotation of camera axes (OpenCV) into the frame, which is normalised.
    ///
    /// # Errors
    /// A number that is not finite, or a quaternion whose length is not 1.
    pub fn new(frame: CameraFrame, position: DVec3, frame_from_camera: DQuat) -> Result<Self, CameraError> {
        if !position.is_finite() {
            return Err(CameraError::Pose("its position must be finite"));
        }
        if !frame_from_camera.is_finite() || (frame_from_camera.length() - 1.0).abs() > LENGTH_TOLERANCE {
            return Err(CameraError::Pose("its quaternion must have the length 1"));
        }
        Ok(Self::Given { frame, position, frame_from_camera: frame_from_camera.normalize() })
    }

    /// A camera at a position [m] that looks at a point [m], with a direction that is up in the image.
    ///
    /// # Errors
    /// A number that is not finite, or a line of sight along `up`.
    pub fn look_at(frame: CameraFrame, position: DVec3, point: DVec3, up: DVec3) -> Result<Self, CameraError> {
        if ![position, point, up].iter().all(|vector| vector.is_finite()) {
            return Err(CameraError::Pose(
                "its position, the point that it looks at and the direction that is up must be finite",
            ));
        }
        let directions = (point - position).try_normalize().zip(up.try_normalize());
        let directions = directions.filter(|(forward, up)| forward.cross(*up).length() > PARALLEL);
        let along = "it must look at a point that is not its own position, and not along the direction that is up";
        let (forward, up) = directions.ok_or(CameraError::Pose(along))?;
        Self::new(frame, position, look(forward, up))
    }

    /// The camera with this pose.
    pub(crate) fn of(&self, camera: &Camera) -> Camera {
        match *self {
            Self::OfCamera => camera.clone(),
            Self::Given { frame, position, frame_from_camera } => {
                Camera { motion: Motion::Still, frame, position, frame_from_camera, ..camera.clone() }
            }
        }
    }
}

/// Checks the numbers of a camera that no scene file has checked.
///
/// # Errors
/// The first number that is out of range, or a lens that folds the image.
pub fn check_camera(camera: &Camera) -> Result<(), CameraError> {
    let out = |what, range, value: String| Err(CameraError::Range { what, range, value });
    for (what, side) in [("width", camera.width), ("height", camera.height)] {
        if !(1..=MOST_PIXELS).contains(&side) {
            return out(what, "1 to 16384 pixels", side.to_string());
        }
    }
    if !SAMPLES.contains(&camera.samples) {
        return out("samples", "1, 4, 8 or 16", camera.samples.to_string());
    }
    let lens = &camera.lens;
    for (what, value) in
        [("the focal length", lens.focal[0]), ("the focal length", lens.focal[1]), ("near", camera.near)]
    {
        if !(value.is_finite() && value > 0.0) {
            return out(what, "finite and above 0", value.to_string());
        }
    }
    for (what, value) in
        [("the principal point", lens.centre[0]), ("the principal point", lens.centre[1]), ("skew", lens.skew)]
    {
        if !value.is_finite() {
            return out(what, "finite", value.to_string());
        }
    }
    if !(0.0..=1.0).contains(&camera.line_time) {
        return out("line_time", "0 to 1 s", camera.line_time.to_string());
    }
    let MotionBlur { time, sub_frames } = camera.exposure;
    if !(0.0..=MotionBlur::LONGEST).contains(&time) {
        return out("exposure_time", "0 to 60 s", time.to_string());
    }
    if !(1..=MotionBlur::MOST).contains(&sub_frames) || sub_frames.is_multiple_of(2) {
        return out("sub_frames", "odd, 1 to 101", sub_frames.to_string());
    }
    if !lens.is_pinhole() {
        lens.field([camera.width, camera.height])?;
    }
    Ok(())
}

/// Whether the resources for the image of one camera also serve another. `any_lens` says that nothing but the projection depends on the lens.
pub(crate) fn draws_alike(one: &Camera, other: &Camera, any_lens: bool) -> bool {
    let image = |camera: &Camera| (camera.width, camera.height, camera.samples, camera.line_time, camera.exposure);
    let lens = one.lens == other.lens || (any_lens && one.lens.is_pinhole() && other.lens.is_pinhole());
    image(one) == image(other) && lens
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_looks_where_it_is_told() {
        let pose = Pose::look_at(CameraFrame::Body, DVec3::X * 4.0, DVec3::ZERO, DVec3::Z).expect("a pose");
        let Pose::Given { position, frame_from_camera, .. } = pose else { panic!("a given pose") };
        assert_eq!(position, DVec3::X * 4.0);
        assert!((frame_from_camera * DVec3::Z).distance(DVec3::NEG_X) < 1e-12);
        for (position, up) in [(DVec3::ZERO, DVec3::Z), (DVec3::Z, DVec3::Z), (DVec3::NAN, DVec3::Z)] {
            assert!(Pose::look_at(CameraFrame::Body, position, DVec3::ZERO, up).is_err());
        }
        assert!(Pose::new(CameraFrame::Body, DVec3::ZERO, DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0)).is_err());
        assert!(Pose::new(CameraFrame::Body, DVec3::ZERO, DQuat::from_xyzw(0.0, 0.0, 0.0, 1.0005)).is_ok());
    }
}
