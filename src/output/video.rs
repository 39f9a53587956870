//! The video of a run: the grey images of the sensor, as an animated PNG, or as MP4 by `ffmpeg` where it is installed.

use std::io::Write;
use std::process::{Command, Stdio};

use super::OutputError;
use super::folder::Folder;
use super::gray::{animated, read_png};
use crate::scene::{ImageFiles, Video};

pub(crate) const APNG: &str = "video.png";
pub(crate) const MP4: &str = "video.mp4";

/// Refuses a video that can not be made, before the run.
///
/// # Errors
/// `ffmpeg` is not installed.
pub(crate) fn check(images: &ImageFiles) -> Result<(), OutputError> {
    if images.video != Some(Video::Mp4) {
        return Ok(());
    }
    let probe = Command::new("ffmpeg")
        .arg("-version")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    match probe {
        Ok(status) if status.success() => Ok(()),
        _ => Err(failed("output.video = 'mp4' needs the program ffmpeg, which does not run here; 'apng' needs none")),
    }
}

/// Writes the video of displays, which lie as PNG in the folder.
///
/// # Errors
/// A display that can not be read, `ffmpeg` fails, or a full disk.
pub(crate) fn write(folder: &Folder, images: &ImageFiles, displays: &[String]) -> Result<(), OutputError> {
    let (Some(video), Some(first)) = (images.video, displays.first()) else { return Ok(()) };
    let read = |name: &String| {
        let path = folder.file(name);
        read_png(&std::fs::read(&path).map_err(|source| OutputError::Read(path.clone(), source))?)
    };
    let (size, _) = read(first)?;
    let each = || displays.iter().map(|name| read(name).map(|(_, bytes)| bytes));
    match video {
        Video::Apng => folder.write_bytes(APNG, &animated(size, displays.len(), images.video_rate, each())?),
        Video::Mp4 => folder.write_bytes(MP4, &mp4(size, images.video_rate, each())?),
    }
}

fn failed(reason: impl ToString) -> OutputError {
    OutputError::Encode("video".to_owned(), reason.to_string())
}

/// An MP4 (H.264) of grey images.
fn mp4(
    [width, height]: [u32; 2],
    rate: f64,
    images: impl Iterator<Item = Result<Vec<u8>, OutputError>>,
) -> Result<Vec<u8>, OutputError> {
    let folder = tempfile::tempdir().map_err(failed)?;
    let path = folder.path().join(MP4);
    let mut ffmpeg = Command::new("ffmpeg")
        .args(["-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "gray", "-video_size"])
        .arg(format!("{width}x{height}"))
        .arg("-framerate")
        .arg(rate.to_string())
        // H.264 with half the colours needs even sides.
        .args(["-i", "-", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-movflags", "+faststart"])
        .arg(&path)
        .stdin(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    let mut input = ffmpeg.stdin.take();
    for image in images {
        // Where ffmpeg has ended, its status says so.
        if let Some(pipe) = &mut input
            && pipe.write_all(&image?).is_err()
        {
            break;
        }
    }
    drop(input);
    match ffmpeg.wait().map_err(failed)? {
        status if status.success() => std::fs::read(&path).map_err(failed),
        status => Err(failed(format!("ffmpeg ended with {status}"))),
    }
}
