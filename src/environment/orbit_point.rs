//! Orbit of a scene: positions of craft and Sun at an instant.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::orbit::{CircularOrbit, SUN_DISTANCE};
use super::placements::{Course, Placements};
use super::trajectory::Trajectory;

/// Source of the craft's position.
#[derive(Debug, Clone, PartialEq)]
pub enum Orbit {
    /// A circular orbit, with the Sun's direction given by beta and phase.
    Circular(CircularOrbit),
    /// A real trajectory around the Earth, with the real position of the Sun.
    Trajectory(Arc<Trajectory>),
    /// Places that something outside gives, one after the other.
    Given(Arc<Placements>),
}

/// Craft and Sun at an instant, in the inertial frame (GCRF for a trajectory, the orbit's own frame for a circular orbit).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrbitPoint {
    /// Time since the start [s].
    pub(crate) time: f64,
    /// Craft from the planet's centre [m].
    pub position: DVec3,
    /// Sun from the planet's centre [m].
    pub sun: DVec3,
    /// Unit vector from the craft to the Sun.
    pub(crate) sun_direction: DVec3,
    /// Rotates orbit-frame (LVLH: X along the velocity, Y against the orbit normal, Z nadir) vectors into the inertial frame.
    pub inertial_from_orbit: DMat3,
    /// Solar flux over the solar flux at one astronomical unit.
    pub(crate) solar_scale: f64,
    /// Angular rate of the craft round the planet [rad/s].
    pub(crate) rate: f64,
}

impl From<&CircularOrbit> for Orbit {
    fn from(orbit: &CircularOrbit) -> Self {
        Self::Circular(orbit.clone())
    }
}

impl From<&Orbit> for Orbit {
    fn from(orbit: &Orbit) -> Self {
        orbit.clone()
    }
}

impl From<Arc<Trajectory>> for Orbit {
    fn from(trajectory: Arc<Trajectory>) -> Self {
        Self::Trajectory(trajectory)
    }
}

impl Orbit {
    /// Period [s]. A trajectory has the period of its osculating orbit at time 0. Given places have an infinite one.
    pub fn period(&self) -> f64 {
        match self {
            Self::Circular(orbit) => orbit.period,
            Self::Trajectory(trajectory) => trajectory.period(),
            Self::Given(_) => f64::INFINITY,
        }
    }

    /// The trajectory. `None` for any other orbit.
    pub(crate) fn trajectory(&self) -> Option<&Trajectory> {
        match self {
            Self::Circular(_) | Self::Given(_) => None,
            Self::Trajectory(trajectory) => Some(trajectory),
        }
    }

    /// Craft and Sun at a time [s]. `None` where a trajectory does not cover it. A circular orbit measures its altitude from `planet_radius` [m].
    ///
    /// On a circular orbit the direction of the Sun is taken from the planet's centre. The parallax (5e-5 rad in low orbits) is a hundredth of the
    /// Sun's width. Without the parallax the sky repeats exactly, which is worth more.
    pub fn point(&self, time: f64, planet_radius: f64) -> Option<OrbitPoint> {
        match self {
            Self::Circular(orbit) => {
                let sun_direction = orbit.sun_direction();
                Some(OrbitPoint {
                    time,
                    position: orbit.zenith(time) * (planet_radius + orbit.altitude),
                    sun: sun_direction * SUN_DISTANCE,
                    sun_direction,
                    inertial_from_orbit: orbit.inertial_from_orbit(time),
                    solar_scale: 1.0,
                    rate: std::f64::consts::TAU / orbit.period,
                })
            }
            Self::Trajectory(trajectory) => {
                let state = trajectory.state(time)?;
                let momentum = state.position.cross(state.velocity);
                let rate = momentum.length() / state.position.length_squared();
                Some(OrbitPoint::new(time, state.position, trajectory.sun(time), momentum, rate))
            }
            Self::Given(places) => {
                let Course { position, sun, momentum, rate } = places.at(time);
                Some(OrbitPoint::new(time, position, sun, momentum, rate))
            }
        }
    }
}

impl OrbitPoint {
    /// A craft and the Sun at a time [s]: positions from the planet's centre [m], a vector along the orbit normal, and the rate round the planet [rad/s].
    fn new(time: f64, position: DVec3, sun: DVec3, momentum: DVec3, rate: f64) -> Self {
        let to_sun = sun - position;
        let z_axis = -position.normalize();
        // A craft that falls straight down has no orbit plane.
        let y_axis = (-momentum).try_normalize().unwrap_or_else(|| z_axis.any_orthonormal_vector());
        Self {
            time,
            position,
            sun,
            sun_direction: to_sun.normalize(),
            inertial_from_orbit: DMat3::from_cols(y_axis.cross(z_axis), y_axis, z_axis),
            solar_scale: (SUN_DISTANCE / to_sun.length()).powi(2),
            rate,
        }
    }
}
