//! Pose of the camera against the craft at one instant.

use glam::{DAffine3, DMat3};

use crate::environment::Sky;
use crate::gpu::layout;
use crate::raster;
use crate::scene::{Camera, CameraFrame};
use crate::thermal::sensor;

/// The pose of a camera at one instant. It takes body positions into camera axes (OpenCV).
pub fn camera_from_body(camera: &Camera, sky: &Sky) -> DAffine3 {
    let body_from_frame = match camera.frame {
        CameraFrame::Body => DMat3::IDENTITY,
        CameraFrame::Orbit => sky.body_from_orbit,
        CameraFrame::Inertial => sky.body_from_inertial,
    };
    let rotation = body_from_frame * DMat3::from_quat(camera.frame_from_camera);
    DAffine3::from_mat3_translation(rotation, body_from_frame * camera.position).inverse()
}

/// The pose and intrinsics for the device. A pixel at u right and v down looks along ((u - centre.x) / focal.x, (v - centre.y) / focal.y, 1).
pub fn device_view(camera: &Camera, pose: &DAffine3) -> layout::View {
    let row = |i: usize| {
        let rotation = pose.matrix3.row(i);
        [rotation.x as f32, rotation.y as f32, rotation.z as f32, pose.translation[i] as f32]
    };
    let size = [f64::from(camera.width), f64::from(camera.height)];
    layout::View {
        camera_from_body_x: row(0),
        camera_from_body_y: row(1),
        camera_from_body_z: row(2),
        clip_scale: [0, 1].map(|i| (2.0 * camera.focal[i] / size[i]) as f32),
        clip_offset: [0, 1].map(|i| (2.0 * camera.centre[i] / size[i] - 1.0) as f32),
        size: size.map(|side| side as f32),
        near: camera.near as f32,
        margin: 0.0,
    }
}

/// The pixels and intrinsics for the sensor.
pub fn sensor_view(camera: &Camera) -> sensor::twin::View {
    sensor::twin::View {
        size: [camera.width as usize, camera.height as usize],
        focal: camera.focal,
        centre: camera.centre,
    }
}

/// The pose and intrinsics for the f64 rasteriser.
pub fn raster_view(camera: &Camera, pose: &DAffine3) -> raster::View {
    raster::View {
        camera_from_body: *pose,
        width: camera.width,
        height: camera.height,
        focal: camera.focal,
        centre: camera.centre,
        near: camera.near,
    }
}
