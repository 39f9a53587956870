//! Tests of `frame`, and what other tests take from them.

use super::*;
use crate::lens::{Distortion, Lens};
use crate::scene::{Camera, CameraFrame, Motion, MotionBlur};
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
        exposure: MotionBlur { time: 2e-3, sub_frames: 5 },
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
        bands: Vec::new(),
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
