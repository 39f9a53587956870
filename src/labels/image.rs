//! One image with what is known about it, in plain types.

use glam::{DAffine3, DQuat, DVec2, DVec3};

use crate::lens::{Distortion, Lens};

/// Pixels of OpenCV less ours: the centre of the upper left pixel is (0.5, 0.5) here and (0, 0) there.
pub const OPENCV_PIXEL: f64 = -0.5;

/// What an image is for. All images of an orbit have the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Split {
    /// To train on.
    Train,
    /// To choose between trained models.
    Validation,
    /// To judge one.
    Test,
}

impl Split {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Train, Self::Validation, Self::Test];

    /// Its name in BOP and COCO: `train`, `val` or `test`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Validation => "val",
            Self::Test => "test",
        }
    }

    /// Its name in SPEED+: `train`, `validation` or `test`.
    pub fn long_name(self) -> &'static str {
        match self {
            Self::Validation => "validation",
            other => other.name(),
        }
    }
}

/// Where a joint is.
#[derive(Debug, Clone, PartialEq)]
pub struct JointPosition {
    /// Name of its glTF node.
    pub name: String,
    /// Angle [rad] or distance [m] from the pose in the model's file.
    pub position: f64,
    /// Whether the position is an angle.
    pub turns: bool,
}

/// One image of a data set. Rows run from top to bottom, pixels from left to right. Pixels without a surface are 0 in every list of labels.
///
/// Camera axes are those of OpenCV: +X right, +Y down, +Z forward. With a rolling shutter the pose is that of the first row.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelledImage {
    /// Number of the sample in the data set, from 0.
    pub sample: u64,
    /// Number of the orbit, which is the scene of BOP.
    pub orbit: u32,
    /// Number of the image in its orbit, from 0. It is the image of BOP.
    pub number: u32,
    /// What it is for.
    pub split: Split,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The lens. The centre of the upper left pixel is (0.5, 0.5).
    pub lens: Lens,
    /// Distance of the camera's near plane [m].
    pub near: f64,
    /// Time from one row to the next [s]. 0 where all rows see one moment.
    pub line_time: f64,
    /// Time since the start of its orbit's run [s].
    pub time: f64,
    /// Takes body positions into camera axes [m].
    pub camera_from_body: DAffine3,
    /// Takes places in the model's file into the body frame, for the body (which is the identity) and then for each joint [m].
    pub links: Vec<DAffine3>,
    /// Position of each joint, in the order of `links` after the body.
    pub joints: Vec<JointPosition>,
    /// Unit vector to the Sun, camera axes.
    pub sun: DVec3,
    /// Share of the Sun's disc that the planet leaves visible from the craft, in [0, 1].
    pub lit: f64,
    /// Unit vector to the planet's centre, camera axes.
    pub planet: DVec3,
    /// Half the angle under which the planet appears from the craft [rad].
    pub planet_radius: f64,
    /// State and settings of the sensor by name. Each name ends with its unit.
    pub sensor: Vec<(String, f64)>,
    /// What was drawn for this sample by name, beyond what stands above.
    pub drawn: Vec<(String, f64)>,
    /// Bits of the digital numbers: 8, 14 or 16.
    pub bits: u32,
    /// Digital numbers of the sensor. `None` without one.
    pub digital_numbers: Option<Vec<u16>>,
    /// Radiance in the band [W m-2 sr-1].
    pub radiance: Vec<f32>,
    /// Surface temperature at the centre of the pixel [K].
    pub temperature: Vec<f32>,
    /// Distance along the camera's +Z at the centre of the pixel [m].
    pub depth: Vec<f32>,
    /// Index of the part at the centre of the pixel + 1.
    pub part: Vec<u32>,
    /// Index of the material at the centre of the pixel + 1.
    pub material: Vec<u32>,
    /// Share of the samples of a pixel that show a surface. Empty with one sample of a pixel.
    pub coverage: Vec<f32>,
}

impl LabelledImage {
    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Takes places in the model's file into camera axes, for the body or for a joint + 1 [m].
    pub fn camera_from_link(&self, link: usize) -> DAffine3 {
        self.camera_from_body * self.links.get(link).copied().unwrap_or(DAffine3::IDENTITY)
    }

    /// Rotates body vectors into camera axes, with a positive scalar part.
    pub fn quaternion(&self) -> DQuat {
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
    pub fn distortion(&self) -> (&'static str, Vec<f64>) {
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
