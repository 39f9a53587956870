//! Places of a craft that something outside gives, one after the other: its position, the Sun's and its attitude at increasing times.

use glam::{DQuat, DVec3};

use super::orbit_point::OrbitPoint;
use super::state::SLACK;

/// Where a craft and the Sun are at a time. All vectors are in one inertial frame, from the planet's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Time since the start [s].
    pub time: f64,
    /// The craft [m].
    pub position: DVec3,
    /// Its velocity [m/s]. Without one, the orbit frame has the plane of two neighbouring positions.
    pub velocity: Option<DVec3>,
    /// The Sun [m].
    pub sun: DVec3,
    /// Rotates body vectors into the inertial frame.
    pub inertial_from_body: DQuat,
}

/// Why a place is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlaceError {
    /// A value that is not finite, or a vector without a direction.
    #[error("{what} must be finite and not zero")]
    Unusable {
        /// Name of the value.
        what: &'static str,
    },
    /// A place that does not come after the one before.
    #[error("a place at {time} s must come after the one at {last} s")]
    Order {
        /// Its time [s].
        time: f64,
        /// Time of the last place [s].
        last: f64,
    },
    /// A position inside the planet.
    #[error("at {time} s the craft is {distance:.0} km from the centre of a planet of {radius:.0} km")]
    Underground {
        /// Its time [s].
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
    places: Vec<Place>,
}

impl Placements {
    /// The first place of a craft round a planet of a radius [m].
    ///
    /// # Errors
    /// An unusable value.
    pub fn new(first: Place, planet_radius: f64) -> Result<Self, PlaceError> {
        check(&first, planet_radius)?;
        Ok(Self { places: vec![first] })
    }

    /// The places with another one at the end, without those that are over at the time `now` [s].
    ///
    /// # Errors
    /// An unusable value, or a time that is not later than the last one.
    pub fn and(&self, next: Place, now: f64, planet_radius: f64) -> Result<Self, PlaceError> {
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

    /// The last place.
    pub fn last(&self) -> &Place {
        &self.places[self.places.len() - 1]
    }

    /// Times of the places [s].
    pub fn times(&self) -> impl Iterator<Item = f64> {
        self.places.iter().map(|place| place.time)
    }

    /// Checks that places cover an interval [s].
    ///
    /// # Errors
    /// The first time that is not covered.
    pub fn check(&self, from: f64, to: f64) -> Result<(), PlaceError> {
        let (first, last) = (self.places[0].time, self.last().time);
        let uncovered = |time| Err(PlaceError::Uncovered { time, from: first, to: last });
        if from < first - SLACK {
            return uncovered(from);
        }
        if to > last + SLACK { uncovered(to) } else { Ok(()) }
    }

    /// The places before and after a time [s], and the share of the way between them.
    fn around(&self, time: f64) -> (&Place, &Place, f64) {
        let most = self.places.len() - 1;
        let after = self.places.partition_point(|place| place.time <= time).clamp(1.min(most), most);
        let (a, b) = (&self.places[after.saturating_sub(1)], &self.places[after]);
        let share = if after == 0 { 0.0 } else { ((time - a.time) / (b.time - a.time)).clamp(0.0, 1.0) };
        (a, b, share)
    }

    /// Craft and Sun at a time [s].
    pub fn point(&self, time: f64) -> OrbitPoint {
        let (a, b, share) = self.around(time);
        let plane = |place: &Place| place.velocity.map(|velocity| place.position.cross(velocity));
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
        OrbitPoint::new(time, arc(a.position, b.position, share), a.sun.lerp(b.sun, share), momentum, rate)
    }

    /// Rotation of body vectors into the inertial frame at a time [s].
    pub fn inertial_from_body(&self, time: f64) -> DQuat {
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

fn check(place: &Place, planet_radius: f64) -> Result<(), PlaceError> {
    let vectors = [
        ("the position of the craft", place.position),
        ("the position of the Sun", place.sun),
        ("the direction to the Sun", place.sun - place.position),
    ];
    let unusable = |what| Err(PlaceError::Unusable { what });
    if !place.time.is_finite() {
        return unusable("the time of a place");
    }
    if let Some((what, _)) = vectors.iter().find(|(_, vector)| vector.try_normalize().is_none()) {
        return unusable(what);
    }
    if place.velocity.is_some_and(|velocity| !velocity.is_finite()) {
        return unusable("the velocity of the craft");
    }
    let attitude = place.inertial_from_body;
    if !(attitude.is_finite() && attitude.length() > 0.0) {
        return unusable("the attitude of the craft");
    }
    let distance = place.position.length();
    if distance <= planet_radius {
        let (distance, radius) = (distance / 1e3, planet_radius / 1e3);
        return Err(PlaceError::Underground { time: place.time, distance, radius });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::environment::{CircularOrbit, Orbit};

    const RADIUS: f64 = 6.371e6;

    fn circular() -> Orbit {
        Orbit::Circular(CircularOrbit { altitude: 408e3, period: 5560.0, beta: 0.4, phase: 0.2 })
    }

    fn place(time: f64) -> Place {
        let point = circular().point(time, RADIUS).expect("a circular orbit covers all times");
        let inertial_from_body = DQuat::from_rotation_z(1e-3 * time);
        Place { time, position: point.position, velocity: None, sun: point.sun, inertial_from_body }
    }

    /// Places a minute apart.
    fn places() -> Placements {
        let first = Placements::new(place(0.0), RADIUS).expect("a place");
        (1..10).fold(first, |all, minute| all.and(place(60.0 * f64::from(minute)), 0.0, RADIUS).expect("a place"))
    }

    #[test]
    fn places_on_a_circle_give_the_circle() {
        let given = Orbit::Given(Arc::new(places()));
        for time in [0.0, 17.0, 60.0, 299.9, 540.0] {
            let [found, expected] = [&given, &circular()].map(|orbit| orbit.point(time, RADIUS).expect("covered"));
            assert!(found.position.distance(expected.position) < 1e-6, "{time}");
            let frames = (found.inertial_from_orbit - expected.inertial_from_orbit).to_cols_array();
            assert!(frames.iter().all(|value| value.abs() < 1e-9), "{time}");
            assert!((found.rate / expected.rate - 1.0).abs() < 1e-9);
            // The Sun of a circular orbit is seen from the planet's centre.
            assert!(found.sun_direction.distance(expected.sun_direction) < 1e-4);
            let chord = place(0.0).position.lerp(place(60.0).position, 0.5);
            assert!(time != 17.0 || chord.distance(found.position) > 1e3);
        }
        let turned = places().inertial_from_body(90.0);
        assert!(turned.angle_between(DQuat::from_rotation_z(0.09)) < 1e-7);
    }

    #[test]
    fn after_the_last_place_nothing_moves() {
        let places = places();
        assert_eq!(places.point(540.0).position, places.point(1e4).position);
        assert!(places.check(0.0, 540.0).is_ok());
        let late = places.check(0.0, 541.0).unwrap_err().to_string();
        assert_eq!(late, "the craft has places from 0 to 540 s, and one at 541 s is needed");
        let lone = Placements::new(place(3.0), RADIUS).expect("a place");
        assert_eq!(lone.point(2.0).position, lone.point(9.0).position);
    }

    #[test]
    fn places_that_are_over_are_dropped() {
        let many = (10..1000).fold(places(), |all, minute| {
            all.and(place(60.0 * f64::from(minute)), 60.0 * f64::from(minute - 1), RADIUS).expect("a place")
        });
        assert!(many.places.len() <= 4, "{}", many.places.len());
    }

    #[test]
    fn a_place_that_can_not_be_is_refused() {
        let refused = |place: Place| places().and(place, 0.0, RADIUS).unwrap_err().to_string();
        assert!(refused(place(540.0)).contains("must come after the one at 540 s"));
        assert!(refused(Place { position: DVec3::X * 6e6, ..place(600.0) }).contains("6000 km from the centre"));
        assert!(refused(Place { sun: DVec3::NAN, ..place(600.0) }).contains("the position of the Sun"));
        assert!(refused(Place { sun: place(600.0).position, ..place(600.0) }).contains("the direction to the Sun"));
        let zero = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        assert!(refused(Place { inertial_from_body: zero, ..place(600.0) }).contains("the attitude"));
        assert!(refused(Place { time: f64::NAN, ..place(600.0) }).contains("the time"));
    }
}
