//! The pose of the scene's camera at a time, and the moments of the rows of its images.

use glam::DAffine3;

use super::engine::InstantPoses;
use super::prepare::Prepared;
use super::viewpoint::camera_from_body;

/// Pose of the camera at a time [s]; `None` where the scene has no camera, or its path has no pose then.
pub fn pose_at(prepared: &Prepared, time: f64) -> Option<DAffine3> {
    pose_of(prepared, time, None)
}

/// The same for an image at its own time.
pub(crate) fn pose_of(prepared: &Prepared, time: f64, image: Option<u32>) -> Option<DAffine3> {
    let camera = prepared.scene.camera.as_ref()?.at(time, image).ok()?;
    Some(camera_from_body(&camera, &prepared.loads.sky_model().sky(time)))
}

/// Moments of the rows of an image at a time [s], with its number where it has its own time; `None` where all rows see one pose.
pub fn moments(prepared: &Prepared, time: f64, image: Option<u32>) -> Option<impl Fn(f64) -> InstantPoses + '_> {
    let line_time = prepared.scene.camera.as_ref()?.line_time;
    let moment = move |row: f64| {
        let at = time + row * line_time;
        InstantPoses { pose: pose_of(prepared, at, image).unwrap_or_default(), joints: prepared.loads.joints_at(at).1 }
    };
    (line_time > 0.0).then_some(moment)
}
