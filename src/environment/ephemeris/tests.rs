//! Ephemerides made from known motions: exact epochs, orders, gaps, steps and manoeuvres.

use std::f64::consts::TAU;

use super::*;
use crate::environment::orbit::EARTH_GRAVITATIONAL_PARAMETER;

const RADIUS: f64 = 6.8e6;

fn rate() -> f64 {
    (EARTH_GRAVITATIONAL_PARAMETER / RADIUS.powi(3)).sqrt()
}

fn circle(time: f64) -> StateVector {
    let (sin, cos) = (rate() * time).sin_cos();
    let position = DVec3::new(cos, 0.0, sin) * RADIUS;
    StateVector { position, velocity: DVec3::new(-sin, 0.0, cos) * (RADIUS * rate()) }
}

fn sample(time: f64) -> EphemerisSample {
    let StateVector { position, velocity } = circle(time);
    EphemerisSample { time, position, velocity: Some(velocity) }
}

fn whole(samples: Vec<EphemerisSample>, interpolation: Interpolation) -> (Ephemeris, Findings) {
    Ephemeris::new(vec![EphemerisSegment { samples, interpolation, usable: (f64::NEG_INFINITY, f64::INFINITY) }])
}

fn regular(count: u32, step: f64) -> Vec<EphemerisSample> {
    (0..count).map(|index| sample(f64::from(index) * step)).collect()
}

fn error(ephemeris: &Ephemeris, time: f64) -> f64 {
    ephemeris.state(time).expect("covered").position.distance(circle(time).position)
}

#[test]
fn epochs_are_exact_and_the_order_is_that_of_the_degree() {
    for (interpolation, order) in [
        (Interpolation::Lagrange(1), 2.0),
        (Interpolation::Lagrange(4), 5.0),
        (Interpolation::Lagrange(7), 8.0),
        (Interpolation::Hermite(3), 4.0),
        (Interpolation::Hermite(7), 8.0),
    ] {
        let worst = |step: f64| {
            let (ephemeris, findings) = whole(regular((6000.0 / step) as u32 + 1, step), interpolation);
            assert_eq!(findings, Findings::default());
            for index in 0..10 {
                let time = f64::from(index) * step;
                assert_eq!(ephemeris.state(time).unwrap().position, circle(time).position);
            }
            (0..100).map(|look| error(&ephemeris, 1500.0 + f64::from(look) * 7.1)).fold(0.0, f64::max)
        };
        let observed = (worst(400.0) / worst(200.0)).log2();
        assert!((observed - order).abs() < 0.5, "{interpolation:?}: order {observed}, errors {}", worst(200.0));
    }
}

#[test]
fn velocities_are_the_slopes_of_positions() {
    for interpolation in [Interpolation::Hermite(7), Interpolation::Lagrange(7)] {
        let (ephemeris, _) = whole(regular(30, 120.0), interpolation);
        for time in [10.0, 1234.5, 3400.0] {
            let velocity = ephemeris.state(time).unwrap().velocity;
            assert!(velocity.distance(circle(time).velocity) < 0.05, "{time}: {velocity}");
        }
    }
}

#[test]
fn a_gap_is_not_bridged_and_one_missing_epoch_is() {
    let mut samples = regular(60, 60.0);
    samples.remove(40);
    samples.drain(20..25);
    let (ephemeris, findings) = whole(samples, Interpolation::Hermite(7));
    assert_eq!(findings.gaps, 1);
    assert_eq!(ephemeris.coverage(), [(0.0, 1140.0), (1500.0, 3540.0)]);
    assert!(ephemeris.state(1141.0).is_none() && ephemeris.state(1499.0).is_none());
    assert!(ephemeris.state(-0.1).is_none() && ephemeris.state(3540.1).is_none());
    assert!(error(&ephemeris, 2400.0) < 1.0 && error(&ephemeris, 1139.0) < 1e-3);
}

#[test]
fn a_step_at_a_repeated_epoch_is_taken_there_and_nowhere_else() {
    let shift = DVec3::new(0.0, 5000.0, 0.0);
    let mut samples = regular(60, 60.0);
    let moved = |sample: &EphemerisSample| EphemerisSample { position: sample.position + shift, ..*sample };
    let after: Vec<EphemerisSample> = samples[30..].iter().map(moved).collect();
    samples.truncate(31);
    samples.extend(after);
    let (ephemeris, findings) = whole(samples, Interpolation::Lagrange(9));
    assert_eq!((findings.steps, findings.repeated, findings.gaps), (1, 0, 0));
    assert_eq!(ephemeris.coverage(), [(0.0, 3540.0)]);
    assert!(error(&ephemeris, 1799.0) < 1.0);
    for time in [1800.0, 1801.0] {
        let state = ephemeris.state(time).unwrap();
        assert!(state.position.distance(circle(time).position + shift) < 1.0, "{time}");
    }
}

#[test]
fn lines_that_repeat_are_dropped() {
    let mut samples = regular(40, 60.0);
    samples.insert(10, samples[10]);
    samples.insert(10, samples[10]);
    let (ephemeris, findings) = whole(samples, Interpolation::Hermite(7));
    assert_eq!((findings.repeated, findings.steps), (2, 0));
    assert!((0..200).all(|look| error(&ephemeris, f64::from(look) * 11.0) < 1e-3));
}

/// An impulse between two epochs that no sample states. Both orbits are right up to their own last sample.
#[test]
fn a_manoeuvre_between_epochs_disturbs_nothing_but_its_own_interval() {
    let burn = 1830.0;
    let speed = 20.0;
    let coast = |time: f64| {
        // The velocity gains a component along Y, which tilts the plane of the circle.
        let StateVector { position, velocity } = circle(time);
        let swing = if time < burn { DVec3::ZERO } else { DVec3::Y };
        let (sin, cos) = (rate() * (time - burn)).sin_cos();
        StateVector { position: position + swing * (speed / rate() * sin), velocity: velocity + swing * (speed * cos) }
    };
    let samples = (0..60).map(|index| {
        let time = f64::from(index) * 60.0;
        let StateVector { position, velocity } = coast(time);
        EphemerisSample { time, position, velocity: Some(velocity) }
    });
    let (ephemeris, findings) = whole(samples.collect(), Interpolation::Hermite(7));
    assert_eq!(findings.manoeuvres, 1);
    let error = |time: f64| ephemeris.state(time).unwrap().position.distance(coast(time).position);
    for time in [1700.0, 1799.0, 1861.0, 1950.0] {
        assert!(error(time) < 2.0, "{time}: {}", error(time));
    }
    for time in [1810.0, 1830.0, 1850.0] {
        assert!(error(time) < 200.0, "{time}: {}", error(time));
    }
    // Without velocities the manoeuvre can not be detected, and a polynomial across it oscillates.
    assert!(residual(&sample(0.0), &sample(60.0)).unwrap().unexplained < 2.0);
}

#[test]
fn usable_times_bound_a_segment_but_its_samples_still_count() {
    let segment =
        |usable| EphemerisSegment { samples: regular(20, 60.0), interpolation: Interpolation::Hermite(7), usable };
    let (ephemeris, _) = Ephemeris::new(vec![segment((90.0, 500.0)), segment((500.0, 1000.0))]);
    assert_eq!(ephemeris.coverage(), [(90.0, 1000.0)]);
    assert!(ephemeris.state(89.0).is_none());
    assert!(error(&ephemeris, 95.0) < 1e-3);
    let (apart, _) = Ephemeris::new(vec![segment((90.0, 500.0)), segment((501.0, 1000.0))]);
    assert!(apart.state(500.5).is_none());
}

#[test]
fn few_samples_and_high_degrees_are_served() {
    let (one, _) = whole(regular(1, 60.0), Interpolation::Hermite(7));
    assert_eq!(one.state(0.0).unwrap(), circle(0.0));
    assert_eq!(one.coverage(), [(0.0, 0.0)]);
    let (two, _) = whole(regular(2, 60.0), Interpolation::Lagrange(31));
    assert!(error(&two, 30.0) < 4000.0);
    let (many, _) = whole(regular(90, 60.0), Interpolation::Lagrange(31));
    assert!((0..500).all(|look| error(&many, 1500.0 + f64::from(look) * 3.3) < 1e-2));
    let (dense, _) = whole(regular(90, TAU), Interpolation::Hermite(31));
    assert!((0..500).all(|look| error(&dense, f64::from(look)) < 1.0));
    let (none, _) = Ephemeris::new(Vec::new());
    assert!(none.state(0.0).is_none() && none.coverage().is_empty());
}

/// 5418 steps of 0.1 s end at 541.8000000000001 s.
#[test]
fn rounding_of_a_time_does_not_leave_the_ephemeris() {
    let mut samples = regular(10, 60.0);
    samples.push(sample(541.8));
    let (ephemeris, _) = whole(samples, Interpolation::Hermite(7));
    let time = 5418.0 * 0.1;
    assert!(time > 541.8);
    assert_eq!(ephemeris.state(time), ephemeris.state(541.8));
    assert!(
        ephemeris.state(-1e-9).is_some() && ephemeris.state(-1e-5).is_none() && ephemeris.state(541.80001).is_none()
    );
    // A gap of a microsecond between segments, which their coverage joins.
    let segment = |from: f64| {
        let samples = (0..10).map(|index| sample(from + f64::from(index) * 60.0)).collect();
        EphemerisSegment {
            samples,
            interpolation: Interpolation::Hermite(7),
            usable: (f64::NEG_INFINITY, f64::INFINITY),
        }
    };
    let (touching, _) = Ephemeris::new(vec![segment(0.0), segment(540.0 + 0.9e-6)]);
    assert_eq!(touching.coverage().len(), 1);
    assert!(error(&touching, 540.0 + 0.5e-6) < 0.01);
}

#[test]
fn a_lone_sample_between_two_gaps_hides_neither() {
    let times = (0..=100).map(|i| i * 60).chain([9000]).chain((200..=300).map(|i| i * 60));
    let (ephemeris, findings) = whole(times.map(|time| sample(f64::from(time))).collect(), Interpolation::Hermite(7));
    assert_eq!(findings.gaps, 2);
    assert_eq!(ephemeris.coverage(), [(0.0, 6000.0), (9000.0, 9000.0), (12_000.0, 18_000.0)]);
    assert!(ephemeris.state(10_175.0).is_none());
}

#[test]
fn the_least_hermite_is_continuous_and_even_degrees_rise() {
    let (ephemeris, _) = whole(regular(40, 60.0), Interpolation::Hermite(1));
    for time in [600.0_f64, 630.0, 660.0] {
        let [before, after] = [-1e-6, 1e-6].map(|shift| ephemeris.state(time + shift).unwrap().position);
        assert!(before.distance(after) < 0.05, "{time}: {}", before.distance(after));
        assert!(error(&ephemeris, time) < 1.0);
    }
    assert_eq!([1, 2, 3, 7, 8, 31].map(hermite_degree), [3, 3, 3, 7, 9, 31]);
}

/// A coast with drag that falls with height, in steps of one second.
fn falling(mut state: StateVector, seconds: u32, drag: f64) -> Vec<StateVector> {
    let acceleration = |state: &StateVector| {
        let height = state.position.length() - 6.378e6;
        gravity(state.position) - state.velocity * (state.velocity.length() * drag * (-(height - 200e3) / 40e3).exp())
    };
    let mut states = vec![state];
    for _ in 0..seconds {
        let moved = |slope: &StateVector, h: f64| StateVector {
            position: state.position + slope.position * h,
            velocity: state.velocity + slope.velocity * h,
        };
        let slope = |state: StateVector| StateVector { position: state.velocity, velocity: acceleration(&state) };
        let k1 = slope(state);
        let k2 = slope(moved(&k1, 0.5));
        let k3 = slope(moved(&k2, 0.5));
        let k4 = slope(moved(&k3, 1.0));
        let sum = |part: fn(&StateVector) -> DVec3| (part(&k1) + 2.0 * part(&k2) + 2.0 * part(&k3) + part(&k4)) / 6.0;
        let (position, velocity) = (sum(|state| state.position), sum(|state| state.velocity));
        state = StateVector { position: state.position + position, velocity: state.velocity + velocity };
        states.push(state);
    }
    states
}

fn every(states: &[StateVector], step: usize) -> Vec<EphemerisSample> {
    let line = |(time, state): (usize, &StateVector)| EphemerisSample {
        time: time as f64,
        position: state.position,
        velocity: Some(state.velocity),
    };
    states.iter().enumerate().step_by(step).map(line).collect()
}

fn worst(ephemeris: &Ephemeris, states: &[StateVector], within: std::ops::Range<usize>) -> f64 {
    let error = |time: usize| ephemeris.state(time as f64).unwrap().position.distance(states[time].position);
    within.map(error).fold(0.0, f64::max)
}

/// GTO of 180 km x 35786 km. The drag at its perigee is 3e-4 m/s2, then twenty times as much.
#[test]
fn drag_at_a_low_perigee_is_no_manoeuvre_and_taken_for_one_costs_little() {
    let (perigee, apogee) = (6.378e6 + 180e3, 6.378e6 + 35_786e3);
    let speed = (EARTH_GRAVITATIONAL_PARAMETER * (2.0 / apogee - 2.0 / (apogee + perigee))).sqrt();
    let state = StateVector { position: DVec3::X * apogee, velocity: DVec3::new(0.0, 0.99, 0.12).normalize() * speed };
    for (drag, manoeuvres, tolerance) in [(1.8e-12, 0..1, 150.0), (3.6e-11, 0..5, 250.0)] {
        let states = falling(state, 86_400, drag);
        let at_perigee = states.iter().map(|state| state.position.length()).fold(f64::MAX, f64::min);
        assert!((at_perigee - perigee).abs() < 30e3, "{at_perigee}");
        let (ephemeris, findings) = whole(every(&states, 300), Interpolation::Hermite(7));
        assert!(manoeuvres.contains(&findings.manoeuvres), "{drag}: {findings:?}");
        let worst = worst(&ephemeris, &states, 0..86_400);
        assert!(worst < tolerance, "{drag}: {worst} m, {findings:?}");
    }
}

#[test]
fn a_manoeuvre_in_a_short_segment_is_found() {
    let StateVector { position, velocity } = circle(0.0);
    let mut states = falling(StateVector { position, velocity }, 150, 0.0);
    let burnt = StateVector { velocity: states[150].velocity + DVec3::Y * 3.0, ..states[150] };
    states.extend(falling(burnt, 50, 0.0).into_iter().skip(1));
    let (ephemeris, findings) = whole(every(&states, 100), Interpolation::Hermite(7));
    assert_eq!(findings.manoeuvres, 1);
    assert!(worst(&ephemeris, &states, 0..100) < 0.1, "{}", worst(&ephemeris, &states, 0..100));
    let coasting = falling(StateVector { position, velocity }, 200, 0.0);
    assert_eq!(whole(every(&coasting, 100), Interpolation::Hermite(7)).1.manoeuvres, 0);
}

#[test]
fn states_that_differ_by_rounding_are_no_step_and_steps_in_a_row_keep_the_orbit() {
    let StateVector { position, velocity } = circle(0.0);
    let states = falling(StateVector { position, velocity }, 2400, 0.0);
    let twice = |shift: DVec3, by_velocity: DVec3| {
        let mut samples = every(&states, 120);
        for index in (5..10).rev() {
            let moved = EphemerisSample {
                position: samples[index].position + shift,
                velocity: samples[index].velocity.map(|velocity| velocity + by_velocity),
                ..samples[index]
            };
            samples.insert(index + 1, moved);
        }
        whole(samples, Interpolation::Hermite(7))
    };
    let (ephemeris, findings) = twice(DVec3::splat(0.02), DVec3::splat(1e-5));
    assert_eq!((findings.repeated, findings.steps), (5, 0));
    assert!(worst(&ephemeris, &states, 0..2400) < 0.1, "{}", worst(&ephemeris, &states, 0..2400));
    let (ephemeris, findings) = twice(DVec3::Y * 2.0, DVec3::ZERO);
    assert_eq!((findings.repeated, findings.steps), (0, 5));
    assert!(worst(&ephemeris, &states, 0..2400) < 2.5, "{}", worst(&ephemeris, &states, 0..2400));
    // A burn of 5 cm/s at a repeated epoch.
    assert_eq!(twice(DVec3::ZERO, DVec3::Y * 0.05).1.steps, 5);
}
