//! `--poses`: a table of poses in place of the images of a scene.

use std::path::Path;

use super::error::CliError;
use crate::environment::trajectory::Trajectory;
use crate::scene::work::{too_late, too_many_images};
use crate::scene::{Draw, Motion, Poses, Scene, read_poses};
use crate::simulation::prepare_error::PrepareError;

/// Lets a scene draw an image for each pose of a table, and run as long as that takes.
pub(super) fn draw_at_poses(scene: &mut Scene, poses: &Path) -> Result<(), CliError> {
    scene.require_camera().map_err(PrepareError::from)?;
    let start = scene.orbit.trajectory().map(Trajectory::start).or(scene.time.start);
    let Poses { times, poses: listed } = read_poses(poses, start).map_err(PrepareError::from)?;
    let last = times.iter().copied().fold(0.0, f64::max);
    if let Some(reason) = too_late(last, scene.time.step, &scene.orbit) {
        return Err(PrepareError::Late { path: poses.to_path_buf(), reason }.into());
    }
    scene.files.push(poses.to_path_buf());
    scene.time.steps = ((last / scene.time.step - 1e-9).ceil() as u32).max(1);
    scene.time.draw = Draw::Times(times);
    if let Some(camera) = &mut scene.camera {
        if let Some(reason) = too_many_images(&scene.time, camera) {
            return Err(PrepareError::Late { path: poses.to_path_buf(), reason }.into());
        }
        camera.motion = Motion::Listed(listed.into());
    }
    Ok(())
}
