//! Judges the view of a camera before anything is drawn: whether an attempt is rejected.

use glam::{DAffine3, DVec2, DVec3};

use super::spec::Reject;
use crate::environment::Sky;
use crate::scene::Camera;
use crate::simulation::prepare::Prepared;

/// Why an attempt is rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// The time has not the light that is asked for.
    Light,
    /// There is no pose.
    NoPose,
    /// Too little of the craft lies in the frame.
    OutOfView,
    /// The camera is too near to the craft, or in it.
    TooClose,
    /// The Sun is in the frame.
    SunInView,
    /// The planet is in the frame.
    PlanetInView,
    /// The craft covers too few pixels.
    TooFewPixels,
}

impl Reason {
    /// In words, as reports have it.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Light => "other light",
            Self::NoPose => "no pose",
            Self::OutOfView => "craft out of view",
            Self::TooClose => "too close",
            Self::SunInView => "Sun in view",
            Self::PlanetInView => "planet in view",
            Self::TooFewPixels => "too few pixels",
        }
    }
}

/// Most points of the craft that are looked at.
const MOST_POINTS: usize = 4096;

/// Rays along each side of the frame by which the planet is found.
const RAYS: u32 = 16;

/// Points of the craft at a time [s], body frame [m].
pub(crate) fn points(prepared: &Prepared, time: f64) -> Vec<DVec3> {
    let nodes = &prepared.nodes;
    let poses = prepared.loads.joints_at(time).1;
    let stride = nodes.node_of_vertex.len().div_ceil(MOST_POINTS).max(1);
    let place = |slot: &u32| {
        let slot = *slot as usize;
        let place = nodes.positions[slot].as_dvec3();
        poses.get(nodes.joint(slot) as usize).map_or(place, |pose| pose.transform_point3(place))
    };
    nodes.node_of_vertex.iter().step_by(stride).map(place).collect()
}

/// Why a view is rejected. `None` where it is not.
pub(crate) fn rejected(
    reject: &Reject,
    camera: &Camera,
    pose: &DAffine3,
    points: &[DVec3],
    sky: &Sky,
) -> Option<Reason> {
    let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    let in_frame = |place: DVec3| {
        let pixel = (place.z > 0.0).then(|| camera.lens.project(place.truncate() / place.z));
        pixel.is_some_and(|pixel| pixel.cmpge(DVec2::ZERO).all() && pixel.cmplt(size).all())
    };
    let (mut visible, mut nearest) = (0, f64::INFINITY);
    for point in points {
        let place = pose.transform_point3(*point);
        nearest = nearest.min(place.length());
        visible += usize::from(in_frame(place));
    }
    let turn = pose.matrix3;
    if nearest < reject.clearance {
        return Some(Reason::TooClose);
    }
    if (visible as f64) < reject.in_view * points.len() as f64 {
        return Some(Reason::OutOfView);
    }
    if reject.sun && sky.lit_fraction > 0.0 && in_frame(turn * sky.sun_direction) {
        return Some(Reason::SunInView);
    }
    if reject.planet {
        let least = (1.0 - sky.distance_ratio.powi(-2)).max(0.0).sqrt();
        let planet = turn * sky.nadir_direction;
        let on_planet = |x: u32, y: u32| {
            let pixel = size * DVec2::new(f64::from(x), f64::from(y)) / f64::from(RAYS);
            let ray = camera.lens.unproject(pixel).map(|ray| ray.extend(1.0).normalize());
            ray.is_some_and(|ray| ray.dot(planet) > least)
        };
        if (0..=RAYS).any(|y| (0..=RAYS).any(|x| on_planet(x, y))) {
            return Some(Reason::PlanetInView);
        }
    }
    None
}
