//! The way of a craft between two states that a client sends. Nobody says where it was in between.

use glam::{DQuat, DVec3};

use super::error::Refusal;
use crate::environment::scene_time::{SceneTime, TimeError};
use crate::simulation::facade::Placement;

/// Where a craft is at a time. Vectors have inertial axes and begin at the planet's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CourseState {
    /// Time since the start.
    pub(crate) time: SceneTime,
    /// The craft [m].
    pub position: DVec3,
    /// Velocity of the craft [m/s].
    pub(crate) velocity: DVec3,
    /// The Sun [m].
    pub(crate) sun: DVec3,
    /// Rotates body vectors into the inertial axes.
    pub(crate) inertial_from_body: DQuat,
    /// Gravitational parameter of the planet [m3/s2]. 0 if it is unknown.
    pub(crate) gravity: f64,
}

impl CourseState {
    pub(crate) fn placement(&self) -> Placement {
        Placement {
            time: self.time.seconds(),
            position: Some(self.position),
            velocity: (self.velocity != DVec3::ZERO).then_some(self.velocity),
            sun: Some(self.sun),
            inertial_from_body: Some(self.inertial_from_body),
        }
    }

    /// The state at a place. This state fills in everything that the place leaves out.
    ///
    /// # Errors
    /// The place has no time.
    pub(crate) fn at(&self, place: &Placement) -> Result<Self, TimeError> {
        Ok(Self {
            time: SceneTime::new(place.time)?,
            position: place.position.unwrap_or(self.position),
            velocity: place.velocity.unwrap_or(self.velocity),
            sun: place.sun.unwrap_or(self.sun),
            inertial_from_body: place.inertial_from_body.unwrap_or(self.inertial_from_body),
            gravity: self.gravity,
        })
    }
}

/// Most places of the craft between two states.
pub(crate) const MOST_PLACES: f64 = 1e5;
/// Angle round the planet of a step of the integration [rad]. The error of a revolution is then below 1 m in low orbits.
const ARC: f64 = 0.01;

/// Most steps of the integration between two states, from either end.
const MOST_ARCS: f64 = 2e6;

/// Places after `from` up to and with `to`, at the ends of steps of a length [s] and at `to`.
///
/// Under way the craft falls freely from both ends, and the two positions are mixed by the share of time. So it meets both states, and a force other than the
/// planet's gravity acts all the same. Attitudes follow the shorter arc, because the body rate is not sent. Without velocities or gravity there is no place
/// under way, and [`crate::simulation::facade::Simulation::place`] interpolates.
///
/// # Errors
/// Too many places, or an integration of too many steps.
pub(crate) fn between(from: &CourseState, to: &CourseState, length: f64) -> Result<Vec<Placement>, Refusal> {
    let (start, end) = (from.time.seconds(), to.time.seconds());
    let gap = |reason: &dyn std::fmt::Display| Refusal::because(format!("no state came for too long: {reason}"));
    let times: Vec<f64> = from.time.ends_of_steps(to.time, length, MOST_PLACES).map_err(|error| gap(&error))?.collect();
    let known = to.gravity > 0.0 && from.velocity != DVec3::ZERO && to.velocity != DVec3::ZERO;
    if !known {
        return Ok(vec![to.placement()]);
    }
    let span = end - start;
    let hostile = |arcs: f64| {
        let (gravity, most) = (to.gravity, MOST_ARCS);
        gap(&format!(
            "a planet of {gravity:e} m3/s2 asks for {arcs:.1e} steps of its integration, and the limit is {most:e}"
        ))
    };
    // Before the integration begins, the rates at its ends tell how long it is.
    let arcs = [from, to].map(|state| span * rate(state.position, state.velocity, to.gravity) / ARC);
    if let Some(arcs) = arcs.into_iter().find(|arcs| is_too_many(*arcs)) {
        return Err(hostile(arcs));
    }
    let forth = fall(from, times.iter().copied(), to.gravity).map_err(hostile)?;
    let mut back = fall(to, times.iter().rev().copied(), to.gravity).map_err(hostile)?;
    back.reverse();
    let place = |((time, forth), back): ((f64, [DVec3; 2]), [DVec3; 2])| {
        let share = (time - start) / span;
        Placement {
            time,
            position: Some(forth[0].lerp(back[0], share)),
            velocity: Some(forth[1].lerp(back[1], share)),
            sun: Some(from.sun.lerp(to.sun, share)),
            inertial_from_body: Some(from.inertial_from_body.slerp(to.inertial_from_body, share)),
        }
    };
    let mut places: Vec<Placement> = times.into_iter().zip(forth).zip(back).map(place).collect();
    places.push(to.placement());
    Ok(places)
}

fn is_too_many(arcs: f64) -> bool {
    arcs.is_nan() || arcs > MOST_ARCS
}

/// Rate at which a craft goes round a point mass, at least [rad/s].
fn rate(position: DVec3, velocity: DVec3, gravity: f64) -> f64 {
    (gravity / position.length().powi(3)).sqrt().max(velocity.length() / position.length())
}

/// Positions and velocities at times, each after the other, of a craft that falls freely round a point mass (Runge-Kutta of order 4).
///
/// # Errors
/// The number of steps, where they are too many.
fn fall(start: &CourseState, times: impl Iterator<Item = f64>, gravity: f64) -> Result<Vec<[DVec3; 2]>, f64> {
    let pull = |position: DVec3| -gravity * position / position.length().powi(3);
    let (mut now, mut position, mut velocity) = (start.time.seconds(), start.position, start.velocity);
    let (mut states, mut arcs) = (Vec::new(), 0.0);
    for time in times {
        let steps = ((time - now).abs() * rate(position, velocity, gravity) / ARC).ceil().max(1.0);
        arcs += steps;
        // A craft that falls into the planet's centre has no rate that is a number.
        if is_too_many(arcs) {
            return Err(arcs);
        }
        let h = (time - now) / steps;
        for _ in 0..steps as usize {
            let (k1, l1) = (velocity, pull(position));
            let (k2, l2) = (velocity + 0.5 * h * l1, pull(position + 0.5 * h * k1));
            let (k3, l3) = (velocity + 0.5 * h * l2, pull(position + 0.5 * h * k2));
            let (k4, l4) = (velocity + h * l3, pull(position + h * k3));
            position += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            velocity += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
        }
        now = time;
        states.push([position, velocity]);
    }
    Ok(states)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const MU: f64 = 3.986_004_418e14;

    /// A circular orbit of 7000 km, turning about +X by 1 deg/s.
    fn state(time: f64) -> CourseState {
        let rate = (MU / 7e6f64.powi(3)).sqrt();
        let (sin, cos) = (rate * time).sin_cos();
        CourseState {
            time: SceneTime::new(time).expect("a time"),
            position: 7e6 * DVec3::new(cos, sin, 0.0),
            velocity: 7e6 * rate * DVec3::new(-sin, cos, 0.0),
            sun: 1.5e11 * DVec3::Y,
            inertial_from_body: DQuat::from_rotation_x(time.to_radians()),
            gravity: MU,
        }
    }

    #[test]
    fn a_craft_between_two_states_is_where_its_orbit_is() {
        let period = TAU / (MU / 7e6f64.powi(3)).sqrt();
        for span in [30.0, 600.0, 0.75 * period, 2.25 * period] {
            let places = between(&state(7.0), &state(7.0 + span), 10.0).expect("few places");
            assert_eq!(places[0].time, 10.0);
            assert_eq!(places.last(), Some(&state(7.0 + span).placement()));
            for place in &places {
                let expected = state(place.time);
                let position = place.position.expect("a position");
                assert!(position.distance(expected.position) < 5.0, "{} of {span}: {position}", place.time);
                if span < 150.0 {
                    let angle =
                        place.inertial_from_body.expect("an attitude").angle_between(expected.inertial_from_body);
                    assert!(angle < 1e-6, "{angle}");
                }
            }
            let wrong = CourseState { gravity: 0.9 * MU, ..state(7.0 + span) };
            let places = between(&state(7.0), &wrong, 10.0).expect("few places");
            let middle = places[places.len() / 2];
            assert!(middle.position.expect("a position").distance(state(middle.time).position) > 10.0 || span < 600.0);
        }
    }

    #[test]
    fn a_planet_beyond_reason_starts_no_integration() {
        let with = |gravity: f64| CourseState { gravity, ..state(9e5) };
        assert!(between(&state(0.0), &with(MU), 10.0).is_ok());
        for gravity in [1e25, 1e69, f64::INFINITY] {
            let refused = between(&state(0.0), &with(gravity), 10.0).expect_err("it is refused").to_string();
            assert!(refused.contains("steps of its integration"), "{refused}");
        }
    }

    #[test]
    fn a_gap_of_years_is_refused_and_one_without_velocities_has_its_end_only() {
        assert!(between(&state(0.0), &state(1e9), 10.0).is_err());
        let still = CourseState { velocity: DVec3::ZERO, ..state(0.0) };
        assert_eq!(between(&still, &state(95.0), 10.0).expect("few places"), [state(95.0).placement()]);
        assert_eq!(between(&state(0.0), &state(10.0), 10.0).expect("few places").len(), 1);
    }
}
