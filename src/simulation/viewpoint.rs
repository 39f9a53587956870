//! Pose of the camera against the craft at one instant.

use glam::{DAffine3, DMat3};

use crate::environment::Sky;
use crate::gpu::effects::image::sampling::Sampling;
use crate::gpu::layout;
use crate::raster;
use crate::raster::distant::Crop;
use crate::scene::{Camera, CameraFrame};
use crate::thermal::sensor;

/// The pose of a camera at one instant: takes body positions into camera axes (OpenCV).
pub fn camera_from_body(camera: &Camera, sky: &Sky) -> DAffine3 {
    let body_from_frame = match camera.frame {
        CameraFrame::Body => DMat3::IDENTITY,
        CameraFrame::Orbit => sky.body_from_orbit,
        CameraFrame::Inertial => sky.body_from_inertial,
    };
    let rotation = body_from_frame * DMat3::from_quat(camera.frame_from_camera);
    DAffine3::from_mat3_translation(rotation, body_from_frame * camera.position).inverse()
}

/// The pose and intrinsics for a device that draws the camera's image directly.
pub fn device_view(camera: &Camera, pose: &DAffine3) -> layout::View {
    view([camera.width, camera.height], camera.lens.focal, camera.lens.centre, camera.near, pose)
}

/// The pose and intrinsics for a device that draws a crop of the camera's image into one of the same size.
pub(crate) fn crop_view(camera: &Camera, crop: &Crop, pose: &DAffine3) -> layout::View {
    let lens = crop.view(&raster_view(camera, pose)).lens;
    view([camera.width, camera.height], lens.focal, lens.centre, camera.near, pose)
}

/// The same for the images from which the camera's image is made. The size is the largest image's, because all are drawn from the triangles that the
/// largest may show.
pub fn source_view(sampling: &Sampling, near: f64, pose: &DAffine3) -> layout::View {
    let view = view(sampling.drawn, sampling.focal, sampling.centre, near, pose);
    layout::View { size: sampling.largest().map(|side| side as f32), ..view }
}

/// A pixel at u right and v down looks along ((u - centre.x) / focal.x, (v - centre.y) / focal.y, 1).
fn view(size: [u32; 2], focal: [f64; 2], centre: [f64; 2], near: f64, pose: &DAffine3) -> layout::View {
    let [camera_from_body_x, camera_from_body_y, camera_from_body_z] = rows(pose);
    let size = size.map(f64::from);
    layout::View {
        camera_from_body_x,
        camera_from_body_y,
        camera_from_body_z,
        clip_scale: [0, 1].map(|i| (2.0 * focal[i] / size[i]) as f32),
        clip_offset: [0, 1].map(|i| (2.0 * centre[i] / size[i] - 1.0) as f32),
        size: size.map(|side| side as f32),
        near: near as f32,
        margin: 0.0,
    }
}

/// The poses of the middle and of the last row, for a rolling shutter.
pub(crate) fn rolling(shutter: &layout::Shutter, middle: &DAffine3, last: &DAffine3) -> layout::Shutter {
    let ([middle_x, middle_y, middle_z], [last_x, last_y, last_z]) = (rows(middle), rows(last));
    layout::Shutter { middle_x, middle_y, middle_z, last_x, last_y, last_z, ..*shutter }
}

/// The rotations of directions in the sky from the axes at the middle and at the last row to those at the first.
pub(crate) fn rolling_sky(turns: [DMat3; 2]) -> layout::ShutterSky {
    let [[middle_x, middle_y, middle_z], [last_x, last_y, last_z]] = turns.map(|turn| rows(&DAffine3::from_mat3(turn)));
    layout::ShutterSky { middle_x, middle_y, middle_z, last_x, last_y, last_z }
}

/// The rows of a pose.
fn rows(pose: &DAffine3) -> [[f32; 4]; 3] {
    [0, 1, 2].map(|i| {
        let rotation = pose.matrix3.row(i);
        [rotation.x as f32, rotation.y as f32, rotation.z as f32, pose.translation[i] as f32]
    })
}

/// The pixels and intrinsics for the sensor.
pub(crate) fn sensor_view(camera: &Camera) -> sensor::twin::SensorView {
    sensor::twin::SensorView {
        size: [camera.width as usize, camera.height as usize],
        focal: camera.lens.focal,
        centre: camera.lens.centre,
    }
}

/// The pose and intrinsics for the f64 rasteriser.
pub fn raster_view(camera: &Camera, pose: &DAffine3) -> raster::RasterView {
    raster::RasterView {
        camera_from_body: *pose,
        width: camera.width,
        height: camera.height,
        lens: camera.lens,
        samples: camera.samples,
        near: camera.near,
        first_row: 0,
    }
}
