//! The pose of the scene's camera at a time, and the moments of an image that is not taken in one instant.

use glam::DAffine3;

use super::engine::InstantPoses;
use super::prepare::Prepared;
use super::surroundings::surroundings_at;
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

/// Moments of an image at a time [s], with its number where it has its own time; `None` where it is of one instant.
pub fn moments(prepared: &Prepared, time: f64, image: Option<u32>) -> Option<impl Fn(f64) -> InstantPoses + '_> {
    let camera = prepared.scene.camera.as_ref()?;
    let moment = move |later: f64| {
        let at = time + later;
        let pose = pose_of(prepared, at, image).unwrap_or_default();
        InstantPoses {
            pose,
            joints: prepared.loads.joints_at(at).1,
            surroundings: surroundings_at(prepared, at, &pose),
            camera_from_orbit: pose.matrix3 * prepared.loads.sky_model().sky(at).body_from_orbit,
        }
    };
    (camera.line_time > 0.0 || camera.exposure.is_mean()).then_some(moment)
}
