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
pub(crate) mod tests {
    use glam::Vec3;

    use super::super::craft::{Craft, KeyPoint};
    use super::*;

    /// Two triangles: a hull on the body, and a wing on a joint.
    pub(crate) fn small_craft() -> Craft {
        let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        Craft {
            name: "small".to_owned(),
            parts: vec!["hull".to_owned(), "wing".to_owned()],
            materials: vec!["paint".to_owned()],
            links: vec!["body".to_owned(), "hinge".to_owned()],
            link_of_part: vec![0, 1],
            positions: vec![
                corner(0.0, 0.0),
                corner(1.0, 0.0),
                corner(0.0, 1.0),
                corner(1.0, 0.0),
                corner(3.0, 0.0),
                corner(3.0, 1.0),
            ],
            normals: vec![Vec3::Z; 6],
            vertex_part: vec![0, 0, 0, 1, 1, 1],
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            key_points: vec![KeyPoint { name: "tip".to_owned(), link: 1, position: corner(3.0, 1.0) }],
            symmetries: Vec::new(),
        }
    }

    /// Four by three pixels: two of the hull and one of the wing.
    pub(crate) fn small() -> LabelledImage {
        let seen = |hull: f32, wing: f32| {
            let mut values = vec![0.0; 12];
            (values[5], values[6], values[2]) = (hull, hull, wing);
            values
        };
        let whole = |values: Vec<f32>| values.iter().map(|value| *value as u32).collect::<Vec<_>>();
        LabelledImage {
            identity: ImageIdentity {
                sample: 7,
                orbit: 3,
                number: 2,
                split: Split::Validation,
                bits: 14,
                sensor: vec![("temperature_K".to_owned(), 293.0)],
                drawn: Vec::new(),
            },
            width: 4,
            height: 3,
            lens: Lens::pinhole([10.0, 20.0], [2.0, 1.5]),
            near: 0.1,
            line_time: 0.0,
            time: 12.5,
            camera_from_body: DAffine3::from_rotation_translation(
                DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2),
                DVec3::new(0.25, 0.0, 2.0),
            ),
            links: vec![DAffine3::IDENTITY, DAffine3::from_translation(DVec3::new(0.0, 0.0, 1.0))],
            joints: vec![JointPosition { name: "hinge".to_owned(), position: 1.0, turns: false }],
            sun: DVec3::X,
            lit: 1.0,
            planet: DVec3::NEG_Y,
            planet_radius: 1.2,
            channels: ImageChannels {
                digital_numbers: Some(vec![5; 12]),
                radiance: seen(40.0, 50.0),
                temperature: seen(280.0, 300.004),
                depth: seen(2.0, 3.0),
                part: whole(seen(1.0, 2.0)),
                material: whole(seen(1.0, 1.0)),
                coverage: Vec::new(),
            },
        }
    }

    #[test]
    fn pixels_are_those_of_opencv() {
        let image = small();
        assert_eq!(image.camera_matrix(), [10.0, 0.0, 1.5, 0.0, 20.0, 1.0, 0.0, 0.0, 1.0]);
        assert_eq!(image.project(DVec3::new(0.0, 0.0, 3.0)), Some(DVec2::new(1.5, 1.0)));
        assert_eq!(image.project(DVec3::new(1.0, 0.0, -3.0)), None);
        let turn = image.quaternion();
        assert!((turn * DVec3::X).distance(DVec3::Y) < 1e-15, "X of the body is down in the image");
        assert!(turn.w > 0.0);
    }
}
