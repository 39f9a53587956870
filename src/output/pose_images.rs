//! Images from many poses of one thermal state: steps a scene once, and writes an EXR and the files of a sensor for each pose.

use std::sync::atomic::AtomicBool;

use super::folder::Folder;
use super::frame_maker::FrameMaker;
use super::frame_writer::write_frame;
use super::image_index::{IMAGES, write_index};
use super::job_terms::JobError;
use super::sensor_files::{SensorFiles, sensed_scenes};
use super::sigma::RunSigma;
use crate::simulation::engine::{Engine, EngineError};
use crate::simulation::prepare::Prepared;
use crate::simulation::uncertainty::{Uncertainty, UncertaintyState};
use crate::simulation::{StepResult, run};

pub(crate) const FILES: [&str; 4] = ["frames/image_#.exr", "frames/image_#.json", "frames/image_#_*", IMAGES];

/// Draws the images of a scene whose images have their own times and poses, from the state at time 0 on. Returns whether all were drawn before `stop` was
/// set. `errors` belong to the state at time 0, where it has them. `sigma` is the uncertainty of these images, where the scene asks for it. `drawn` is called after each image.
///
/// # Errors
/// A call that fails, a full disk, or errors of another scene.
pub(crate) fn write_pose_images(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    folder: &Folder,
    (errors, sigma): (Option<&UncertaintyState>, Option<&RunSigma>),
    stop: &AtomicBool,
    drawn: &mut dyn FnMut(),
) -> Result<bool, JobError> {
    let Some(camera) = &prepared.scene.camera else { return Ok(true) };
    let maker = FrameMaker::new(prepared, &engine.device_name());
    let mut written = Vec::new();
    let sensed = sensed_scenes(&prepared.scene);
    let of_sensors = SensorFiles::all(&sensed);
    let mut uncertainty = Uncertainty::asked(prepared, errors).map_err(EngineError::from)?;
    let mut take = |mut result: StepResult| {
        if let Some(uncertainty) = &mut uncertainty {
            uncertainty.follow(&mut result);
        }
        if let Some((mut image, header)) = maker.frame(result)? {
            sigma.inspect(|sigma| sigma.add_to(&mut image, &header));
            written.push(write_frame(folder, &of_sensors, &image, &header)?);
            drawn();
        }
        Ok::<_, JobError>(())
    };
    let complete = run(prepared, engine, None, stop, &mut take)?;
    write_index(folder, &prepared.scene.time, camera, &written)?;
    Ok(complete)
}
