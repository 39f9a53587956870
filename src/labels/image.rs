//! One image with everything known about it, in plain types.

use glam::{DAffine3, DQuat, DVec2, DVec3};

use crate::lens::{Distortion, Lens};

/// Pixels of OpenCV less ours: the centre of the upper left pixel is (0.5, 0.5) here and (0, 0) there.
pub(crate) const OPENCV_PIXEL: f64 = -0.5;

/// The use of an image. All images of an orbit have the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Split {
    /// To train on.
    Train,
    /// To choose between trained models.
    Validation,
    /// To judge a model.
    Test,
}

impl Split {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Train, Self::Validation, Self::Test];

    /// Name in BOP and COCO: `train`, `val` or `test`.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Validation => "val",
            Self::Test => "test",
        }
    }

    /// Name in SPEED+: `train`, `validation` or `test`.
    pub(crate) fn long_name(self) -> &'static str {
        match self {
            Self::Validation => "validation",
            other => other.name(),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JointPosition {
    /// Name of its glTF node.
    pub(crate) name: String,
    /// Angle [rad] or distance [m] from the pose in the model's file.
    pub(crate) position: f64,
    /// Whether the position is an angle.
    pub(crate) turns: bool,
}

/// The place of an image in its data set, with the values that were drawn for it.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageIdentity {
    /// Number of the sample in the data set, from 0.
    pub sample: u64,
    /// Number of the orbit.
    pub orbit: u32,
    /// Number of the image in its orbit, from 0.
    pub number: u32,
    /// Use of the images of the orbit.
    pub split: Split,
    /// Bits of the digital numbers: 8, 14 or 16.
    pub bits: u32,
    /// State and settings of the sensor by name. Each name ends with its unit.
    pub sensor: Vec<(String, f64)>,
    /// Values that were drawn for this sample, by name.
    pub drawn: Vec<(String, f64)>,
}

/// One image of a data set. Rows run from top to bottom, pixels from left to right. Pixels without a surface are 0 in every list of labels.
///
/// Camera axes follow OpenCV: +X right, +Y down, +Z forward. With a rolling shutter the pose is the first row's.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelledImage {
    pub(crate) identity: ImageIdentity,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub(crate) height: u32,
    /// The lens. The centre of the upper left pixel is (0.5, 0.5).
    pub lens: Lens,
    /// Distance of the camera's near plane [m].
    pub(crate) near: f64,
    /// Time from one row to the next [s]. 0 where all rows see one moment.
    pub(crate) line_time: f64,
    /// Time since the start of its orbit's run [s].
    pub time: f64,
    /// Takes body positions into camera axes [m].
    pub camera_from_body: DAffine3,
    /// Takes places in the model's file into the body frame, for the body (which is the identity) and then for each joint [m].
    pub links: Vec<DAffine3>,
    /// Position of each joint, in the order of `links` after the body.
    pub(crate) joints: Vec<JointPosition>,
    /// Unit vector to the Sun, camera axes.
    pub(crate) sun: DVec3,
    /// Share of the Sun's disc that the planet leaves visible from the craft, in [0, 1].
    pub lit: f64,
    /// Unit vector to the planet's centre, camera axes.
    pub planet: DVec3,
    /// Half the angle under which the planet appears from the craft [rad].
    pub planet_radius: f64,
    /// The values of the pixels.
    pub channels: ImageChannels,
}

/// The values of the pixels of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageChannels {
    /// Digital numbers of the sensor. `None` without a sensor.
    pub(crate) digital_numbers: Option<Vec<u16>>,
    /// Radiance in the band [W m-2 sr-1].
    pub(crate) radiance: Vec<f32>,
    /// Surface temperature at the centre of the pixel [K].
    pub(crate) temperature: Vec<f32>,
    /// Distance along the camera's +Z at the centre of the pixel [m].
    pub depth: Vec<f32>,
    /// Index of the part at the centre of the pixel + 1.
    pub part: Vec<u32>,
    /// Index of the material at the centre of the pixel + 1.
    pub(crate) material: Vec<u32>,
    /// Samples of a pixel among which one shows its part where the centre shows none.
    pub(crate) samples: u32,
    /// Share of the samples of a pixel that show a surface. Empty with one sample of a pixel.
    pub(crate) coverage: Vec<f32>,
}

impl LabelledImage {
    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Takes places in the model's file into camera axes, for the body or for a joint + 1 [m].
    pub(crate) fn camera_from_link(&self, link: usize) -> DAffine3 {
        self.camera_from_body * self.links.get(link).copied().unwrap_or(DAffine3::IDENTITY)
    }

    /// Rotates body vectors into camera axes, with a positive scalar part.
    pub(crate) fn quaternion(&self) -> DQuat {
        let turn = DQuat::from_mat3(&self.camera_from_body.matrix3).normalize();
        if turn.w < 0.0 { -turn } else { turn }
    }

    /// OpenCV's camera matrix, row by row, with skew.
    pub fn camera_matrix(&self) -> [f64; 9] {
        let Lens { focal: [fx, fy], centre: [cx, cy], skew, .. } = self.lens;
        [fx, skew, cx + OPENCV_PIXEL, 0.0, fy, cy + OPENCV_PIXEL, 0.0, 0.0, 1.0]
    }

    /// The name of the distortion in OpenCV and its numbers: `none`, `opencv` (k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4) or `opencv_fisheye` (k1,
    /// k2, k3, k4).
    pub(crate) fn distortion(&self) -> (&'static str, Vec<f64>) {
        match self.lens.distortion {
            Distortion::None => ("none", Vec::new()),
            Distortion::BrownConrady(numbers) => ("opencv", numbers.to_vec()),
            Distortion::Fisheye(numbers) => ("opencv_fisheye", numbers.to_vec()),
        }
    }

    /// Where a point in camera axes [m] appears, in OpenCV's pixels. `None` behind the camera.
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        let ray = (point.z > 0.0).then(|| point.truncate() / point.z)?;
        Some(self.lens.project(ray) + OPENCV_PIXEL)
    }
}

#[cfg(test)]
pub(crate) mod tests;
