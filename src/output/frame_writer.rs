//! Writes the files of drawn frames on a thread of its own.

use std::sync::mpsc::{Receiver, SyncSender};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::OutputError;
use super::apparent::Apparent;
use super::exr::encode;
use super::folder::Folder;
use super::frame::{Frame, FrameHeader};
use super::run_pictures::{WrittenFrame, frame_file, frame_stem};
use super::sensor_files::SensorFiles;
use crate::scene::{ImageFile, Scene};
use crate::trace::{Trace, Track};

/// Digital number and count of temperature of each pixel.
type Readings = Vec<[u16; 2]>;

/// Work for the thread that writes files.
pub(super) enum WriterWork {
    Frame(Box<(Frame, FrameHeader, Option<Readings>)>),
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
    trace: &Trace,
    waiting: Receiver<WriterWork>,
    written: &Mutex<Vec<WrittenFrame>>,
) -> Result<(), OutputError> {
    let of_sensor = SensorFiles::new(scene);
    let apparent = scene.images.files.contains(&ImageFile::ApparentPng).then(|| Apparent::new(scene.band));
    for work in waiting {
        let (frame, header, readings) = match work {
            WriterWork::Frame(frame) => *frame,
            WriterWork::Tell(done) => {
                // Nobody listens where the run has failed.
                let _ = done.send(());
                continue;
            }
        };
        let _writes = trace.span(Track::Writer, "write EXR");
        folder.write_bytes(&frame_file(frame.step, frame.image, "exr"), &encode(&frame, &header)?)?;
        if let Some((of_sensor, readings)) = of_sensor.as_ref().zip(readings) {
            of_sensor.write(folder, &frame_stem(frame.step, frame.image), &frame, &readings)?;
        }
        let apparent = apparent.as_ref().and_then(|apparent| apparent.range(&frame));
        lock(written).push(WrittenFrame { step: frame.step, image: frame.image, range: frame.range(), apparent });
    }
    Ok(())
}

/// The frames written so far.
pub(super) fn lock(written: &Mutex<Vec<WrittenFrame>>) -> MutexGuard<'_, Vec<WrittenFrame>> {
    written.lock().unwrap_or_else(PoisonError::into_inner)
}
