//! Places along a known orbit, and places that can not be.

use std::sync::Arc;

use super::*;
use crate::environment::{CircularOrbit, Orbit};

const RADIUS: f64 = 6.371e6;

fn circular() -> Orbit {
    Orbit::Circular(CircularOrbit { altitude: 408e3, period: 5560.0, beta: 0.4, phase: 0.2 })
}

fn place(time: f64) -> PlacementSample {
    let point = circular().point(time, RADIUS).expect("a circular orbit covers all times");
    let inertial_from_body = DQuat::from_rotation_z(1e-3 * time);
    PlacementSample { time, position: point.position, velocity: None, sun: point.sun, inertial_from_body }
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
        let [computed, expected] = [&given, &circular()].map(|orbit| orbit.point(time, RADIUS).expect("covered"));
        assert!(computed.position.distance(expected.position) < 1e-6, "{time}");
        let frames = (computed.inertial_from_orbit - expected.inertial_from_orbit).to_cols_array();
        assert!(frames.iter().all(|value| value.abs() < 1e-9), "{time}");
        assert!((computed.rate / expected.rate - 1.0).abs() < 1e-9);
        // The Sun of a circular orbit is seen from the planet's centre.
        assert!(computed.sun_direction.distance(expected.sun_direction) < 1e-4);
        let chord = place(0.0).position.lerp(place(60.0).position, 0.5);
        assert!(time != 17.0 || chord.distance(computed.position) > 1e3);
    }
    let turned = places().inertial_from_body(90.0);
    assert!(turned.angle_between(DQuat::from_rotation_z(0.09)) < 1e-7);
}

#[test]
fn after_the_last_place_nothing_moves() {
    let places = places();
    assert_eq!(places.at(540.0).position, places.at(1e4).position);
    assert!(places.check(0.0, 540.0).is_ok());
    let late = places.check(0.0, 541.0).unwrap_err().to_string();
    assert_eq!(late, "the craft has places from 0 to 540 s, and one at 541 s is needed");
    let lone = Placements::new(place(3.0), RADIUS).expect("a place");
    assert_eq!(lone.at(2.0).position, lone.at(9.0).position);
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
    let refused = |place: PlacementSample| places().and(place, 0.0, RADIUS).unwrap_err().to_string();
    assert!(refused(place(540.0)).contains("must come after the one at 540 s"));
    assert!(refused(PlacementSample { position: DVec3::X * 6e6, ..place(600.0) }).contains("6000 km from the centre"));
    assert!(refused(PlacementSample { sun: DVec3::NAN, ..place(600.0) }).contains("the position of the Sun"));
    // A Sun in kilometres.
    let near = refused(PlacementSample { sun: DVec3::Z * 1.496e8, ..place(600.0) });
    assert!(near.contains("its radius is 695700 km"), "{near}");
    let far = refused(PlacementSample { position: DVec3::X * 1e200, ..place(600.0) });
    assert!(far.contains("the distance of the craft is 1e200 m or more, and at most 1e13 m are taken"), "{far}");
    let fast = refused(PlacementSample { velocity: Some(DVec3::X * 1e12), ..place(600.0) });
    assert!(fast.contains("the speed of the craft is 1e12 m/s"), "{fast}");
    let zero = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    assert!(refused(PlacementSample { inertial_from_body: zero, ..place(600.0) }).contains("the attitude"));
    let long = DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0);
    assert!(
        refused(PlacementSample { inertial_from_body: long, ..place(600.0) }).contains("must have length 1, not 2")
    );
    assert!(refused(PlacementSample { time: f64::NAN, ..place(600.0) }).contains("is no time"));
}
