//! Positions of all joints of a craft over time. Joints with a rate limit are integrated (*walked*) in even steps, because their position
//! depends on the one before.
//!
//! The walk is made as it is asked for, and little of it is kept (`track`). So its memory does not grow with the steps of a run.
//!
//! Under a sky that repeats, the walk before time 0 is cut short. The step of the walk divides the period of the sky, so one map takes the positions
//! at the start of a period to the positions at its end. A period that begins with the positions of an earlier one is therefore followed by the same
//! periods. The walk looks for such a repetition. A joint of rate r whose target moves at most at v < r reaches it after at most a turn over r - v,
//! and then repeats. Joints that hang on it repeat one period later.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DVec3};

use super::track::JointTrack;
use super::{Drive, Guided, Joint, JointDrive, JointError, JointKind};

/// Largest difference between positions at the starts of two periods that counts as rounding [rad or m].
const SAME: f64 = 1e-12;

/// Greatest angle [deg] and shift [m] of a joint without limits, as in a scene.
const WIDEST_DEG: f64 = 1e9;
const WIDEST_M: f64 = 1e13;

/// Periods in which a repetition is looked for. A joint that is too slow to follow its target may never repeat.
const MOST_PERIODS: usize = 64;

/// Most numbers that are kept while a repetition is looked for: 128 MiB. Beyond it the whole walk is made.
const MOST_KEPT: usize = 1 << 24;

/// All joints of a craft. A joint stands after its parent.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Joints {
    joints: Vec<Joint>,
    walk: Walk,
}

/// Positions of all joints at even times.
#[derive(Debug, Clone, PartialEq, Default)]
struct Walk {
    step: f64,
    /// The first periods, where they repeat.
    lead: Option<Lead>,
    /// The walk from the start, or from where the repetition ends. `None` where no joint has a rate.
    track: Option<JointTrack>,
}

/// The first periods of a walk. The last of them repeat.
#[derive(Debug, Clone, PartialEq)]
struct Lead {
    start: f64,
    /// Positions of each joint, time after time.
    positions: Vec<f64>,
    /// Period with which the end repeats [s].
    cycle: f64,
}

impl Joints {
    /// The joints, each after its parent.
    pub(crate) fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Whether nothing moves.
    pub(crate) fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Position of each joint [rad or m] at a time [s], and the poses of the body and of each joint. Both are empty where there is no joint.
    pub(crate) fn at(&self, time: f64, sun: &dyn Fn(f64) -> DVec3) -> (Vec<f64>, Vec<DAffine3>) {
        if self.joints.is_empty() {
            return (Vec::new(), Vec::new());
        }
        let walked = self.walked(time, sun);
        self.evaluate(time, sun(time), |joint, target| match &walked {
            Some(positions) if self.joints[joint].rate().is_some() => positions[joint],
            _ => target(None),
        })
    }

    /// Poses of the body and of each joint with all joints at the first ends of their ranges, and at the last ones. None where there is no joint.
    pub(crate) fn at_ends(&self) -> Vec<Vec<DAffine3>> {
        let at = |share: f64| {
            let mut poses = vec![DAffine3::IDENTITY];
            for joint in &self.joints {
                let motion = match &joint.motion {
                    JointDrive::Guided(guided) => guided.motion(guided.within_range(share)),
                    JointDrive::Played(played) => played.motion(share * played.duration),
                };
                poses.push(poses[joint.parent.map_or(0, |parent| parent + 1)] * motion);
            }
            poses
        };
        let mut ends: Vec<Vec<DAffine3>> = [0.0, 1.0].into_iter().filter(|_| !self.joints.is_empty()).map(at).collect();
        ends.dedup();
        ends
    }

    /// Positions and poses, from the body outwards. `position` decides the position of a joint from its target, which is the one nearest
    /// to a given position.
    fn evaluate(
        &self,
        time: f64,
        sun: DVec3,
        position: impl Fn(usize, &dyn Fn(Option<f64>) -> f64) -> f64,
    ) -> (Vec<f64>, Vec<DAffine3>) {
        let mut positions = Vec::with_capacity(self.joints.len());
        let mut poses = Vec::with_capacity(self.joints.len() + 1);
        poses.push(DAffine3::IDENTITY);
        for (number, joint) in self.joints.iter().enumerate() {
            let carrier = poses[joint.parent.map_or(0, |parent| parent + 1)];
            let (at, motion) = match &joint.motion {
                JointDrive::Guided(guided) => {
                    let sun_in_carrier = carrier.matrix3.transpose() * sun;
                    let target =
                        |near| guided.within_limits(guided.drive.target(guided.axis, time, sun_in_carrier), near);
                    let at = position(number, &target);
                    (at, guided.motion(at))
                }
                JointDrive::Played(played) => (played.position(time), played.motion(time)),
            };
            positions.push(at);
            poses.push(carrier * motion);
        }
        (positions, poses)
    }

    /// The joints, which walk anew from their positions at a time [s]. Positions that were walked later than this are forgotten.
    pub(crate) fn restart_at(&self, time: f64, sun: &dyn Fn(f64) -> DVec3) -> Self {
        let mut all = Self { joints: self.joints.clone(), walk: Walk { step: self.walk.step, ..Walk::default() } };
        if all.joints.iter().any(|joint| joint.rate().is_some()) {
            all.walk.track = Some(JointTrack::new(time, self.at(time, sun).0));
        }
        all
    }

    /// The joints, with the named one held at a position [rad or m], regardless of its rate.
    ///
    /// # Errors
    /// There is no such joint, it plays an animation, or the position lies outside its limits.
    pub(crate) fn held(&self, name: &str, position: f64) -> Result<Self, JointError> {
        let mut all = self.clone();
        let known = || self.joints.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>().join(", ");
        let unknown = || match known() {
            known if known.is_empty() => JointError::None(name.to_owned()),
            known => JointError::Unknown { name: name.to_owned(), known },
        };
        let joint = all.joints.iter_mut().find(|joint| joint.name == name).ok_or_else(unknown)?;
        let unit = if joint.turns() { "rad" } else { "m" };
        let JointDrive::Guided(guided) = &mut joint.motion else {
            return Err(JointError::Played { name: name.to_owned() });
        };
        let widest = if guided.kind == JointKind::Rotation { WIDEST_DEG.to_radians() } else { WIDEST_M };
        let [low, high] = guided.limits.unwrap_or([-widest, widest]);
        if !(position.is_finite() && (low..=high).contains(&position)) {
            return Err(JointError::Limits { name: name.to_owned(), position, low, high, unit });
        }
        (guided.drive, guided.rate) = (Drive::Fixed(position), None);
        Ok(all)
    }

    /// Joints of a craft, each after its parent. Joints with a rate start at their target at the time `from` [s] and are walked from there in steps of
    /// `step` [s]. `sun` is the unit vector to the Sun at a time, body frame.
    #[cfg(test)]
    pub(super) fn new(joints: Vec<Joint>, from: f64, step: f64, sun: impl Fn(f64) -> DVec3) -> Self {
        Self::under_a_sky(joints, from, step, None, sun)
    }

    /// The joints under a sky that repeats after `period` [s]. Where the joints repeat as well, periods before time 0 are not walked. The step is the
    /// longest up to `step` that divides the period. Angles of joints without limits may differ from the full walk by whole turns.
    pub(crate) fn under_a_sky(
        joints: Vec<Joint>,
        from: f64,
        step: f64,
        period: Option<f64>,
        sun: impl Fn(f64) -> DVec3,
    ) -> Self {
        let any = joints.iter().any(|joint| joint.rate().is_some());
        let mut all = Self { joints, walk: Walk { step, ..Walk::default() } };
        if any {
            let first = all.evaluate(from, sun(from), |_, target| target(None)).0;
            match period.filter(|period| *period > 0.0) {
                Some(period) => all.skip_what_repeats(from, first, period, &sun),
                None => all.walk.track = Some(JointTrack::new(from, first)),
            }
        }
        all
    }

    /// Walks period by period until one begins as an earlier one did. The walk then continues at the last such beginning before time 0 and before anything
    /// else than the Sun moves the joints.
    fn skip_what_repeats(&mut self, from: f64, first: Vec<f64>, period: f64, sun: &impl Fn(f64) -> DVec3) {
        let whole = ((self.steady_until().min(0.0) - from) / period).floor();
        let steps = (period / self.walk.step).ceil().max(1.0);
        let joints = self.joints.len();
        let mut positions = first.clone();
        if whole.is_finite() && whole >= 3.0 {
            self.walk.step = period / steps;
        }
        let most = if whole.is_finite() && whole >= 3.0 { MOST_PERIODS.min(whole as usize) } else { 0 };
        let each = steps as usize;
        let start_of = |number: usize| number * each * joints..(number * each + 1) * joints;
        for number in 1..=most {
            if start_of(number).end > MOST_KEPT {
                break;
            }
            for place in positions.len() / joints..=number * each {
                let at = from + place as f64 * self.walk.step;
                let next = self.walk_on(&positions[positions.len() - joints..], self.walk.step, at, sun(at));
                positions.extend(next);
            }
            let now = &positions[start_of(number)];
            let Some(like) = (0..number).rev().find(|earlier| self.agree(&positions[start_of(*earlier)], now)) else {
                continue;
            };
            let cycles = ((whole - number as f64) / (number - like) as f64).floor();
            if cycles >= 1.0 {
                let cycle = (number - like) as f64 * period;
                let again = positions[start_of(like)].to_vec();
                let start = from + number as f64 * period + cycles * cycle;
                self.walk.track = Some(JointTrack::new(start, again));
                self.walk.lead = Some(Lead { start: from, positions, cycle });
                return;
            }
            break;
        }
        self.walk.track = Some(JointTrack::new(from, first));
    }

    /// Whether joints with a rate have equal positions. Whole turns are ignored for joints without limits.
    fn agree(&self, before: &[f64], now: &[f64]) -> bool {
        self.joints.iter().zip(before.iter().zip(now)).all(|(joint, (before, now))| {
            let apart = match &joint.motion {
                JointDrive::Guided(Guided { rate: None, .. }) | JointDrive::Played(_) => 0.0,
                JointDrive::Guided(Guided { drive: Drive::Sun { .. }, limits: None, .. }) => {
                    (now - before + PI).rem_euclid(TAU) - PI
                }
                JointDrive::Guided(_) => now - before,
            };
            apart.abs() <= SAME
        })
    }

    /// Time until which only the Sun moves the joints with a rate and their parents [s].
    fn steady_until(&self) -> f64 {
        let mut matters: Vec<bool> = self.joints.iter().map(|joint| joint.rate().is_some()).collect();
        for (number, joint) in self.joints.iter().enumerate().rev() {
            if let (true, Some(parent)) = (matters[number], joint.parent) {
                matters[parent] = true;
            }
        }
        let begins = |joint: &Joint| match &joint.motion {
            JointDrive::Guided(Guided { drive: Drive::Schedule { times, .. }, .. }) => times[0],
            JointDrive::Guided(_) => f64::INFINITY,
            JointDrive::Played(played) if played.repeats => f64::NEG_INFINITY,
            JointDrive::Played(_) => 0.0,
        };
        let those = self.joints.iter().zip(&matters).filter(|(_, matters)| **matters);
        those.map(|(joint, _)| begins(joint)).fold(f64::INFINITY, f64::min)
    }

    /// Positions at a time by the walk. Before its start they are the targets.
    fn walked(&self, time: f64, sun: &dyn Fn(f64) -> DVec3) -> Option<Vec<f64>> {
        let Walk { step, lead, track } = &self.walk;
        let track = track.as_ref()?;
        if time >= track.start() {
            let place = (time - track.start()) / step;
            let before = place.floor();
            let next = |number: u64, last: &[f64]| {
                let at = track.start() + number as f64 * step;
                self.walk_on(last, *step, at, sun(at))
            };
            let [a, b] = track.pair(before as u64, &next);
            return Some(between(&a, &b, place - before));
        }
        let Lead { start, positions, cycle } = lead.as_ref().filter(|lead| lead.start <= time)?;
        let each = self.joints.len();
        let row = |place: usize| &positions[place * each..(place + 1) * each];
        let last = positions.len() / each - 1;
        let mut place = (time - start) / step;
        if place >= last as f64 {
            let cycle = cycle / step;
            place -= ((place - last as f64) / cycle).floor().max(0.0) * cycle + cycle;
            place = place.clamp(0.0, last as f64);
        }
        let before = (place.floor() as usize).min(last - 1);
        Some(between(row(before), row(before + 1), place - before as f64))
    }

    /// Positions after another `length` [s].
    fn walk_on(&self, last: &[f64], length: f64, time: f64, sun: DVec3) -> Vec<f64> {
        let step = |joint: usize, target: &dyn Fn(Option<f64>) -> f64| match self.joints[joint].rate() {
            Some(rate) => {
                let from = last[joint];
                from + (target(Some(from)) - from).clamp(-rate * length, rate * length)
            }
            None => target(None),
        };
        self.evaluate(time, sun, step).0
    }

    #[cfg(test)]
    pub(super) fn kept(&self) -> usize {
        self.walk.lead.as_ref().map_or(0, |lead| lead.positions.len() / self.joints.len())
    }

    #[cfg(test)]
    pub(super) fn stored(&self) -> usize {
        let lead = self.walk.lead.as_ref().map_or(0, |lead| lead.positions.len());
        lead + self.walk.track.as_ref().map_or(0, JointTrack::stored)
    }

    /// Step of the walk [s].
    #[cfg(test)]
    pub(super) fn walks_by(&self) -> f64 {
        self.walk.step
    }
}

/// Positions at a share of the way from `a` to `b`.
fn between(a: &[f64], b: &[f64], share: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect()
}
