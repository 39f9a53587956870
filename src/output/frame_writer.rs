//! Writes the files of drawn frames on a thread of its own.

use std::sync::mpsc::{Receiver, SyncSender};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::OutputError;
use super::apparent::Apparent;
use super::exr::encode;
use super::folder::Folder;
use super::frame::FrameHeader;
use super::run_pictures::{WrittenFrame, frame_file, frame_stem};
use super::sensor_files::{SensorFiles, sensed_scenes};
use crate::scene::{ImageFile, Scene};
use crate::simulation::image::Image;
use crate::trace::span;

/// Work for the thread that writes files.
pub(super) enum WriterWork {
    Frame(Box<(Image, FrameHeader)>),
    /// Tell when all frames before are written.
    Tell(SyncSender<()>),
}

/// Writes frames as they come, and notes them in `written`.
///
/// # Errors
/// A file that can not be written.
pub(super) fn write_frames(
    scene: &Scene,
    folder: &Folder,
    waiting: Receiver<WriterWork>,
    written: &Mutex<Vec<WrittenFrame>>,
) -> Result<(), OutputError> {
    let sensed = sensed_scenes(scene);
    let of_sensors = SensorFiles::all(&sensed);
    let apparent = scene.images.files.contains(&ImageFile::ApparentPng).then(|| Apparent::new(scene.passband()));
    for work in waiting {
        let (image, header) = match work {
            WriterWork::Frame(frame) => *frame,
            WriterWork::Tell(done) => {
                // Nobody listens where the run has failed.
                let _ = done.send(());
                continue;
            }
        };
        let _writes = span("encoding and writing an image");
        let mut frame = write_frame(folder, &of_sensors, &image, &header)?;
        frame.apparent = apparent.as_ref().and_then(|apparent| apparent.range(&image));
        lock(written).push(frame);
    }
    Ok(())
}

/// Writes the files of an image.
///
/// # Errors
/// A file that can not be written.
pub(super) fn write_frame(
    folder: &Folder,
    of_sensors: &[SensorFiles<'_>],
    image: &Image,
    header: &FrameHeader,
) -> Result<WrittenFrame, OutputError> {
    let FrameHeader { step, image: number, .. } = *header;
    folder.write_bytes(&frame_file(step, number, "exr"), &encode(image, header)?)?;
    for of_sensor in of_sensors {
        of_sensor.write(folder, &frame_stem(step, number), image, step)?;
    }
    let at_end = of_sensors.iter().any(|of_sensor| of_sensor.is_at_end(image));
    Ok(WrittenFrame { step, image: number, range: image.range(), apparent: None, at_end })
}

/// The frames written so far.
pub(super) fn lock(written: &Mutex<Vec<WrittenFrame>>) -> MutexGuard<'_, Vec<WrittenFrame>> {
    written.lock().unwrap_or_else(PoisonError::into_inner)
}
