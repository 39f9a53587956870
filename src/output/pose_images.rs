//! Images from many poses of one thermal state: steps a scene once, and writes an EXR for each pose.

use std::sync::atomic::AtomicBool;

use super::exr::encode;
use super::folder::Folder;
use super::frame_maker::FrameMaker;
use super::image_index::{IMAGES, write_index};
use super::job::JobError;
use super::run_pictures::{WrittenFrame, frame_file};
use crate::simulation::engine::Engine;
use crate::simulation::prepare::Prepared;
use crate::simulation::{StepResult, run};

/// All files of the images.
pub const FILES: [&str; 2] = ["frames/image_#.exr", IMAGES];

/// Draws the images of a scene whose images have their own times and poses, from the state at time 0 on. Returns whether all were drawn before `stop` was
/// set. `drawn` is called after each image.
///
/// # Errors
/// A call that fails, or a full disk.
pub fn write_pose_images(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    folder: &Folder,
    stop: &AtomicBool,
    drawn: &mut dyn FnMut(),
) -> Result<bool, JobError> {
    let Some(camera) = &prepared.scene.camera else { return Ok(true) };
    let maker = FrameMaker::new(prepared, camera, &engine.device_name());
    let mut written = Vec::new();
    let mut take = |result: StepResult| {
        if let Some((frame, header)) = maker.frame(result)? {
            folder.write_bytes(&frame_file(frame.step, frame.image, "exr"), &encode(&frame, &header)?)?;
            written.push(WrittenFrame { step: frame.step, image: frame.image, range: frame.range() });
            drawn();
        }
        Ok::<_, JobError>(())
    };
    let complete = run(prepared, engine, None, stop, &mut take)?;
    write_index(folder, &prepared.scene.time, camera, &written)?;
    Ok(complete)
}
