//! Where a craft spans so few pixels that its image is made from a crop.

use glam::{DAffine3, DVec3};

use super::prepare::Prepared;
use super::viewpoint::{camera_from_body, crop_view, raster_view};
use crate::gpu::layout;
use crate::raster::distant::{Crop, SKY_LOOKUPS};
use crate::scene::Camera;
use crate::scene::work::image_times;

/// Most images whose distance is looked at before a run. Of more, so many are taken evenly.
const MOST_LOOKS: usize = 10_000;

/// The boxes that hold the parts of a craft.
pub(crate) struct DistantParts {
    /// Joint, and lower and upper corner of its nodes in the file's pose [m].
    boxes: Vec<(usize, [DVec3; 2])>,
    /// Most texels of a crop.
    most: [u32; 2],
}

impl DistantParts {
    /// The boxes of a craft whose images may need a crop. `None` where no image of the scene shows it so small, or with a rolling shutter.
    pub(crate) fn new(prepared: &Prepared, camera: &Camera) -> Option<Self> {
        if camera.line_time > 0.0 {
            return None;
        }
        let boxes = prepared.triangle_runs.iter().map(|run| {
            let (first, end) = run.triangles;
            let nodes = prepared.triangles[first as usize..end as usize].as_flattened().iter();
            let positions = nodes.map(|node| prepared.nodes.positions[*node as usize].as_dvec3());
            let around = positions.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], position| {
                [low.min(position), high.max(position)]
            });
            (run.joint as usize, around)
        });
        let boxes = boxes.filter(|(_, [low, high])| low.cmple(*high).all()).collect();
        let distance = Self { boxes, most: [camera.width, camera.height] };
        distance.occurs(prepared, camera).then_some(distance)
    }

    /// Whether an image of a scene shows the craft so small.
    fn occurs(&self, prepared: &Prepared, camera: &Camera) -> bool {
        let time = &prepared.scene.time;
        let images = image_times(time).count();
        let every = images.div_ceil(MOST_LOOKS).max(1);
        let last = image_times(time).last();
        let mut times = image_times(time).step_by(every).chain(last).chain((images == 0).then_some(0.0));
        times.any(|time| {
            let Ok(at) = camera.at(time, None) else { return false };
            let pose = camera_from_body(&at, &prepared.loads.sky_model().sky(time));
            self.crop(camera, &pose, &prepared.loads.joints_at(time).1).is_some()
        })
    }

    /// The crop of an image. `None` where the craft is near.
    pub(crate) fn crop(&self, camera: &Camera, pose: &DAffine3, joints: &[DAffine3]) -> Option<Crop> {
        let motion = |joint: usize| joints.get(joint).copied().unwrap_or(DAffine3::IDENTITY);
        let boxes: Vec<_> = self.boxes.iter().map(|(joint, ends)| (motion(*joint), *ends)).collect();
        Crop::around(&raster_view(camera, pose), &boxes, self.most)
    }
}

/// The values of a crop for a device: for the drawing into an image of the camera's size, and for putting that image into the pixels.
pub(crate) fn told(
    camera: &Camera,
    crop: &Crop,
    pose: &DAffine3,
    joints: &[DAffine3],
) -> (Vec<layout::View>, layout::Distant) {
    let single = [DAffine3::IDENTITY];
    let joints = if joints.is_empty() { &single } else { joints };
    let view = |joint: &DAffine3| crop_view(camera, crop, &(*pose * *joint));
    let [focal, centre] = [camera.lens.focal, camera.lens.centre].map(|pair| pair.map(|value| value as f32));
    let distant = layout::Distant {
        corner: crop.corner.to_array().map(|value| value as f32),
        focal,
        centre,
        scale: crop.scale as f32,
        lookups: if camera.samples > 1 { SKY_LOOKUPS as f32 } else { 1.0 },
        width: camera.width,
        height: camera.height,
        across: crop.size[0],
        down: crop.size[1],
    };
    (joints.iter().map(view).collect(), distant)
}
