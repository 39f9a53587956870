//! The index of images at their own times: `images.csv`, with the pose of each, which a command takes as a table of poses.

use super::OutputError;
use super::folder::Folder;
use super::run_pictures::WrittenFrame;
use crate::scene::{Camera, Time};

/// File of the index.
pub(crate) const IMAGES: &str = "images.csv";

const HEAD: [&str; 10] = ["time", "x", "y", "z", "qw", "qx", "qy", "qz", "image", "file"];

/// Writes the index of some frames. Positions are in metres, and quaternions rotate camera axes into the camera's frame.
///
/// # Errors
/// A full disk.
pub(super) fn write_index(
    folder: &Folder,
    time: &Time,
    camera: &Camera,
    written: &[WrittenFrame],
) -> Result<(), OutputError> {
    let row = |frame: &WrittenFrame| {
        let at = frame.time(time);
        // A frame was drawn, so the camera had a pose.
        let camera = camera.at(at, frame.image).unwrap_or_else(|_| camera.clone());
        let ([x, y, z], q) = (camera.position.to_array(), camera.frame_from_camera);
        let mut cells: Vec<String> = [at, x, y, z, q.w, q.x, q.y, q.z].map(|value| value.to_string()).to_vec();
        cells.extend([frame.image.unwrap_or(0).to_string(), frame.file("exr")]);
        cells
    };
    let head = HEAD.map(str::to_owned).to_vec();
    folder.write_csv(IMAGES, std::iter::once(head).chain(written.iter().map(row)))
}
