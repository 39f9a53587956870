//! Places of a craft that something outside gives, one after the other: its position, the Sun's and its attitude at increasing times.

use glam::{DQuat, DVec3};

use super::orbit::SUN_RADIUS;
use super::scene_time::{SceneTime, TimeError};
use super::state::SLACK;

/// Largest error of the length of an attitude's quaternion, as in a scene.
const QUATERNION_TOLERANCE: f64 = 1e-3;

/// Where a craft and the Sun are at a time. All vectors are in one inertial frame, from the planet's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlacementSample {
    /// Time since the start [s].
    pub(crate) time: f64,
    /// The craft [m].
    pub(crate) position: DVec3,
    /// Velocity [m/s]. Where no velocity is given, the orbit frame has the plane of two neighbouring positions.
    pub(crate) velocity: Option<DVec3>,
    /// The Sun [m].
    pub(crate) sun: DVec3,
    pub(crate) inertial_from_body: DQuat,
}

/// Craft and Sun at a time between places, from the planet's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Course {
    /// The craft [m].
    pub(crate) position: DVec3,
    /// The Sun [m].
    pub(crate) sun: DVec3,
    /// A vector along the normal of the orbit. Zero where the normal is unknown.
    pub(crate) momentum: DVec3,
    /// Rate of the craft round the planet [rad/s].
    pub(crate) rate: f64,
}

/// Greatest distance of craft and Sun from the planet's centre [m], and greatest speed [m/s], as scenes have them.
const FARTHEST: f64 = 1e13;
const FASTEST: f64 = 1e6;

/// Why a place is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlaceError {
    /// A value that is not finite, or a vector without a direction.
    #[error("{what} must be finite and not zero")]
    Unusable {
        /// Name of the value.
        what: &'static str,
    },
    /// A length or speed beyond what is computed with.
    #[error("{what} is {size:e} {unit} or more, and at most {most:e} {unit} are taken")]
    Huge {
        /// Name of the value.
        what: &'static str,
        /// Its size.
        size: f64,
        /// The largest that is taken.
        most: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A Sun in which the craft or the planet would be.
    #[error("the Sun is {distance} km from {whom}, and its radius is {} km: its place is in metres from the planet's centre", SUN_RADIUS / 1e3)]
    InSun {
        /// What lies in it.
        whom: &'static str,
        /// Distance of its centre [km].
        distance: f64,
    },
    /// A quaternion of another length than 1.
    #[error("the quaternion of the attitude must have length 1, not {length}")]
    Length {
        /// Its length.
        length: f64,
    },
    /// A number that is no time.
    #[error(transparent)]
    Time(#[from] TimeError),
    /// A place that does not come after the one before.
    #[error("a place at {time} s must come after the one at {last} s")]
    Order {
        /// Time [s].
        time: f64,
        /// Time of the last place [s].
        last: f64,
    },
    /// A position inside the planet.
    #[error("at {time} s the craft is {distance:.0} km from the centre of a planet of {radius:.0} km")]
    Underground {
        /// Time [s].
        time: f64,
        /// Distance from the centre [km].
        distance: f64,
        /// Radius of the planet [km].
        radius: f64,
    },
    /// A time that no place covers.
    #[error("the craft has places from {from} to {to} s, and one at {time} s is needed")]
    Uncovered {
        /// Time that is needed [s].
        time: f64,
        /// Time of the first place [s].
        from: f64,
        /// Time of the last place [s].
        to: f64,
    },
}

/// Places in order of time. Between two of them, positions follow the arc round the planet, attitudes the shorter arc, and the Sun a line. After
/// the last one nothing moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Placements {
    places: Vec<PlacementSample>,
}

impl Placements {
    /// The first place of a craft round a planet of a radius [m].
    ///
    /// # Errors
    /// An unusable value.
    pub(crate) fn new(first: PlacementSample, planet_radius: f64) -> Result<Self, PlaceError> {
        check(&first, planet_radius)?;
        Ok(Self { places: vec![first] })
    }

    /// The places with `next` at the end, without the places that are over at the time `now` [s].
    ///
    /// # Errors
    /// An unusable value, or a time that is not later than the last one.
    pub(crate) fn and(&self, next: PlacementSample, now: f64, planet_radius: f64) -> Result<Self, PlaceError> {
        check(&next, planet_radius)?;
        let last = self.last().time;
        if next.time <= last {
            return Err(PlaceError::Order { time: next.time, last });
        }
        // The place before the present one keeps the plane of the orbit.
        let over = self.places.partition_point(|place| place.time <= now).saturating_sub(2);
        let mut places = self.places[over..].to_vec();
        places.push(next);
        Ok(Self { places })
    }

    pub(crate) fn last(&self) -> &PlacementSample {
        &self.places[self.places.len() - 1]
    }

    /// Times of the places [s].
    pub(crate) fn times(&self) -> impl Iterator<Item = f64> {
        self.places.iter().map(|place| place.time)
    }

    /// Checks that places cover an interval [s].
    ///
    /// # Errors
    /// The first time that is not covered.
    pub(crate) fn check(&self, from: f64, to: f64) -> Result<(), PlaceError> {
        let (first, last) = (self.places[0].time, self.last().time);
        let uncovered = |time| Err(PlaceError::Uncovered { time, from: first, to: last });
        if from < first - SLACK {
            return uncovered(from);
        }
        if to > last + SLACK { uncovered(to) } else { Ok(()) }
    }

    /// The places before and after a time [s], and the share of the way between them.
    fn around(&self, time: f64) -> (&PlacementSample, &PlacementSample, f64) {
        let most = self.places.len() - 1;
        let after = self.places.partition_point(|place| place.time <= time).clamp(1.min(most), most);
        let (a, b) = (&self.places[after.saturating_sub(1)], &self.places[after]);
        let share = if after == 0 { 0.0 } else { ((time - a.time) / (b.time - a.time)).clamp(0.0, 1.0) };
        (a, b, share)
    }

    /// Craft and Sun at a time [s].
    pub(crate) fn at(&self, time: f64) -> Course {
        let (a, b, share) = self.around(time);
        let plane = |place: &PlacementSample| place.velocity.map(|velocity| place.position.cross(velocity));
        let between = a.position.cross(b.position);
        let momentum = match (plane(a), plane(b)) {
            (Some(a), Some(b)) => a.lerp(b, share),
            (one, other) => one.or(other).unwrap_or(between),
        };
        let rate = if b.time > a.time {
            a.position.angle_between(b.position) / (b.time - a.time)
        } else {
            plane(a).map_or(0.0, |momentum| momentum.length() / a.position.length_squared())
        };
        Course { position: arc(a.position, b.position, share), sun: a.sun.lerp(b.sun, share), momentum, rate }
    }

    /// Rotation of body vectors into the inertial frame at a time [s].
    pub(crate) fn inertial_from_body(&self, time: f64) -> DQuat {
        let (a, b, share) = self.around(time);
        a.inertial_from_body.normalize().slerp(b.inertial_from_body.normalize(), share)
    }
}

/// A point on the arc from one position to another, whose distance from the centre changes evenly.
fn arc(from: DVec3, to: DVec3, share: f64) -> DVec3 {
    let angle = from.angle_between(to);
    let normal = from.cross(to).try_normalize();
    let length = from.length() + share * (to.length() - from.length());
    match normal {
        Some(normal) => DQuat::from_axis_angle(normal, share * angle) * from.normalize() * length,
        None => from.lerp(to, share),
    }
}

fn check(place: &PlacementSample, planet_radius: f64) -> Result<(), PlaceError> {
    let unusable = |what| Err(PlaceError::Unusable { what });
    SceneTime::new(place.time)?;
    for (what, vector) in [("the position of the craft", place.position), ("the position of the Sun", place.sun)] {
        if !vector.is_finite() || vector == DVec3::ZERO {
            return unusable(what);
        }
    }
    if place.velocity.is_some_and(|velocity| !velocity.is_finite()) {
        return unusable("the velocity of the craft");
    }
    let speed = place.velocity.unwrap_or(DVec3::ZERO);
    let sizes = [
        ("the distance of the craft", place.position, FARTHEST, "m"),
        ("the distance of the Sun", place.sun, FARTHEST, "m"),
        ("the speed of the craft", speed, FASTEST, "m/s"),
    ];
    // The largest component, because the square of a length may be beyond all numbers.
    let size = |vector: DVec3| vector.abs().max_element();
    if let Some((what, vector, most, unit)) = sizes.into_iter().find(|(_, vector, most, _)| size(*vector) > *most) {
        return Err(PlaceError::Huge { what, size: size(vector), most, unit });
    }
    for (whom, distance) in [("the craft", (place.sun - place.position).length()), ("the planet", place.sun.length())] {
        if distance <= SUN_RADIUS {
            return Err(PlaceError::InSun { whom, distance: distance / 1e3 });
        }
    }
    let attitude = place.inertial_from_body;
    if !(attitude.is_finite() && attitude.length() > 0.0) {
        return unusable("the attitude of the craft");
    }
    let length = attitude.length();
    if (length - 1.0).abs() > QUATERNION_TOLERANCE {
        return Err(PlaceError::Length { length });
    }
    let distance = place.position.length();
    if distance <= planet_radius {
        let (distance, radius) = (distance / 1e3, planet_radius / 1e3);
        return Err(PlaceError::Underground { time: place.time, distance, radius });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
