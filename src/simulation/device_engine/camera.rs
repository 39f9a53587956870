//! The camera of a device: the views, the crop and the rows of an image that it draws.

use glam::DAffine3;

use crate::gpu::effects::image::sampling::Sampling;
use crate::gpu::layout;
use crate::raster::changes::PixelChanges;
use crate::scene::{Camera, MotionBlur};
use crate::simulation::distant::{DistantParts, told};
use crate::simulation::engine::{ImageMoments, InstantPoses, Order};
use crate::simulation::image::Image;
use crate::simulation::pixel_light::PastLight;
use crate::simulation::pose::draws_alike;
use crate::simulation::prepare::Prepared;
use crate::simulation::viewpoint::{device_view, raster_view, rolling, rolling_sky, source_view};

/// A camera and how a device makes its image.
pub(super) struct DeviceCamera {
    camera: Camera,
    /// How the image is made, without the map of the lens.
    sampling: Option<Sampling>,
    /// The boxes of a craft that may be far away.
    distance: Option<DistantParts>,
}

impl DeviceCamera {
    pub(crate) fn new(prepared: &Prepared, camera: &Camera, sampling: Option<Sampling>) -> Self {
        let may_be_far = sampling.as_ref().is_some_and(|sampling| sampling.distant);
        Self {
            camera: camera.clone(),
            distance: may_be_far.then(|| DistantParts::new(prepared, camera)).flatten(),
            sampling: sampling.map(|sampling| Sampling { map: Vec::new(), ..sampling }),
        }
    }

    /// Takes another camera whose image is drawn with the same resources. Returns whether it is one. `senses` says whether the image has a sensor.
    pub(crate) fn take(&mut self, camera: &Camera, senses: bool) -> bool {
        let follows = |sampling: &Sampling| sampling.shutter.is_none() && !sampling.distant;
        let any_lens = self.draws_pixels() && self.sampling.as_ref().is_none_or(follows) && !senses;
        let fits = draws_alike(&self.camera, camera, any_lens);
        if fits {
            self.camera = camera.clone();
        }
        fits
    }

    /// The exposure, where an image is the mean over sub-frames.
    pub(crate) fn exposure(&self) -> Option<MotionBlur> {
        Some(self.camera.exposure).filter(MotionBlur::is_mean)
    }

    /// The image that an order asks for, without pixels.
    pub(crate) fn image(&self, order: &Order<'_>) -> Option<Image> {
        order.image_of(&self.camera)
    }

    /// Whether a pixel has several samples.
    pub(crate) fn has_coverage(&self) -> bool {
        self.camera.samples > 1
    }

    /// What is drawn: the views, and for a craft that is far away how their crop is put into pixels. Nothing without a pose.
    pub(crate) fn drawn(&self, order: &Order<'_>) -> (Vec<layout::View>, Option<layout::Distant>) {
        match self.crop(order) {
            Some((views, distant)) => (views, Some(distant)),
            None => (self.views(order).unwrap_or_default(), None),
        }
    }

    /// The past light that changes pixels. `None` where an image is not drawn pixel by pixel from one pose, at one instant.
    pub(crate) fn past<'a>(&self, order: &Order<'a>) -> Option<&'a PastLight> {
        order.past.filter(|_| self.draws_pixels() && order.moments.is_none() && self.crop(order).is_none())
    }

    /// What light of their own adds to pixels of nodes at these temperatures [K].
    pub(crate) fn changes(&self, order: &Order<'_>, temperatures: &[f64]) -> Option<PixelChanges> {
        self.past(order)?.changes(&raster_view(&self.camera, order.pose.as_ref()?), order.joints, temperatures)
    }

    /// Whether the camera's own image is drawn, not a finer one.
    fn draws_pixels(&self) -> bool {
        self.camera.lens.is_pinhole() && self.sampling.as_ref().is_none_or(|sampling| sampling.mean.is_none())
    }

    /// The camera pose against the body and against each joint.
    fn views(&self, order: &Order<'_>) -> Option<Vec<layout::View>> {
        let pose = order.pose.as_ref()?;
        let still = [DAffine3::IDENTITY];
        let joints = if order.joints.is_empty() { &still } else { order.joints };
        let view = |joint: &DAffine3| match &self.sampling {
            Some(sampling) if !self.draws_pixels() => source_view(sampling, self.camera.near, &(*pose * *joint)),
            _ => device_view(&self.camera, &(*pose * *joint)),
        };
        Some(joints.iter().map(view).collect())
    }

    /// The views of the crop of an image of a craft that is far away, and how its texels are put into pixels.
    fn crop(&self, order: &Order<'_>) -> Option<(Vec<layout::View>, layout::Distant)> {
        let pose = order.pose.as_ref()?;
        let crop = self.distance.as_ref()?.crop(&self.camera, pose, order.joints)?;
        Some(told(&self.camera, &crop, pose, order.joints))
    }

    /// The rolling shutter against the body and against each joint. Empty if all rows see one pose.
    pub(crate) fn shutters(&self, order: &Order<'_>) -> Vec<layout::Shutter> {
        let shutter = self.sampling.as_ref().and_then(|sampling| sampling.shutter.as_ref());
        let (Some((_, shutter)), Some(ImageMoments(moment))) = (shutter, order.moments) else { return Vec::new() };
        let last = self.camera.shutter_time();
        let [middle, last] = [0.5 * last, last].map(|later| {
            let InstantPoses { pose, joints, .. } = moment(later);
            let of_joint = |joint: &DAffine3| pose * *joint;
            if joints.is_empty() { vec![pose] } else { joints.iter().map(of_joint).collect() }
        });
        middle.iter().zip(&last).map(|(middle, last)| rolling(shutter, middle, last)).collect()
    }

    /// How the sky turns while the rows are taken. `None` if all rows see one pose, or no surroundings.
    pub(crate) fn rolling_sky(&self, order: &Order<'_>) -> Option<layout::ShutterSky> {
        self.sampling.as_ref()?.shutter.as_ref().and(order.surroundings.as_ref())?;
        let ImageMoments(moment) = order.moments?;
        let last = self.camera.shutter_time();
        let [first, middle, last] = [0.0, 0.5 * last, last].map(|later| moment(later).camera_from_orbit);
        Some(rolling_sky([middle, last].map(|row| first * row.transpose())))
    }
}
