//! `[camera]`: a camera with its lens, its pose or path, and the samples of a pixel.

mod lens;
mod path;
mod pose;

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::error::SceneError;
use super::preset::Preset;
use super::quantity::Quantity;
use super::section::Section;
use super::vector::point;
use super::{Camera, CameraFrame, MotionBlur};
use crate::environment::pose_path::look;
use crate::lens::Lens;

pub(super) use path::PathOrbit;
pub(crate) use path::{Poses, read_poses};

use super::motion::Motion;

/// Largest image side [px]. Vulkan devices commonly allow this much.
const MOST_PIXELS: u32 = 16384;

const SAMPLES: [u32; 4] = [1, 4, 8, 16];
/// Samples of a pixel where a scene states none.
pub(crate) const USUAL_SAMPLES: u32 = 4;

/// Default distance before which nothing is seen [m].
const NEAR: f64 = 0.1;
/// Size [px] and field of view [deg] of the image of a scene without a camera.
const UNSTATED: [u32; 2] = [640, 512];
const UNSTATED_FOV: f64 = 30.0;
/// The side from which a camera without a pose sees the craft, and its distance beside the least one.
const FRAMED_FROM: [f64; 3] = [1.0, -1.2, 0.8];
const MARGIN: f64 = 1.05;
/// Sub-frames of an exposure that states none.
const USUAL_SUB_FRAMES: u32 = 9;
/// The keys of a pose. A camera without any is framed.
const POSE: [&str; 10] =
    ["frame", "position", "look_at", "up", "quaternion", "path", "path_relative_to", "attitude", "object", "mount"];

const FRAMES: [(&str, CameraFrame); 3] =
    [("body", CameraFrame::Body), ("orbit", CameraFrame::Orbit), ("inertial", CameraFrame::Inertial)];

pub(super) fn read(
    section: &Section,
    preset: Option<&Preset>,
    around: &PathOrbit<'_>,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Camera, SceneError> {
    let width = section.whole("width", 1..=MOST_PIXELS)?.or(preset.map(|preset| preset.size[0]));
    let width = section.required("width", width, "the image's width in pixels")?;
    let height = section.whole("height", 1..=MOST_PIXELS)?.or(preset.map(|preset| preset.size[1]));
    let height = section.required("height", height, "the image's height in pixels")?;
    let lens = lens::read(section, preset, [width, height], assumptions)?;
    let samples = section.whole("samples", 1..=16)?.unwrap_or(USUAL_SAMPLES);
    if !SAMPLES.contains(&samples) {
        return Err(section.error("samples", format!("must be 1, 4, 8 or 16, found {samples}")));
    }
    let line_time = section.number("line_time", Quantity::within(0.0, 1.0, "s"))?.unwrap_or(0.0);
    let exposure = exposure(section)?;
    if !POSE.iter().any(|key| section.has(key)) {
        let near = near(section, assumptions)?;
        return Ok(Camera { samples, line_time, exposure, near, ..framed([width, height], lens) });
    }
    let stated = section.choice("frame", &FRAMES)?;
    let path = path::read(section, stated, around, files, assumptions)?;
    let of_path = path.as_ref().and_then(|(frame, _)| *frame);
    let frame = stated.or(of_path).unwrap_or_else(|| {
        assumptions.push("The camera follows the craft (camera.frame is absent: 'body').".to_string());
        CameraFrame::Body
    });
    let (motion, position, frame_from_camera) = match path {
        Some((_, path)) => {
            let (position, rotation) = path.first();
            (Motion::Path(Arc::new(path)), position, rotation)
        }
        None => {
            let position = point(section, "position")?;
            let what = "where the camera is, [x, y, z] in its frame [m], or a camera.path";
            let position = section.required("position", position, what)?;
            (Motion::Still, position, pose::rotation(section, frame, position, assumptions)?)
        }
    };
    let near = near(section, assumptions)?;
    Ok(Camera { width, height, lens, samples, line_time, exposure, motion, frame, position, frame_from_camera, near })
}

/// The interval in which a pixel collects light.
fn exposure(section: &Section) -> Result<MotionBlur, SceneError> {
    let time = section.number("exposure_time", Quantity::within(0.0, MotionBlur::LONGEST, "s"))?.unwrap_or(0.0);
    let sub_frames = section.whole("sub_frames", 3..=MotionBlur::MOST)?;
    match sub_frames {
        Some(_) if time == 0.0 => {
            Err(section.error("sub_frames", "needs camera.exposure_time above 0: an instant has no sub-frames"))
        }
        Some(even) if even.is_multiple_of(2) => {
            Err(section.error("sub_frames", format!("must be odd, so that one lies in the middle, found {even}")))
        }
        _ if time == 0.0 => Ok(MotionBlur::default()),
        _ => Ok(MotionBlur { time, sub_frames: sub_frames.unwrap_or(USUAL_SUB_FRAMES) }),
    }
}

/// Distance before which nothing is seen [m].
fn near(section: &Section, assumptions: &mut Vec<String>) -> Result<f64, SceneError> {
    Ok(section.number("near", Quantity::positive("m"))?.unwrap_or_else(|| {
        assumptions.push(format!("Nothing nearer than {NEAR} m to the camera is seen (camera.near is absent)."));
        NEAR
    }))
}

/// A camera whose place follows from the model.
fn framed([width, height]: [u32; 2], lens: Lens) -> Camera {
    Camera {
        width,
        height,
        lens,
        samples: USUAL_SAMPLES,
        line_time: 0.0,
        exposure: MotionBlur::default(),
        motion: Motion::Framed,
        frame: CameraFrame::Body,
        position: DVec3::ZERO,
        frame_from_camera: DQuat::IDENTITY,
        near: NEAR,
    }
}

/// The camera of a scene that states none.
pub(super) fn unstated(assumptions: &mut Vec<String>) -> Camera {
    let [width, height] = UNSTATED;
    assumptions.push(format!(
        "The camera has {width} x {height} pixels and a field of view of {UNSTATED_FOV} deg (the scene has no [camera])."
    ));
    let focal = f64::from(width) / 2.0 / (0.5 * UNSTATED_FOV).to_radians().tan();
    framed(UNSTATED, Lens::pinhole([focal; 2], UNSTATED.map(|side| f64::from(side) / 2.0)))
}

impl Camera {
    /// Places a camera without a pose so that it sees all of a sphere around the craft, and says where.
    pub(crate) fn frame(&mut self, middle: DVec3, radius: f64) -> Option<String> {
        if self.motion != Motion::Framed {
            return None;
        }
        let [fx, fy] = self.lens.focal;
        let half = (f64::from(self.width) / 2.0 / fx).min(f64::from(self.height) / 2.0 / fy).atan();
        let distance = MARGIN * radius.max(f64::MIN_POSITIVE) / half.sin();
        let from = DVec3::from(FRAMED_FROM).normalize();
        self.motion = Motion::Still;
        self.position = middle + distance * from;
        self.frame_from_camera = look(-from, DVec3::Z);
        let free = 0.5 * (distance - radius);
        let closer = if self.near > free { format!(", and sees from {free:.3} m on") } else { String::new() };
        self.near = self.near.min(free);
        let [[x, y, z], [a, b, c]] = [self.position, middle].map(|point| point.to_array());
        Some(format!(
            "The camera sees the whole craft from [{x:.3}, {y:.3}, {z:.3}] m, looks at [{a:.3}, {b:.3}, {c:.3}] m{closer} (camera.position, \
             camera.quaternion and camera.path are absent)."
        ))
    }
}
