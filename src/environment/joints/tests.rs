//! Joints against closed forms.

use std::f64::consts::FRAC_PI_2;

use super::keys::KeyInterpolation;
use super::*;
use crate::environment::sky::SkyModel;
use crate::environment::{Attitude, CircularOrbit, Environment};

fn guided(kind: JointKind, axis: DVec3, drive: Drive) -> Guided {
    Guided { kind, axis, origin: DVec3::ZERO, drive, limits: None, rate: None }
}

fn joint(parent: Option<usize>, guided: Guided) -> Joint {
    Joint { name: "joint".to_owned(), parent, motion: JointDrive::Guided(guided) }
}

fn facing(axis: DVec3) -> Guided {
    guided(JointKind::Rotation, axis, Drive::Sun { facing: -DVec3::Z, offset: 0.0 })
}

const PERIOD: f64 = 5554.0;

/// The Sun as a nadir-pointing craft sees it at a beta angle of 0.5 rad.
fn sun_of_orbit() -> impl Fn(f64) -> DVec3 {
    let orbit = CircularOrbit { altitude: 408e3, period: PERIOD, beta: 0.5, phase: 0.3 };
    let environment = Environment {
        solar_constant: Some(1361.0),
        albedo: None,
        planet_ir: None,
        planet_radius: 6.371e6,
        eclipse: true,
        background_temperature: None,
    };
    let attitude = Attitude::Nadir { nadir_axis: DVec3::Z, forward_axis: DVec3::X };
    let sky = SkyModel::new(&orbit, &attitude, &environment).unwrap();
    move |time| sky.sun_direction(time)
}

fn times() -> impl Iterator<Item = f64> {
    (0..400).map(|i| 17.3 * f64::from(i))
}

#[test]
fn two_axes_hold_a_panel_to_the_sun() {
    let sun = sun_of_orbit();
    let joints = Joints::new(vec![joint(None, facing(DVec3::Y)), joint(Some(0), facing(DVec3::X))], 0.0, 1.0, &sun);
    for time in times() {
        let (_, poses) = joints.at(time, &sun);
        let cosine = (poses[2].matrix3 * -DVec3::Z).dot(sun(time));
        assert!((cosine - 1.0).abs() < 1e-12, "{time} s: {cosine}");
        let outer = (poses[1].matrix3 * -DVec3::Z).dot(sun(time));
        assert!((outer - 1.0).abs() > 0.1, "one axis alone leaves beta");
    }
}

/// A panel that turns about an axis in its plane gets all sunlight but the component along that axis.
#[test]
fn one_axis_leaves_the_cosine_of_the_suns_elevation() {
    let sun = sun_of_orbit();
    let joints = Joints::new(vec![joint(None, facing(DVec3::Y))], 0.0, 1.0, &sun);
    for time in times() {
        let normal = joints.at(time, &sun).1[1].matrix3 * -DVec3::Z;
        let expected = (1.0 - sun(time).y.powi(2)).sqrt();
        assert!((normal.dot(sun(time)) - expected).abs() < 1e-12);
        assert!((expected - 0.5f64.cos()).abs() < 1e-12, "which here is the cosine of beta");
    }
}

#[test]
fn a_rate_makes_a_joint_lag_and_never_jump() {
    // The Sun is at -Z and from 100 s on at X. The joint must turn by a right angle about Y at 0.01 rad/s.
    let sun = |time: f64| if time < 100.0 { -DVec3::Z } else { DVec3::X };
    let slow = Guided { rate: Some(0.01), ..facing(DVec3::Y) };
    let joints = Joints::new(vec![joint(None, slow.clone())], -50.0, 2.0, sun);
    let angle = |time: f64| joints.at(time, &sun).0[0];
    assert_eq!(angle(-60.0), 0.0);
    assert_eq!(angle(50.0), 0.0, "it starts where it is asked to be");
    let signed = joints.at(1000.0, &sun).0[0];
    assert!((signed.abs() - FRAC_PI_2).abs() < 1e-12, "beyond the walk it goes on: {signed}");
    assert!((joints.at(1000.0, &sun).1[1].matrix3 * -DVec3::Z).distance(DVec3::X) < 1e-12);
    let mut last = angle(90.0);
    for i in 1..1000 {
        let now = angle(90.0 + 0.2 * f64::from(i));
        assert!((now - last).abs() <= 0.01 * 0.2 + 1e-12);
        last = now;
    }
    // It begins to turn in the step of the walk that ends at 100 s.
    assert!((angle(150.0).abs() - 0.52).abs() < 1e-9, "{}", angle(150.0));
    let fast = Joints::new(vec![joint(None, Guided { rate: None, ..slow })], 0.0, 1.0, sun);
    assert!((fast.at(100.0, &sun).0[0].abs() - FRAC_PI_2).abs() < 1e-12);
}

#[test]
fn without_limits_a_joint_goes_round_and_with_them_it_goes_back() {
    // The Sun goes round Y once in 100 s, starting at -Z.
    let turn = |time: f64| TAU * time / 100.0;
    let sun = move |time: f64| DMat3::from_rotation_y(turn(time)) * -DVec3::Z;
    let free = Guided { rate: Some(0.1), ..facing(DVec3::Y) };
    let joints = Joints::new(vec![joint(None, free.clone())], 0.0, 0.5, sun);
    for time in [10.0, 60.0, 120.0, 290.0] {
        assert!((joints.at(time, &sun).0[0] - turn(time)).abs() < 1e-9, "{time} s");
    }
    let limited = Guided { limits: Some([-2.0, 2.0]), rate: None, ..free };
    let joints = Joints::new(vec![joint(None, limited)], 0.0, 0.5, sun);
    for time in times() {
        let angle = joints.at(time, &sun).0[0];
        let wanted = (turn(time) + PI).rem_euclid(TAU) - PI;
        assert!((angle - wanted.clamp(-2.0, 2.0)).abs() < 1e-9, "{time} s: {angle}, {wanted}");
    }
}

#[test]
fn a_schedule_goes_straight_and_a_slide_shifts() {
    let drive = Drive::Schedule { times: vec![0.0, 10.0, 10.0, 20.0], positions: vec![1.0, 3.0, 5.0, 5.0] };
    let slide = guided(JointKind::Translation, DVec3::Y, drive);
    let turn = guided(JointKind::Rotation, DVec3::Z, Drive::Fixed(FRAC_PI_2));
    let turn = Guided { origin: DVec3::new(1.0, 0.0, 0.0), ..turn };
    let sun = |_: f64| DVec3::X;
    let joints = Joints::new(vec![joint(None, turn), joint(Some(0), slide)], 0.0, 1.0, sun);
    for (time, position) in [(-5.0, 1.0), (0.0, 1.0), (5.0, 2.0), (10.0, 5.0), (100.0, 5.0)] {
        let (positions, poses) = joints.at(time, &sun);
        assert!((positions[1] - position).abs() < 1e-12, "{time} s");
        // A quarter turn about z through (1, 0, 0) takes the origin to (1, -1, 0) and +Y to -X.
        let expected = DVec3::new(1.0 - position, -1.0, 0.0);
        assert!(poses[2].transform_point3(DVec3::ZERO).distance(expected) < 1e-12);
    }
}

/// An animation of 0 to 90 degrees about the node's Y in a turned and scaled parent, against the schedule that says the same.
#[test]
fn an_animation_is_the_schedule_that_says_the_same() {
    let quarter = DQuat::from_rotation_y(FRAC_PI_2);
    let parent = DAffine3::from_scale_rotation_translation(
        DVec3::splat(2.0),
        DQuat::from_rotation_x(0.4),
        DVec3::new(1.0, 2.0, 3.0),
    );
    let rest = (DVec3::new(0.5, 0.0, 0.0), DQuat::from_rotation_z(0.7));
    let keys = |from: DQuat, to: DQuat| {
        Keys::new(vec![0.0, 10.0], vec![from.to_array(), to.to_array()], KeyInterpolation::Linear)
    };
    let played = Played {
        rotation: Some(keys(rest.1, rest.1 * quarter)),
        translation: None,
        duration: 10.0,
        repeats: false,
        rest,
        body_from_parent: parent,
    };
    let own = parent * DAffine3::from_rotation_translation(rest.1, rest.0);
    let drive = Drive::Schedule { times: vec![0.0, 10.0], positions: vec![0.0, FRAC_PI_2] };
    let axis = (own.matrix3 * DVec3::Y).normalize();
    let scheduled = Guided { origin: own.translation, ..guided(JointKind::Rotation, axis, drive) };
    let sun = |_: f64| DVec3::X;
    let of = |motion: JointDrive| {
        let joint = Joint { name: "node".to_owned(), parent: None, motion };
        Joints::new(vec![joint], 0.0, 1.0, sun)
    };
    let again = of(JointDrive::Played(Box::new(Played { repeats: true, ..played.clone() })));
    let (played, scheduled) = (of(JointDrive::Played(Box::new(played))), of(JointDrive::Guided(scheduled)));
    for time in [-1.0, 0.0, 2.5, 7.0, 10.0, 12.5] {
        let (a, b) = (played.at(time, &sun), scheduled.at(time, &sun));
        assert!((a.0[0] - b.0[0]).abs() < 1e-9, "{time} s: {} and {} rad", a.0[0], b.0[0]);
        assert!(a.1[1].abs_diff_eq(b.1[1], 1e-9), "{time} s: {} and {}", a.1[1], b.1[1]);
        let beside = scheduled.at(time + 0.5, &sun).1[1];
        assert_eq!(a.1[1].abs_diff_eq(beside, 1e-9), !(-0.5..10.0).contains(&time), "half a second must show");
    }
    assert!(again.at(12.5, &sun).1[1].abs_diff_eq(played.at(2.5, &sun).1[1], 1e-12));
    assert!(again.at(-7.5, &sun).1[1].abs_diff_eq(played.at(2.5, &sun).1[1], 1e-12));
}

#[test]
fn the_sun_along_the_axis_asks_for_nothing() {
    let sun = |_: f64| DVec3::Y;
    let joints = Joints::new(vec![joint(None, facing(DVec3::Y))], 0.0, 1.0, sun);
    assert_eq!(joints.at(0.0, &sun).0[0], 0.0);
}

/// Joints under the sky of an orbit, from `periods` before time 0. The first is walked with the shortcut for a periodic sky, the second in full.
fn walked_both_ways(joints: &[Joint], periods: f64) -> (Joints, Joints) {
    let from = -periods * PERIOD - 5.0;
    let short = Joints::under_a_sky(joints.to_vec(), from, 15.0, Some(PERIOD), sun_of_orbit());
    let whole = Joints::new(joints.to_vec(), from, short.walks_by(), sun_of_orbit());
    (short, whole)
}

fn largest_difference(short: &Joints, whole: &Joints, periods: f64) -> f64 {
    let sun = sun_of_orbit();
    let span = periods * PERIOD + 5.0 + 3000.0;
    (0..20_000).fold(0.0, |worst, index| {
        let time = 3000.0 - span * f64::from(index) / 20_000.0;
        let (a, b) = (short.at(time, &sun).1, whole.at(time, &sun).1);
        let apart = a.iter().zip(&b).map(|(a, b)| {
            let pairs = a.to_cols_array().into_iter().zip(b.to_cols_array());
            pairs.fold(0.0, |worst: f64, (a, b)| worst.max((a - b).abs()))
        });
        apart.fold(worst, f64::max)
    })
}

const ORBITAL: f64 = TAU / PERIOD;

#[test]
fn what_repeats_is_where_the_whole_walk_has_it() {
    let slow = |share: f64, axis: DVec3| Guided { rate: Some(share * ORBITAL), ..facing(axis) };
    let limited = Guided { limits: Some([-3.0, 3.0]), ..slow(6.0, DVec3::Y) };
    // The walk starts at the target. In later periods the joint is still on its way back at that time.
    let behind = Guided { limits: Some([-2.2, 3.8]), ..slow(1.3, DVec3::Y) };
    let wide = Guided { limits: Some([-5.0, 5.0]), ..slow(4.0, DVec3::Y) };
    let schedule = Drive::Schedule { times: vec![-900.0, 0.0], positions: vec![0.3, 1.0] };
    let scheduled = Guided { rate: Some(1e-3), ..guided(JointKind::Rotation, DVec3::X, schedule) };
    let each = (PERIOD / 15.0).ceil() as usize;
    let periods = 30.0;
    let starts = |joint: Guided| {
        let (_, whole) = walked_both_ways(&[self::joint(None, joint)], periods);
        let at = |period: f64| whole.at((period - periods) * PERIOD - 5.0, &sun_of_orbit()).1[1];
        at(0.0).abs_diff_eq(at(1.0), 1e-3)
    };
    assert!(starts(slow(1.5, DVec3::Y)) && !starts(behind.clone()), "one case must have a lead");
    for (name, joints, most) in [
        ("one axis", vec![joint(None, slow(1.5, DVec3::Y))], 5),
        ("two axes", vec![joint(None, slow(2.0, DVec3::Y)), joint(Some(0), slow(1.1, DVec3::X))], 6),
        ("limits that send it back", vec![joint(None, limited)], 5),
        ("a start that does not come again", vec![joint(None, behind.clone())], 6),
        ("limits beyond a turn", vec![joint(None, wide)], 5),
        ("on a schedule", vec![joint(None, scheduled), joint(Some(0), slow(2.0, DVec3::Y))], 6),
        ("too slow to follow", vec![joint(None, slow(0.4, DVec3::Y))], 0),
    ] {
        let (short, whole) = walked_both_ways(&joints, periods);
        let difference = largest_difference(&short, &whole, periods);
        assert!(difference < 1e-12, "{name}: {difference:e}");
        assert!((most.min(1)..=most * each).contains(&short.kept()), "{name}: {} positions", short.kept());
    }
}

/// The target of a panel moves at the orbit's rate. A panel with r times that rate reaches it after a turn over r - 1.
#[test]
fn a_joint_repeats_a_period_after_it_has_caught_up() {
    for share in [1.2, 2.0, 10.0] {
        let panel = Guided { rate: Some(share * ORBITAL), ..facing(DVec3::Y) };
        let (short, _) = walked_both_ways(&[joint(None, panel)], 40.0);
        let bound = (1.0 / (share - 1.0)).ceil() + 3.0;
        let periods = short.kept() as f64 * short.walks_by() / PERIOD;
        assert!(periods <= bound, "{share}: {periods} periods kept, at most {bound}");
    }
}

/// Twice as many orbits need no more stored positions.
#[test]
fn a_long_warm_up_is_not_walked() {
    let panel = Guided { rate: Some(3.0 * ORBITAL), ..facing(DVec3::Y) };
    let walked = |periods: f64| {
        let from = -periods * PERIOD - 5.0;
        Joints::under_a_sky(vec![joint(None, panel.clone())], from, 15.0, Some(PERIOD), sun_of_orbit())
    };
    let (long, short) = (walked(1e5), walked(100.0));
    assert_eq!(long.kept(), short.kept());
    let sun = sun_of_orbit();
    for time in [-3.3e8, -1e6, -17.0, 0.0, 2900.0] {
        let (_, poses) = long.at(time, &sun);
        let expected = short.at((time % PERIOD) - PERIOD, &sun).1[1];
        // After 1e5 orbits an angle is known to 1e5 times the rounding of 2 pi.
        assert!(time > 0.0 || poses[1].abs_diff_eq(expected, 1e-9), "{time} s");
        let forward = poses[1].matrix3 * -DVec3::Z;
        let best = (1.0 - sun(time).y.powi(2)).sqrt();
        assert!((forward.dot(sun(time)) - best).abs() < 1e-9, "{time} s: it follows");
    }
}

/// A repeating animation has a period of its own. Nothing repeats with the orbit, so everything is walked.
#[test]
fn what_rides_on_an_animation_is_walked_through() {
    let quarter = DQuat::from_rotation_x(FRAC_PI_2).to_array();
    let keys = Keys::new(vec![0.0, 700.0], vec![DQuat::IDENTITY.to_array(), quarter], KeyInterpolation::Linear);
    let played = Played {
        rotation: Some(keys),
        translation: None,
        duration: 700.0,
        repeats: true,
        rest: (DVec3::ZERO, DQuat::IDENTITY),
        body_from_parent: DAffine3::IDENTITY,
    };
    let carrier = |played: Played| Joint {
        name: "carrier".to_owned(),
        parent: None,
        motion: JointDrive::Played(Box::new(played)),
    };
    let panel = joint(Some(0), Guided { rate: Some(2.0 * ORBITAL), ..facing(DVec3::Y) });
    let (short, whole) = walked_both_ways(&[carrier(played.clone()), panel.clone()], 10.0);
    assert_eq!(short, whole);
    let once = Played { repeats: false, ..played };
    let (short, whole) = walked_both_ways(&[carrier(once), panel], 10.0);
    let all = (10.0 * PERIOD / short.walks_by()) as usize;
    assert!((1..all / 2).contains(&short.kept()) && largest_difference(&short, &whole, 10.0) < 1e-12);
}

/// A run of 100,000 steps reads four positions a step. What is kept of them stays below two blocks and the marks of `track`.
#[test]
fn a_long_run_keeps_no_more_of_its_walk() {
    let sun = sun_of_orbit();
    let panel = Guided { rate: Some(0.7 * ORBITAL), ..facing(DVec3::Y) };
    let joints = Joints::new(vec![joint(None, panel)], -5.0, 0.25, &sun);
    let (mut early, mut late) = (0, 0);
    for step in 0..100_000 {
        joints.at(f64::from(step), &sun);
        let stored = joints.stored();
        if step < 10_000 { early = stored.max(early) } else { late = stored.max(late) }
    }
    assert!(late < 2 * 1025 + 2049 && late < early + 400, "{early} numbers at first, {late} later");
}

#[test]
fn joints_stand_at_the_ends_of_their_ranges() {
    assert!(Joints::default().at_ends().is_empty(), "nothing moves");
    let turn = |drive| joint(None, guided(JointKind::Rotation, DVec3::Z, drive));
    let angles = |joint: Joint| -> Vec<f64> {
        let ends = Joints::new(vec![joint], 0.0, 1.0, |_| DVec3::X).at_ends();
        ends.iter().map(|poses| poses[1].matrix3.x_axis.y.atan2(poses[1].matrix3.x_axis.x)).collect()
    };
    let is = |found: Vec<f64>, known: &[f64]| {
        assert!(found.len() == known.len() && found.iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    };
    let schedule = Drive::Schedule { times: vec![0.0, 5.0, 9.0], positions: vec![0.4, -0.2, 1.1] };
    is(angles(turn(schedule.clone())), &[-0.2, 1.1]);
    is(angles(turn(Drive::Fixed(0.7))), &[0.7]);
    let third = std::f64::consts::TAU / 3.0;
    let sun = guided(JointKind::Rotation, DVec3::Z, Drive::Sun { facing: DVec3::X, offset: 0.1 });
    is(angles(joint(None, sun.clone())), &[0.1 - third, 0.1 + third]);
    is(angles(joint(None, Guided { limits: Some([-0.3, 0.9]), ..sun })), &[-0.3, 0.9]);
    // A joint rides on another.
    let slide = joint(Some(0), guided(JointKind::Translation, DVec3::X, Drive::Fixed(2.0)));
    let ends = Joints::new(vec![turn(schedule), slide], 0.0, 1.0, |_| DVec3::X).at_ends();
    let at = ends[1][2].transform_point3(DVec3::ZERO);
    assert!((at - 2.0 * DVec3::new(1.1f64.cos(), 1.1f64.sin(), 0.0)).length() < 1e-12, "{at}");
}
