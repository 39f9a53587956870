//! Draws the image of a page and packs it with the values that the page shows beside it.

use std::time::Instant;

use glam::DQuat;
use rayon::prelude::*;
use serde::Serialize;

use super::camera::PageCamera;
use super::packet::{Plane, Planes};
use super::player::{Player, ShownImage};
use super::probe_place::{ProbePlace, probe_places};
use super::request::PageQuantity;
use crate::output::apparent::Apparent;
use crate::scene::{Camera, Motion};
use crate::sensitivity::node_sigma::NodeSigma;
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
    /// Steps in a second that a page asked for, while time plays.
    rate: Option<f64>,
    width: u32,
    height: u32,
    planes: &'a [Plane],
    #[serde(flatten)]
    camera: HeaderCamera,
    #[serde(flatten)]
    light: HeaderLight,
    /// Positions of the joints [deg or m].
    joints: Vec<f64>,
    #[serde(flatten)]
    probes: HeaderProbes,
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
    /// Whether the path of the scene's camera has no pose at this time. The image then has the first pose of the path.
    off_path: bool,
    /// The camera in the body frame [m].
    position: [f64; 3],
    /// Rotates camera axes into the body frame, scalar first.
    quaternion: [f64; 4],
    /// Distance of the near plane [m].
    near: f64,
}

/// Numbers and places of the probes, and their temperatures [K] where this step is kept.
#[derive(Debug, Serialize)]
struct HeaderProbes {
    probes: Vec<u64>,
    probe_places: Vec<ProbePlace>,
    probe_temperatures: Option<Vec<f32>>,
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
    /// The uncertainty by the ranges of parameters, once a page has asked for it.
    pub(crate) sigma: Option<NodeSigma>,
}

/// How time stands.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaybackClock {
    /// The step to which time goes.
    pub(crate) goal: u32,
    /// Steps in a second while time plays.
    pub(crate) rate: Option<f64>,
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
    let time = player.simulation().time();
    let off_path = *look == PageCamera::Scene && common.camera.at(time, None).is_err();
    let (mut camera, pose) = look.of(&common.camera)?;
    if off_path {
        camera.motion = Motion::Still;
    }
    let image = player.simulation().image(&camera, &pose)?;
    let image_ms = began.elapsed().as_secs_f64() * 1e3;
    let began = Instant::now();
    let (step, step_ms) = (player.step(), player.step_ms());
    let probe_temperatures = player.present();
    let probes = player.probes().iter().map(|probe| probe.id).collect();
    let nodes: Vec<usize> = player.probes().iter().map(|probe| probe.node).collect();
    let probe_places = probe_places(player.simulation().prepared(), nodes.into_iter(), &image);
    let simulation = player.simulation();
    let prepared = simulation.prepared();
    let mut planes = Planes::default();
    planes.temperatures("temperature", &image.temperature);
    if !image.error.is_empty() {
        planes.errors("error", &image.error);
    }
    common.sigma.iter().for_each(|sigma| planes.uncertainty(&sigma.draw(prepared, &image)));
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
        playing: clock.rate.is_some(),
        rate: clock.rate,
        width: image.camera.width,
        height: image.camera.height,
        planes: &planes.listed,
        camera: HeaderCamera {
            scene_camera: matches!(look, PageCamera::Scene),
            camera_from_body: [rotation.x_axis, rotation.y_axis, rotation.z_axis].map(|row| row.to_array()),
            off_path,
            position: image.camera_from_body.inverse().translation.to_array(),
            quaternion: scalar_first(DQuat::from_mat3(&rotation)),
            near: image.camera.near,
        },
        light: HeaderLight {
            sun: sky.sun_direction.to_array(),
            planet: sky.nadir_direction.to_array(),
            lit: sky.lit_fraction,
        },
        joints,
        probes: HeaderProbes { probes, probe_places, probe_temperatures },
        passes: &passes,
        times: HostTimes { step_ms, image_ms, pack_ms: began.elapsed().as_secs_f64() * 1e3 },
    };
    let packet = planes.packet(&serde_json::to_string(&header).unwrap_or_default());
    Ok((packet, ShownImage::new(image)))
}

fn scalar_first(rotation: DQuat) -> [f64; 4] {
    [rotation.w, rotation.x, rotation.y, rotation.z]
}
