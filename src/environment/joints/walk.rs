//! Positions of all joints of a craft over time. Joints with a rate limit are integrated (*walked*) in even steps, because their position
//! depends on the one before.
//!
//! Under a sky that repeats, the walk stops early. Its step divides the period of the sky, so one map takes the positions at the start of
//! a period to those at its end. A period that begins with the positions of an earlier one is therefore followed by the same periods. The
//! walk looks for such a repetition. A joint of rate r whose target moves at most at v < r reaches it after at most a turn over r - v, and
//! then repeats. Joints that hang on it repeat one period later.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DVec3};

use super::{Drive, Guided, Joint, Motion};

/// Largest difference between positions at the starts of two periods that counts as rounding [rad or m].
const SAME: f64 = 1e-12;

/// Periods in which a repetition is looked for. A joint that is too slow to follow its target may never repeat.
const MOST_PERIODS: usize = 64;

/// Most positions that a walk holds: 4 GiB.
const MOST_POSITIONS: f64 = (1u64 << 29) as f64;

/// A walk that would hold too many positions.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{steps:.3e} steps of {joints} joints to {time} s are more than {MOST_POSITIONS:e} positions")]
pub struct LongWalk {
    /// Steps of the walk.
    pub steps: f64,
    /// Joints of the craft.
    pub joints: usize,
    /// End of the walk [s].
    pub time: f64,
}

/// All joints of a craft. A joint stands after its parent.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Joints {
    joints: Vec<Joint>,
    walk: Walk,
}

/// Positions of all joints at even times.
#[derive(Debug, Clone, PartialEq, Default)]
struct Walk {
    step: f64,
    /// In order of time. Between the end of one stretch and the start of the next the last periods repeat.
    stretches: Vec<Stretch>,
}

#[derive(Debug, Clone, PartialEq)]
struct Stretch {
    start: f64,
    /// Those of each joint, time after time.
    positions: Vec<f64>,
    /// Period with which the end of the stretch repeats [s]. It is 0 for the last stretch.
    cycle: f64,
}

impl Joints {
    /// The joints, each after its parent.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Whether nothing moves.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Position of each joint [rad or m] at a time [s], and the poses of the body and of each joint. Both are empty where there is no joint.
    pub fn at(&self, time: f64, sun: &dyn Fn(f64) -> DVec3) -> (Vec<f64>, Vec<DAffine3>) {
        if self.joints.is_empty() {
            return (Vec::new(), Vec::new());
        }
        let walked = self.walked(time, sun);
        self.evaluate(time, sun(time), |joint, target| match &walked {
            Some(positions) if self.joints[joint].rate().is_some() => positions[joint],
            _ => target(None),
        })
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
            let (at, own) = match &joint.motion {
                Motion::Guided(guided) => {
                    let seen = carrier.matrix3.transpose() * sun;
                    let target = |near| guided.within_limits(guided.drive.target(guided.axis, time, seen), near);
                    let at = position(number, &target);
                    (at, guided.motion(at))
                }
                Motion::Played(played) => (played.position(time), played.motion(time)),
            };
            positions.push(at);
            poses.push(carrier * own);
        }
        (positions, poses)
    }

    /// Joints of a craft, each after its parent. Joints with a rate start at their target and are walked over `span` [s] in steps of
    /// `step` [s]. `sun` is the unit vector to the Sun at a time, body frame.
    #[cfg(test)]
    pub(super) fn new(joints: Vec<Joint>, span: [f64; 2], step: f64, sun: impl Fn(f64) -> DVec3) -> Self {
        Self::under_a_sky(joints, span, step, None, sun).unwrap_or_default()
    }

    /// The same under a sky that repeats after `period` [s]. Where the joints repeat as well, periods before time 0 are not walked. The step is the longest
    /// up to `step` that divides the period. Angles of joints without limits may differ from those of the full walk by whole turns.
    ///
    /// # Errors
    /// A walk that would hold too many positions. It does not begin.
    pub fn under_a_sky(
        joints: Vec<Joint>,
        [from, to]: [f64; 2],
        step: f64,
        period: Option<f64>,
        sun: impl Fn(f64) -> DVec3,
    ) -> Result<Self, LongWalk> {
        let any = joints.iter().any(|joint| joint.rate().is_some());
        let mut all = Self { joints, walk: Walk { step, stretches: Vec::new() } };
        if any {
            let first = all.evaluate(from, sun(from), |_, target| target(None)).0;
            all.walk.stretches = vec![Stretch { start: from, positions: first, cycle: 0.0 }];
            if let Some(period) = period.filter(|period| *period > 0.0) {
                all.skip_what_repeats(to.min(0.0).min(all.steady_until()), period, &sun)?;
            }
            all.walk_to(to, sun)?;
        }
        Ok(all)
    }

    /// Walks joints with a rate on to a time [s].
    ///
    /// # Errors
    /// A walk that would hold too many positions. It does not begin.
    pub fn walk_to(&mut self, time: f64, sun: impl Fn(f64) -> DVec3) -> Result<(), LongWalk> {
        let (step, joints) = (self.walk.step, self.joints.len());
        let Some(last) = self.walk.stretches.last() else { return Ok(()) };
        let steps = (time - last.start) / step;
        // A NaN is no number of steps either.
        let is_held = steps * joints as f64 <= MOST_POSITIONS;
        if !is_held {
            return Err(LongWalk { steps, joints, time });
        }
        let Some(Stretch { start, mut positions, .. }) = self.walk.stretches.pop() else { return Ok(()) };
        while start + (positions.len() / joints - 1) as f64 * step < time {
            let at = start + (positions.len() / joints) as f64 * step;
            let next = self.walk_on(&positions[positions.len() - joints..], step, at, sun(at));
            positions.extend(next);
        }
        self.walk.stretches.push(Stretch { start, positions, cycle: 0.0 });
        Ok(())
    }

    /// Walks period by period until one begins as an earlier one did. The walk then continues at the last such beginning before `until` [s].
    fn skip_what_repeats(&mut self, until: f64, period: f64, sun: &impl Fn(f64) -> DVec3) -> Result<(), LongWalk> {
        let from = self.walk.stretches[0].start;
        let whole = ((until - from) / period).floor();
        if !(whole.is_finite() && whole >= 3.0) {
            return Ok(());
        }
        let steps = (period / self.walk.step).ceil().max(1.0);
        self.walk.step = period / steps;
        let each = steps as usize;
        let joints = self.joints.len();
        let start_of = |number: usize| number * each * joints..(number * each + 1) * joints;
        for number in 1..=MOST_PERIODS.min(whole as usize) {
            self.walk_to(from + number as f64 * period - 0.5 * self.walk.step, sun)?;
            let positions = &self.walk.stretches[0].positions;
            let now = &positions[start_of(number)];
            let Some(like) = (0..number).rev().find(|earlier| self.agree(&positions[start_of(*earlier)], now)) else {
                continue;
            };
            let cycles = ((whole - number as f64) / (number - like) as f64).floor();
            if cycles >= 1.0 {
                let cycle = (number - like) as f64 * period;
                let again = positions[start_of(like)].to_vec();
                let start = from + number as f64 * period + cycles * cycle;
                self.walk.stretches[0].cycle = cycle;
                self.walk.stretches.push(Stretch { start, positions: again, cycle: 0.0 });
            }
            return Ok(());
        }
        Ok(())
    }

    /// Whether joints with a rate have equal positions. Whole turns are ignored for joints without limits.
    fn agree(&self, before: &[f64], now: &[f64]) -> bool {
        self.joints.iter().zip(before.iter().zip(now)).all(|(joint, (before, now))| {
            let apart = match &joint.motion {
                Motion::Guided(Guided { rate: None, .. }) | Motion::Played(_) => 0.0,
                Motion::Guided(Guided { drive: Drive::Sun { .. }, limits: None, .. }) => {
                    (now - before + PI).rem_euclid(TAU) - PI
                }
                Motion::Guided(_) => now - before,
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
            Motion::Guided(Guided { drive: Drive::Schedule { times, .. }, .. }) => times[0],
            Motion::Guided(_) => f64::INFINITY,
            Motion::Played(played) if played.repeats => f64::NEG_INFINITY,
            Motion::Played(_) => 0.0,
        };
        let those = self.joints.iter().zip(&matters).filter(|(_, matters)| **matters);
        those.map(|(joint, _)| begins(joint)).fold(f64::INFINITY, f64::min)
    }

    /// Positions at a time by the walk. Before its start they are the targets. Beyond its end it is walked on.
    fn walked(&self, time: f64, sun: &dyn Fn(f64) -> DVec3) -> Option<Vec<f64>> {
        let Walk { step, stretches } = &self.walk;
        let after = stretches.partition_point(|stretch| stretch.start <= time);
        let Stretch { start, positions, cycle } = &stretches[after.checked_sub(1)?];
        let each = self.joints.len();
        let of = |place: usize| &positions[place * each..(place + 1) * each];
        let last = positions.len() / each - 1;
        let mut place = (time - start) / step;
        if place >= last as f64 {
            if *cycle == 0.0 {
                let mut now = of(last).to_vec();
                let mut at = start + last as f64 * step;
                while at < time {
                    let length = step.min(time - at);
                    at += length;
                    now = self.walk_on(&now, length, at, sun(at));
                }
                return Some(now);
            }
            let cycle = cycle / step;
            place -= ((place - last as f64) / cycle).floor().max(0.0) * cycle + cycle;
            place = place.clamp(0.0, last as f64);
        }
        let (before, share) = ((place.floor() as usize).min(last - 1), place);
        let share = share - before as f64;
        let between = |(a, b): (&f64, &f64)| a + share * (b - a);
        Some(of(before).iter().zip(of(before + 1)).map(between).collect())
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

    /// Number of positions that are stored.
    #[cfg(test)]
    pub(super) fn kept(&self) -> usize {
        self.walk.stretches.iter().map(|stretch| stretch.positions.len() / self.joints.len()).sum()
    }

    /// Step of the walk [s].
    #[cfg(test)]
    pub(super) fn walks_by(&self) -> f64 {
        self.walk.step
    }
}
