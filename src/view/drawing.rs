//! Draws the image of a page and packs it with the values that the page shows beside it.

use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

use super::camera::PageCamera;
use super::packet::{Plane, Planes};
use super::player::{Player, ShownImage};
use super::request::PageQuantity;
use crate::output::apparent::Apparent;
use crate::scene::Camera;
use crate::simulation::facade_error::SimulationError;
use crate::thermal::budget::CHANNELS;

/// The values that come with an image.
#[derive(Debug, Serialize)]
struct Header<'a> {
    time: f64,
    step: u32,
    /// The step to which time goes, where it is not there yet.
    goal: u32,
    playing: bool,
    width: u32,
    height: u32,
    planes: &'a [Plane],
    #[serde(flatten)]
    camera: HeaderCamera,
    #[serde(flatten)]
    light: HeaderLight,
    /// Positions of the joints [deg or m].
    joints: Vec<f64>,
    /// Numbers of the probes, and their temperatures [K] where this step is kept.
    probes: Vec<u64>,
    probe_temperatures: Option<Vec<f32>>,
    /// Median device times [ms].
    passes: &'a [(String, f64)],
    #[serde(flatten)]
    times: HostTimes,
}

#[derive(Debug, Serialize)]
struct HeaderCamera {
    /// Whether the camera stands where the scene's camera stands.
    scene_camera: bool,
    /// Rows of the rotation from body axes to camera axes.
    camera_from_body: [[f64; 3]; 3],
    /// The camera in the body frame [m].
    position: [f64; 3],
}

#[derive(Debug, Serialize)]
struct HeaderLight {
    /// Unit vectors to the Sun and to the planet's centre, body frame.
    sun: [f64; 3],
    planet: [f64; 3],
    /// Share of the Sun's disc that the planet leaves visible.
    lit: f64,
}

#[derive(Debug, Serialize)]
struct HostTimes {
    /// Host time of the last step, of this image, and of bringing it into this form [ms].
    step_ms: f64,
    image_ms: f64,
    pack_ms: f64,
}

/// Settings that all pages have in common.
pub(crate) struct Common {
    /// The camera without a pose.
    pub(crate) camera: Camera,
    /// Brightness temperatures of the scene's band.
    pub(crate) apparent: Apparent,
}

/// How time stands.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaybackClock {
    /// The step to which time goes.
    pub(crate) goal: u32,
    /// Whether it goes on.
    pub(crate) playing: bool,
}

/// The image of a page as a message, and the record of its pixels for later questions.
///
/// # Errors
/// A pose that can not be used, or a call that fails.
pub(crate) fn draw(
    player: &mut Player,
    common: &Common,
    look: &PageCamera,
    quantity: PageQuantity,
    clock: PlaybackClock,
) -> Result<(Vec<u8>, ShownImage), SimulationError> {
    let began = Instant::now();
    let (camera, pose) = look.of(&common.camera)?;
    let image = player.simulation().image(&camera, &pose)?;
    let image_ms = began.elapsed().as_secs_f64() * 1e3;
    let began = Instant::now();
    let (step, step_ms) = (player.step(), player.step_ms());
    let probe_temperatures = player.present();
    let probes = player.probes().iter().map(|probe| probe.id).collect();
    let simulation = player.simulation();
    let prepared = simulation.prepared();
    let mut planes = Planes::default();
    planes.temperatures("temperature", &image.temperature);
    if !image.error.is_empty() {
        planes.errors(&image.error);
    }
    for (cause, name) in CHANNELS.into_iter().enumerate().filter(|_| !image.budget.is_empty()) {
        planes.gains(name, image.budget.iter().map(|budget| budget[cause]));
    }
    planes.labels("part", &image.part, prepared.parts.len());
    planes.labels("material", &image.material, prepared.materials.len());
    match (quantity, &image.digital_numbers) {
        (PageQuantity::Apparent, _) => {
            let apparent: Vec<f32> =
                image.radiance.par_iter().map(|value| common.apparent.temperature(*value)).collect();
            planes.temperatures("apparent", &apparent);
        }
        (PageQuantity::Counts, Some(numbers)) => planes.counts(numbers),
        _ => {}
    }
    let turns = prepared.loads.joints().joints().iter().map(crate::environment::joints::Joint::turns);
    let joints = simulation.joints().into_iter().zip(turns);
    let joints = joints.map(|((_, position), turns)| if turns { position.to_degrees() } else { position }).collect();
    let (sky, passes) = (simulation.sky(), simulation.pass_times());
    let rotation = image.camera_from_body.matrix3.transpose();
    let header = Header {
        time: image.time,
        step,
        goal: clock.goal,
        playing: clock.playing,
        width: image.camera.width,
        height: image.camera.height,
        planes: &planes.listed,
        camera: HeaderCamera {
            scene_camera: matches!(look, PageCamera::Scene),
            camera_from_body: [rotation.x_axis, rotation.y_axis, rotation.z_axis].map(|row| row.to_array()),
            position: image.camera_from_body.inverse().translation.to_array(),
        },
        light: HeaderLight {
            sun: sky.sun_direction.to_array(),
            planet: sky.nadir_direction.to_array(),
            lit: sky.lit_fraction,
        },
        joints,
        probes,
        probe_temperatures,
        passes: &passes,
        times: HostTimes { step_ms, image_ms, pack_ms: began.elapsed().as_secs_f64() * 1e3 },
    };
    let packet = planes.packet(&serde_json::to_string(&header).unwrap_or_default());
    Ok((packet, ShownImage::new(image)))
}
