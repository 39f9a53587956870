//! The metadata of an image in a file, and checks of the image.

use glam::DMat4;

use super::OutputError;
use super::finite::finite;
use crate::simulation::image::Image;
use crate::thermal::planck::Band;

/// Refuses an image whose radiance, temperature or depth is not finite. `shown` says what a pixel shows.
///
/// # Errors
/// [`OutputError::NotFinite`] with step, pixel and what it shows.
pub(crate) fn check_finite(image: &Image, step: u32, shown: impl Fn(usize) -> String) -> Result<(), OutputError> {
    if let Some((what, pixel, value)) = image.not_finite() {
        let width = image.camera.width.max(1) as usize;
        let name =
            || format!("step {step}: the {what} in pixel ({}, {}) of {}", pixel % width, pixel / width, shown(pixel));
        finite(f64::from(value), name)?;
    }
    Ok(())
}

/// Refuses lists that do not fill the image.
pub(crate) fn check_size(image: &Image) -> Result<(), OutputError> {
    let optional = |list: &[f32]| if list.is_empty() { image.part.len() } else { list.len() };
    check_channels(
        image.size(),
        &[
            ("L", image.radiance.len()),
            ("T", image.temperature.len()),
            ("Z", image.depth.len()),
            ("part", image.part.len()),
            ("material", image.material.len()),
            ("coverage", optional(&image.coverage)),
            ("reflected", optional(&image.reflected)),
        ],
    )
}

/// Refuses channels that do not fill an image of this size. Each channel has a name and a length.
pub(super) fn check_channels([width, height]: [u32; 2], channels: &[(&str, usize)]) -> Result<(), OutputError> {
    let pixels = width as usize * height as usize;
    match channels.iter().find(|(_, values)| *values != pixels || *values == 0) {
        None => Ok(()),
        Some((channel, values)) => {
            Err(OutputError::Mismatch(format!("frame {width}x{height}: channel {channel} has {values} values")))
        }
    }
}

/// The metadata of a frame. Most of it is the same for a whole run.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameHeader {
    pub(crate) scene: String,
    /// SHA-256 of the scene and its files (hexadecimal).
    pub scene_sha256: String,
    pub(crate) device: String,
    /// Version of isotherm.
    pub version: String,
    /// Spectral band.
    pub band: Band,
    /// Number of the step; 0 is the initial state. An image at its own time lies in the interval of this step.
    pub step: u32,
    /// Number of an image at its own time. `None` at the end of a step.
    pub image: Option<u32>,
    /// Camera pose: maps orbit coordinates to camera coordinates (OpenCV axes) [m]. Its origin is that of the body frame. `None` in a file of an earlier version.
    pub camera_from_orbit: Option<DMat4>,
    /// The same for the inertial frame with its origin moved to the body frame's. `None` in a file of an earlier version.
    pub camera_from_inertial: Option<DMat4>,
    /// Camera pose at the time of the last row. `None` if all rows see one pose.
    pub(crate) last_row_from_body: Option<DMat4>,
    /// Name and pose of each joint at this step: maps places of its parts in the model's file to body coordinates [m].
    pub joints: Vec<(String, DMat4)>,
    /// Names of the parts. The first has pixel value 1.
    pub parts: Vec<String>,
    /// Names of the materials. The first has pixel value 1.
    pub materials: Vec<String>,
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::lens::{Distortion, Lens};
    use crate::scene::{Camera, CameraFrame, Motion};
    use glam::{DAffine3, DQuat, DVec3};

    /// A lit sphere. Temperature falls with the cosine from 350 K to 180 K on the night side.
    pub(crate) fn sphere(width: u32, height: u32, step: u32) -> Image {
        let pixels = (width * height) as usize;
        let pose = DAffine3::from_rotation_translation(rotation(), DVec3::new(0.5, -0.25, 100.0));
        let mut frame = Image {
            radiance: vec![0.0; pixels],
            temperature: vec![0.0; pixels],
            depth: vec![0.0; pixels],
            part: vec![0; pixels],
            material: vec![0; pixels],
            ..Image::blank(camera(width, height), pose, f64::from(step) * 15.5)
        };
        let phase = step as f32 * 0.02 + 0.5;
        let radius = 0.42 * height as f32;
        for pixel in 0..pixels {
            let x = ((pixel as u32 % width) as f32 + 0.5 - width as f32 / 2.0) / radius;
            let y = ((pixel as u32 / width) as f32 + 0.5 - height as f32 / 2.0) / radius;
            let z2 = 1.0 - x * x - y * y;
            if z2 > 0.0 {
                let z = z2.sqrt();
                let sun = x * phase.cos() + z * phase.sin() - 0.2 * y;
                let temperature = 180.0 + 170.0 * sun.max(0.0).sqrt().min(1.0);
                frame.temperature[pixel] = temperature;
                frame.radiance[pixel] = 54.93 * (temperature / 300.0).powi(5);
                frame.depth[pixel] = 50.0 - z;
                frame.part[pixel] = 1 + u32::from(x > 0.0);
                frame.material[pixel] = 1 + u32::from(y > 0.0);
            }
        }
        frame
    }

    fn rotation() -> DQuat {
        DQuat::from_xyzw(0.1, -0.7, 0.3, 0.64).normalize()
    }

    fn camera(width: u32, height: u32) -> Camera {
        Camera {
            width,
            height,
            lens: Lens {
                focal: [1_234.567_89, 1230.1],
                centre: [f64::from(width) / 2.0, f64::from(height) / 2.0 + 0.25],
                skew: 0.1,
                distortion: Distortion::BrownConrady([
                    -0.3,
                    0.1,
                    1e-3,
                    -2e-4,
                    1.0 / 3.0,
                    0.0,
                    0.5,
                    0.0,
                    0.0,
                    0.0,
                    7e-5,
                    0.0,
                ]),
            },
            samples: 4,
            line_time: 3e-5,
            motion: Motion::Still,
            frame: CameraFrame::Orbit,
            position: DVec3::new(-100.0, 1e-3, 1.0 / 3.0),
            frame_from_camera: rotation(),
            near: 0.1,
        }
    }

    /// A header without repeated values.
    pub(crate) fn header() -> FrameHeader {
        let rotation = rotation();
        FrameHeader {
            scene: "Station, beta 30°".into(),
            scene_sha256: "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08".into(),
            device: "llvmpipe (LLVM 15.0.6, 256 bits)".into(),
            version: "0.1.0".into(),
            band: Band { lower: 8e-6, upper: 14e-6 },
            step: 7,
            image: Some(3),
            camera_from_orbit: Some(DMat4::from_rotation_translation(rotation, DVec3::new(1.5, -0.25, 100.0))),
            camera_from_inertial: Some(DMat4::from_rotation_translation(rotation, DVec3::new(2.5, -0.25, 100.0))),
            last_row_from_body: Some(DMat4::from_rotation_x(0.3)),
            joints: vec![("wing, 左".into(), DMat4::from_rotation_y(1.0 / 3.0)), ("mast".into(), DMat4::IDENTITY)],
            parts: vec!["Hull=1; left".into(), "太陽電池".into()],
            materials: vec!["white".into(), "black".into()],
        }
    }

    #[test]
    fn the_range_leaves_out_background_and_what_is_not_finite() {
        let mut frame = sphere(8, 8, 0);
        let expected = frame.range().unwrap();
        assert!(expected[0] >= 180.0 && expected[1] <= 350.0);
        let hit = frame.part.iter().position(|&part| part != 0).unwrap();
        let miss = frame.part.iter().position(|&part| part == 0).unwrap();
        frame.temperature[miss] = 9999.0;
        frame.temperature[hit] = f32::NAN;
        let range = frame.range().unwrap();
        assert!(range[0] >= expected[0] && range[1] <= expected[1]);
        frame.part.fill(0);
        assert_eq!(frame.range(), None);
    }

    #[test]
    fn a_channel_that_does_not_fill_the_image_is_named() {
        let mut frame = sphere(4, 3, 0);
        assert!(check_size(&frame).is_ok());
        frame.depth.pop();
        assert_eq!(check_size(&frame).unwrap_err().to_string(), "frame 4x3: channel Z has 11 values");
    }
}
