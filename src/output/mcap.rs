//! The images of a run as a log for robotics: an MCAP file of ROS 2 messages, which need no ROS to be read.
//!
//! For each drawn frame it has `/camera/temperature` (sensor_msgs/Image, mono16: surface temperature, 10 mK a count), `/camera/radiance` (32FC1: radiance in
//! the band [W m-2 sr-1]), with a sensor `/camera/image_raw` (digital numbers), `/camera/camera_info`, `/craft/pose` (from the planet's centre) and `/tf` (poses of
//! `camera`, `inertial` and the joints in the frame `body`, and of `planet` in `inertial`). Times are Unix times of the scene's date, or seconds since the start
//! where it states none. Schemas: common_interfaces and geometry2 of ROS 2 (Humble).

use std::collections::BTreeMap;
use std::io::Write;

use glam::{DMat4, DQuat, DVec3};
use hifitime::Epoch;
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;

use super::OutputError;
use super::cdr::Cdr;
use super::exr::read_exr;
use super::folder::Folder;
use super::frame::FrameHeader;
use super::gray::read_png;
use super::report::FrameEntry;
use super::ros_schemas::{CAMERA_INFO, IMAGE, POSE_STAMPED, TF_MESSAGE};
use super::sensor_files::first_sensed;
use crate::environment::utc::utc_days;
use crate::lens::Distortion;
use crate::scene::{Camera, ImageFile};
use crate::simulation::image::Image;
use crate::simulation::prepare::Prepared;

/// Kelvin of a count of the images of temperature.
pub(crate) const KELVIN_PER_COUNT: f64 = 0.01;

/// Frame of the images.
const CAMERA: &str = "camera";
const BODY: &str = "body";
/// Inertial axes at the body's origin.
const INERTIAL: &str = "inertial";
/// The same axes at the planet's centre.
const PLANET: &str = "planet";

/// Topics with the names and texts of their schemas.
const TOPICS: [(&str, &str, &str); 6] = [
    ("/camera/temperature", "sensor_msgs/msg/Image", IMAGE),
    ("/camera/radiance", "sensor_msgs/msg/Image", IMAGE),
    ("/camera/image_raw", "sensor_msgs/msg/Image", IMAGE),
    ("/camera/camera_info", "sensor_msgs/msg/CameraInfo", CAMERA_INFO),
    ("/craft/pose", "geometry_msgs/msg/PoseStamped", POSE_STAMPED),
    ("/tf", "tf2_msgs/msg/TFMessage", TF_MESSAGE),
];

/// Digital numbers of a frame: the bytes of a pixel, and all pixels with the low byte first.
type Numbers = (u32, Vec<u8>);

/// Seconds and nanoseconds of a time [s] after a start.
fn stamp(start: Option<Epoch>, time: f64) -> (i32, u32) {
    /// Unix time of J2000 (2000-01-01 12:00 UTC) [s].
    const J2000: f64 = 946_728_000.0;
    // The days of UTC hold nanoseconds of a date only to a microsecond, so the whole seconds are taken from the start alone.
    let start = start.map_or(0.0, |start| (utc_days(start) * 86_400.0 * 1e3).round() / 1e3 + J2000);
    let (whole, rest) = (start.floor() + time.floor(), start.fract() + time.rem_euclid(1.0));
    let nanoseconds = (rest * 1e9).round();
    let carry = (nanoseconds / 1e9).floor();
    ((whole + carry) as i32, (nanoseconds - carry * 1e9) as u32)
}

/// Writes the frames of a run as a log.
///
/// # Errors
/// A frame that can not be read, or a destination that takes no more.
pub(crate) fn write(
    writer: &mut dyn Write,
    folder: &Folder,
    frames: &[FrameEntry],
    prepared: &Prepared,
) -> Result<(), OutputError> {
    let failed = |error: mcap::McapError| OutputError::Encode("MCAP file".to_owned(), error.to_string());
    let options = WriteOptions::new().profile("ros2").library(concat!("isotherm ", env!("CARGO_PKG_VERSION")));
    let mut log = options.disable_seeking(true).create(NoSeek::new(writer)).map_err(failed)?;
    let mut channels = [0; TOPICS.len()];
    for (channel, (topic, name, text)) in channels.iter_mut().zip(TOPICS) {
        let schema = log.add_schema(name, "ros2msg", text.as_bytes()).map_err(failed)?;
        *channel = log.add_channel(schema, topic, "cdr", &BTreeMap::new()).map_err(failed)?;
    }
    for (number, entry) in frames.iter().enumerate() {
        let (frame, header) = read_exr(&folder.file(&entry.file))?;
        let stem = first_sensed(&prepared.scene, entry.file.strip_suffix(".exr").unwrap_or(&entry.file));
        let stem = stem.filter(|_| prepared.scene.images.files.contains(&ImageFile::NumbersPng));
        let numbers = stem.map(|stem| read_numbers(folder, &stem)).transpose()?;
        let place = prepared.loads.sky_model().point(frame.time).map(|point| point.position);
        let (seconds, nanoseconds) = stamp(prepared.scene.time.start, frame.time);
        let time = (i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds)).max(0) as u64;
        let all = messages(&frame, &header, numbers, place, (seconds, nanoseconds));
        for (channel_id, data) in channels.into_iter().zip(all).filter_map(|(channel, data)| Some((channel, data?))) {
            let header = MessageHeader { channel_id, sequence: number as u32, log_time: time, publish_time: time };
            log.write_to_known_channel(&header, &data).map_err(failed)?;
        }
    }
    log.finish().map_err(failed)?;
    Ok(())
}

/// The digital numbers of a frame, which stand beside its EXR under this stem.
fn read_numbers(folder: &Folder, stem: &str) -> Result<Numbers, OutputError> {
    let path = folder.file(&format!("{stem}_{}", ImageFile::NumbersPng.ending()));
    let file = std::fs::read(&path).map_err(|error| OutputError::Read(path, error))?;
    let ([width, height], mut bytes) = read_png(&file)?;
    let depth = bytes.len() as u32 / (width * height).max(1);
    if depth == 2 {
        bytes.as_chunks_mut::<2>().0.iter_mut().for_each(|pair| pair.reverse());
    }
    Ok((depth, bytes))
}

/// The messages of a frame, in the order of the topics. `place` is the craft from the planet's centre [m].
fn messages(
    frame: &Image,
    header: &FrameHeader,
    numbers: Option<Numbers>,
    place: Option<DVec3>,
    stamp: (i32, u32),
) -> [Option<Vec<u8>>; TOPICS.len()] {
    let count = |kelvin: &f32| ((f64::from(*kelvin) / KELVIN_PER_COUNT).round() as u16).to_le_bytes();
    let counts: Vec<u8> = frame.temperature.iter().flat_map(count).collect();
    let radiance: Vec<u8> = frame.radiance.iter().flat_map(|radiance| radiance.to_le_bytes()).collect();
    let image = |encoding: &str, bytes: u32, data: &[u8]| {
        let mut cdr = Cdr::with_header(stamp, CAMERA);
        cdr.u32(frame.camera.height)
            .u32(frame.camera.width)
            .text(encoding)
            .u8(0)
            .u32(frame.camera.width * bytes)
            .bytes(data);
        cdr.finish()
    };
    let raw = |(depth, data): Numbers| image(if depth == 1 { "mono8" } else { "mono16" }, depth, &data);
    [
        Some(image("mono16", 2, &counts)),
        Some(image("32FC1", 4, &radiance)),
        numbers.map(raw),
        Some(camera_info(&frame.camera, [frame.camera.width, frame.camera.height], stamp)),
        craft_pose(frame, header, place, stamp),
        Some(transforms(frame, header, place, stamp)),
    ]
}

/// The lens, in pixels whose centres are whole numbers.
fn camera_info(camera: &Camera, [width, height]: [u32; 2], stamp: (i32, u32)) -> Vec<u8> {
    let lens = &camera.lens;
    let ([fx, fy], [cx, cy]) = (lens.focal, lens.centre.map(|centre| centre - 0.5));
    let (model, distortion) = match lens.distortion {
        Distortion::None => ("plumb_bob", vec![0.0; 5]),
        Distortion::BrownConrady(numbers) if numbers[5..].iter().all(|number| *number == 0.0) => {
            ("plumb_bob", numbers[..5].to_vec())
        }
        Distortion::BrownConrady(numbers) if numbers[8..].iter().all(|number| *number == 0.0) => {
            ("rational_polynomial", numbers[..8].to_vec())
        }
        // ROS has no name for the model with a thin prism. OpenCV tells it by its 12 numbers.
        Distortion::BrownConrady(numbers) => ("thin_prism", numbers.to_vec()),
        Distortion::Fisheye(numbers) => ("equidistant", numbers.to_vec()),
    };
    let mut cdr = Cdr::with_header(stamp, CAMERA);
    cdr.u32(height).u32(width).text(model).f64s(&distortion);
    cdr.f64_array(&[fx, lens.skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    cdr.f64_array(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    cdr.f64_array(&[fx, lens.skew, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]);
    // No binning, and a region of interest that is the whole image.
    cdr.u32(0).u32(0).u32(0).u32(0).u32(0).u32(0).u8(0);
    cdr.finish()
}

/// Position and attitude of the craft in the frame `planet`.
fn craft_pose(image: &Image, header: &FrameHeader, place: Option<DVec3>, stamp: (i32, u32)) -> Option<Vec<u8>> {
    let inertial_from_body = header.camera_from_inertial?.inverse() * DMat4::from(image.camera_from_body);
    let mut cdr = Cdr::with_header(stamp, PLANET);
    cdr.f64_array(&place?.to_array()).f64_array(&rigid(&inertial_from_body).0);
    Some(cdr.finish())
}

/// Poses of camera, inertial axes and joints in the body frame, and of the planet's axes in the inertial frame.
fn transforms(image: &Image, header: &FrameHeader, place: Option<DVec3>, stamp: (i32, u32)) -> Vec<u8> {
    let body_from_camera = DMat4::from(image.camera_from_body).inverse();
    let mut poses = vec![(BODY, CAMERA.to_owned(), body_from_camera)];
    if let Some(camera) = header.camera_from_inertial {
        poses.push((BODY, INERTIAL.to_owned(), body_from_camera * camera));
        poses.extend(place.map(|place| (INERTIAL, PLANET.to_owned(), DMat4::from_translation(-place))));
    }
    poses.extend(header.joints.iter().map(|(name, pose)| (BODY, format!("joint/{name}"), *pose)));
    let mut cdr = Cdr::new();
    cdr.u32(poses.len() as u32);
    for (parent, child, pose) in poses {
        cdr.header(stamp, parent).text(&child);
        let (rotation, translation) = rigid(&pose);
        cdr.f64_array(&translation).f64_array(&rotation);
    }
    cdr.finish()
}

/// Quaternion (x, y, z, w) and translation [m] of a pose.
fn rigid(pose: &DMat4) -> ([f64; 4], [f64; 3]) {
    let rotation = DQuat::from_mat4(pose).normalize();
    (rotation.to_array(), pose.w_axis.truncate().to_array())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::frame::tests::{header, sphere};

    #[test]
    fn stamps_keep_nanoseconds_of_a_date() {
        let start = Epoch::from_gregorian_utc_hms(2026, 1, 2, 3, 4, 5);
        // date -u -d '2026-01-02 03:04:05' +%s
        assert_eq!(stamp(Some(start), 0.0), (1_767_323_045, 0));
        assert_eq!(stamp(Some(start), 15.25), (1_767_323_060, 250_000_000));
        assert_eq!(stamp(None, 1.999_999_999_9), (2, 0));
    }

    #[test]
    fn messages_have_the_lengths_of_their_fields() {
        let (frame, header) = (sphere(8, 6, 1), header());
        let place = Some(DVec3::new(7e6, 0.0, 0.0));
        let [temperature, radiance, raw, info, pose, tf] =
            messages(&frame, &header, Some((1, vec![7; 48])), place, (1, 2)).map(|data| data.expect("a message"));
        assert_eq!(raw[raw.len() - 48 - 4..], [&48u32.to_le_bytes()[..], &[7; 48]].concat());
        assert_eq!(pose[pose.len() - 56..][..8], 7e6f64.to_le_bytes());
        assert_eq!(temperature[..4], [0, 1, 0, 0], "little-endian CDR");
        assert_eq!(temperature[temperature.len() - 96 - 4..][..4], 96u32.to_le_bytes());
        assert_eq!(radiance[radiance.len() - 192 - 4..][..4], 192u32.to_le_bytes());
        let middle = 4 + 3 * 8;
        let count = u16::from_le_bytes([
            temperature[temperature.len() - 96 + 2 * middle],
            temperature[temperature.len() - 95 + 2 * middle],
        ]);
        assert!((f64::from(count) * KELVIN_PER_COUNT - f64::from(frame.temperature[middle])).abs() <= 0.005);
        assert!(info.len() > 9 * 8 + 9 * 8 + 12 * 8 && tf.len() > 3 * 7 * 8);
        let without = messages(&frame, &header, None, None, (1, 2));
        assert_eq!(without.map(|data| data.is_some()), [true, true, false, true, false, true]);
    }
}
