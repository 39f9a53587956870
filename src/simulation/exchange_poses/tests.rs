//! Tests of findings for poses of the joints.

use super::*;

/// A finding that knows its angle, by cosine and sine.
#[derive(Debug, Clone, PartialEq)]
struct Angle([f64; 2]);

impl Finding for Angle {
    type Packed = Self;
    fn unpack(packed: &Arc<Self>) -> Self {
        (**packed).clone()
    }
    fn at(&self, other: &Self, share: f64) -> Self {
        Self([0, 1].map(|k| self.0[k] + share * (other.0[k] - self.0[k])))
    }
    fn share_to_hold(&self, _: &Self) -> f64 {
        0.1
    }
    fn bends(&self, [before, after]: [&Self; 2], ratio: f64) -> bool {
        let off = |k: usize| (after.0[k] - self.0[k]) - ratio * (self.0[k] - before.0[k]);
        off(0).hypot(off(1)) > 0.05
    }
    fn bytes(_: &Self) -> usize {
        1
    }
}

fn poses(angle: f64) -> [DAffine3; 2] {
    [DAffine3::IDENTITY, DAffine3::from_rotation_z(angle)]
}

fn angle_of(poses: &[DAffine3]) -> Angle {
    Angle([poses[1].matrix3.x_axis.x, poses[1].matrix3.x_axis.y])
}

/// The largest difference between the angle and what holds, as a joint turns in steps; and the number of findings.
fn off(posed: &mut Posed<Angle>, steps: impl Iterator<Item = f64>) -> (f64, usize) {
    let (mut most, mut count) = (0.0f64, 0);
    for angle in steps {
        posed.turn(&poses(angle), &mut |poses| {
            count += 1;
            Arc::new(angle_of(poses))
        });
        let Angle([x, y]) = **posed.found().expect("it was found");
        most = most.max((y * angle.cos() - x * angle.sin()).atan2(x * angle.cos() + y * angle.sin()).abs());
    }
    (most, count)
}

#[test]
fn rows_follow_a_joint_however_far_it_turns() {
    let mut posed = Posed::new(0.08);
    // Almost five turns, each of 79 findings: the oldest make room. By places in a list, rows stood still after 64.
    let (most, count) = off(&mut posed, (0..3000).map(|step| 0.01 * f64::from(step)));
    println!("{most} after {count} findings");
    assert!(most < 0.012, "{most}");
    assert!((300..700).contains(&count), "{count}");
    assert!((posed.stalest - most).abs() < 1e-4, "{} is told, {most} is true", posed.stalest);
    // Steps beyond the angle are found for one by one.
    let mut posed = Posed::new(0.01);
    let (most, count) = off(&mut posed, (0..200).map(|step| 0.05 * f64::from(step)));
    assert!(most < 1e-9 && count > 120, "{most}, {count}");
}

#[test]
fn poses_that_come_back_need_no_new_findings() {
    let mut posed = Posed::new(0.2);
    let there = |step: i32| 0.9 * (0.02 * f64::from(step)).sin();
    let (most, count) = off(&mut posed, (0..315).map(there));
    let (again, anew) = off(&mut posed, (0..315).map(there));
    println!("{most} with {count}, then {again} with {anew}");
    assert!(count < 40 && anew <= 2 && most < 0.045 && again < 0.045, "{most} {count} {again} {anew}");
    // A jump to elsewhere is found for at once.
    assert!(off(&mut posed, std::iter::once(2.5)).0 < 1e-9);
}

#[test]
fn joints_that_rest_have_a_finding_of_their_own() {
    let mut posed = Posed::new(0.4);
    // The mean of two directions is shorter than 1.
    let length = |posed: &Posed<Angle>| posed.found().map(|found| found.0[0].hypot(found.0[1])).expect("it was found");
    let there_and_back = || (0..=25).chain((0..=25).rev()).chain(0..=25).map(|step| 0.02 * f64::from(step));
    off(&mut posed, there_and_back());
    assert!(length(&posed) < 0.999, "{}", length(&posed));
    let (most, count) = off(&mut posed, [0.45; 3].into_iter());
    assert!(most < 1e-3 && count == 1 && (length(&posed) - 1.0).abs() < 1e-12, "{most} {count}");
    // On its way it knows all as before, and its place when it comes again.
    let (_, count) = off(&mut posed, there_and_back().chain([0.45; 2]));
    assert!(count == 0 && (length(&posed) - 1.0).abs() < 1e-12, "{count}");
}

#[test]
fn a_way_beyond_which_nothing_is_as_before_is_halved() {
    // What is found stands still beyond 0.5, and the joint stops at 0.52.
    let stands = |poses: &[DAffine3]| Angle([poses[1].matrix3.x_axis.y.atan2(poses[1].matrix3.x_axis.x).min(0.5), 0.0]);
    let mut posed = Posed::<Angle>::new(0.2);
    let mut most = 0.0f64;
    for step in 0..=26 {
        let angle = 0.02 * f64::from(step);
        posed.turn(&poses(angle), &mut |poses| Arc::new(stands(poses)));
        most = most.max((posed.found().expect("it was found").0[0] - angle.min(0.5)).abs());
    }
    println!("{most} with {} findings", posed.made);
    assert!(most < 0.03 && posed.made < 12, "{most} {}", posed.made);
}

/// A finding that bends everywhere.
#[derive(Debug, Clone, PartialEq)]
struct Bent;

impl Finding for Bent {
    type Packed = Self;
    fn unpack(_: &Arc<Self>) -> Self {
        Self
    }
    fn at(&self, _: &Self, _: f64) -> Self {
        Self
    }
    fn share_to_hold(&self, _: &Self) -> f64 {
        0.1
    }
    fn bends(&self, _: [&Self; 2], _: f64) -> bool {
        true
    }
    fn bytes(_: &Self) -> usize {
        1
    }
}

#[test]
fn ways_that_all_bend_are_found_for_twice_as_often() {
    for part in [0.1, 0.2, 0.4, 0.45, 0.48] {
        let (mut posed, mut count) = (Posed::<Bent>::new(0.25), 0);
        let mut angle = 0.0;
        while angle < 6.0 {
            posed.turn(&poses(angle), &mut |_| {
                count += 1;
                Arc::new(Bent)
            });
            angle += 0.25 * part;
        }
        println!("{part}: {count} findings, {} poses", posed.made);
        assert!((47..=51).contains(&count), "{part}: {count} findings");
    }
}

#[test]
fn a_saved_state_goes_on_alike() {
    let mut posed = Posed::new(0.1);
    off(&mut posed, (0..37).map(|step| 0.01 * f64::from(step)));
    let mut again = Posed::new(0.1);
    let restored = again.restore(&posed.save(), &mut |poses| Arc::new(angle_of(poses))).cloned();
    assert_eq!(restored.as_ref().map(|held| held.mean()), posed.found());
    for step in 37..90 {
        let turn = poses(0.01 * f64::from(step));
        let [first, second] = [&mut posed, &mut again].map(|posed| {
            let held = posed.turn(&turn, &mut |poses| Arc::new(angle_of(poses)));
            held.map(|held| Arc::clone(held.mean()))
        });
        assert_eq!(first, second, "step {step}");
    }
}
