//! Findings for poses of the joints, and the place of the present pose between two of them.
//!
//! A pose between two known ones takes a mean of what was found for both, so rows follow a joint to second order in the angle between findings. The next pose
//! to find for is foreseen from the motion of the last step. A way on which what is found bends is halved: a joint may stop before a pose that was foreseen, and
//! there one thing may stick in another. Poses that lie on no known way are found for at once. Findings have numbers of their own, which
//! are never given twice: a place in a list would be another finding after the oldest made room.

use std::sync::{Arc, OnceLock};

use glam::DAffine3;

use crate::exchange::turn::{between, on_the_way, turned};
use crate::trace::{span, span_with};

/// A turn below this is rounding [rad].
const STILL: f64 = 1e-9;
/// Distance from a known way, over the angle between findings, within which a pose lies on it.
const SLACK: f64 = 0.1;
/// Angle, over the angle between findings, up to which a way is halved no more. A half of a whole way, which rounding may lengthen, is never halved again.
const LEAST: f64 = 0.75;
/// Most poses that are kept. The oldest makes room.
pub(super) const MOST: usize = 64;

/// The poses between which rows lie, and the share of the second.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct RowsBetween {
    /// Poses of the first finding.
    pub(crate) from: Vec<DAffine3>,
    /// Poses of the second finding.
    pub(crate) to: Vec<DAffine3>,
    /// Share of the second finding.
    pub(crate) share: f64,
}

/// The findings in use: their numbers, and the share of the second.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
struct Place {
    from: u64,
    to: u64,
    share: f64,
}

/// A pose with its finding. After a restart the finding is asked for again when it is needed.
#[derive(Debug, Clone)]
struct KnownPose<P> {
    number: u64,
    poses: Vec<DAffine3>,
    found: Option<Arc<P>>,
}

/// The saved poses, without what was found for them.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct PosedState {
    known: Vec<(u64, Vec<DAffine3>)>,
    ways: Vec<[u64; 2]>,
    place: Option<Place>,
    last: Vec<DAffine3>,
    stalest: f64,
}

/// What was found for poses of the joints.
pub(super) trait Finding: Sized {
    /// The finding in the least memory.
    type Packed;

    /// The finding that was packed.
    fn unpack(packed: &Arc<Self::Packed>) -> Self;
    /// The finding at a share of the way to another.
    fn at(&self, other: &Self, share: f64) -> Self;
    /// The share of the way to another by which a pose may move before the finding between them must be made anew.
    fn share_to_hold(&self, other: &Self) -> f64;
    /// Whether the mean of this and the second of two others misses the pose in their middle by too much. The first lies on the other side of this one; `ratio` is the
    /// angle to the second over the angle to the first.
    fn bends(&self, others: [&Self; 2], ratio: f64) -> bool;
    /// Memory that a packed finding takes [B].
    fn bytes(packed: &Self::Packed) -> usize;
}

/// Two findings, and the place between them.
#[derive(Debug, Clone)]
pub(super) struct FindingPair<T> {
    /// The first finding, and its number.
    pub(super) from: (u64, Arc<T>),
    /// The second one. It is the first where joints rest there.
    pub(super) to: (u64, Arc<T>),
    /// Share of the second one.
    pub(super) share: f64,
    mean: OnceLock<Arc<T>>,
}

impl<T: Finding> FindingPair<T> {
    /// The mean of both findings. It is made when somebody asks for it first: a device has no need of it.
    pub(super) fn mean(&self) -> &Arc<T> {
        self.mean.get_or_init(|| {
            if self.from.0 == self.to.0 {
                return Arc::clone(&self.from.1);
            }
            let _means = span("rows between two poses");
            Arc::new(self.from.1.at(&self.to.1, self.share))
        })
    }
}

/// Findings that are kept unpacked: the two in use, and the one before.
const WHOLE: usize = 3;
/// Memory for packed findings [B].
pub(super) const MEMORY: usize = 1 << 29;

/// Findings for poses of the joints, and what holds now.
#[derive(Debug, Clone)]
pub(super) struct Posed<T: Finding> {
    /// Turn of a joint between two findings [rad].
    angle: f64,
    known: Vec<KnownPose<T::Packed>>,
    /// The last findings in use, with their numbers, the latest at the end.
    whole: Vec<(u64, Arc<T>)>,
    /// Findings between which joints have moved, by their numbers.
    ways: Vec<[u64; 2]>,
    place: Option<Place>,
    /// Share of the way for which a mean of both ends is held, and the numbers of these ends.
    hold: f64,
    hold_of: [u64; 2],
    now: Option<Arc<FindingPair<T>>>,
    /// Poses of the last call.
    last: Vec<DAffine3>,
    /// Largest turn of a joint against the poses for which the rows in use hold [rad].
    pub(crate) stalest: f64,
    /// Findings made so far.
    pub(crate) made: u64,
}

impl<T: Finding> Posed<T> {
    /// Nothing is found yet. Findings lie `angle` [rad] apart.
    pub(crate) fn new(angle: f64) -> Self {
        Self {
            angle,
            known: Vec::new(),
            whole: Vec::new(),
            ways: Vec::new(),
            place: None,
            hold: 0.0,
            hold_of: [0; 2],
            now: None,
            last: Vec::new(),
            stalest: 0.0,
            made: 0,
        }
    }

    /// Follows the joints to poses. Returns what holds where it changed.
    pub(crate) fn turn(
        &mut self,
        poses: &[DAffine3],
        find: &mut dyn FnMut(&[DAffine3]) -> Arc<T::Packed>,
    ) -> Option<&Arc<FindingPair<T>>> {
        let before = std::mem::replace(&mut self.last, poses.to_vec());
        let limit = (SLACK * self.angle).max(STILL);
        let moves = turned(&before, poses) > STILL;
        let place = match self.nearest(poses) {
            // What a mean misses passes while a joint moves. It would stay where the joint rests.
            Some((place, _)) if !moves && place.from != place.to => self.rest(poses, limit),
            Some((place, off)) if off <= limit => place,
            _ => self.extend(&before, poses),
        };
        let changed = match &self.place {
            Some(held) if (held.from, held.to) == (place.from, place.to) && self.now.is_some() => {
                let off = (place.share - held.share).abs();
                off > if moves { 0.5 * self.hold } else { STILL }
            }
            _ => true,
        };
        if changed {
            self.enter(place, moves, &before, find);
        }
        if let Some(rows) = self.rows() {
            self.stalest = self.stalest.max(turned(&between(&rows.from, &rows.to, rows.share), poses));
        }
        self.now.as_ref().filter(|_| changed)
    }

    /// Makes what holds at a place. For a joint that moves it is the middle of the share for which it will be held.
    fn enter(
        &mut self,
        place: Place,
        moves: bool,
        before: &[DAffine3],
        find: &mut dyn FnMut(&[DAffine3]) -> Arc<T::Packed>,
    ) {
        let held = self.place.replace(place);
        // Rays may be cut. Then nothing holds, and the next call finds it.
        self.now = None;
        let mut place = place;
        if held.is_none_or(|held| (held.from, held.to) != (place.from, place.to)) {
            while let Some(half) = self.half(place, find) {
                place = half;
                self.place = Some(place);
            }
        }
        let [Some(from), Some(to)] = [place.from, place.to].map(|number| self.finding(number, find)) else { return };
        let between = |share: f64| {
            let (from, to) = ((place.from, Arc::clone(&from)), (place.to, Arc::clone(&to)));
            Some(Arc::new(FindingPair { from, to, share, mean: OnceLock::new() }))
        };
        if place.from == place.to {
            (self.now, self.hold) = (between(0.0), 0.0);
            return;
        }
        // What lies before them is not asked again on this way.
        self.whole.retain(|(number, _)| [place.from, place.to].contains(number));
        if self.hold_of != [place.from, place.to] || self.hold == 0.0 {
            (self.hold, self.hold_of) = (from.share_to_hold(&to), [place.from, place.to]);
        }
        let came_from = self.rows().map_or(0.0, |rows| on_the_way(&rows.from, &rows.to, before).0);
        let step = place.share - came_from;
        let lead = if moves { 0.5 * held_steps(self.hold, step.abs()).copysign(step) } else { 0.0 };
        let share = (place.share + lead).clamp(0.0, 1.0);
        self.place = Some(Place { share, ..place });
        self.now = between(share);
    }

    /// The place in the half of its way, where what is found bends on it against the way before. Both halves take its place.
    fn half(&mut self, place: Place, find: &mut dyn FnMut(&[DAffine3]) -> Arc<T::Packed>) -> Option<Place> {
        let Place { from, to, share } = place;
        let before = self.ways.iter().find(|way| way[1] == from && way[0] != to)?[0];
        let [first, second, third] = [before, from, to].map(|number| self.poses_of(number));
        let (second, third) = (second?, third?);
        let (angle, before_angle) = (turned(second, third), turned(first?, second));
        let middle = between(second, third, 0.5);
        if angle <= LEAST * self.angle || before_angle <= STILL {
            return None;
        }
        let [before, own, after] = [before, from, to].map(|number| self.finding(number, find));
        if !own?.bends([&*before?, &*after?], angle / before_angle) {
            return None;
        }
        let middle = self.push(middle);
        self.ways.retain(|way| *way != [from, to]);
        self.ways.extend([[from, middle], [middle, to]]);
        Some(if share < 0.5 {
            Place { from, to: middle, share: 2.0 * share }
        } else {
            Place { from: middle, to, share: 2.0 * share - 1.0 }
        })
    }

    /// What is found for known poses.
    fn finding(&mut self, number: u64, find: &mut dyn FnMut(&[DAffine3]) -> Arc<T::Packed>) -> Option<Arc<T>> {
        let known = self.known.iter_mut().find(|known| known.number == number)?;
        if known.found.is_none() {
            let _finds = span_with("radiation between surfaces", || format!("for pose {number}"));
            known.found = Some(find(&known.poses));
        }
        let packed = known.found.clone()?;
        self.make_room(MEMORY / T::bytes(&packed).max(1));
        let whole = match self.whole.iter().position(|(own, _)| *own == number) {
            Some(place) => self.whole.remove(place).1,
            None => Arc::new(T::unpack(&packed)),
        };
        self.whole.push((number, Arc::clone(&whole)));
        self.whole.drain(..self.whole.len().saturating_sub(WHOLE));
        Some(whole)
    }

    /// Forgets the oldest poses that are not in use, beyond a number.
    fn make_room(&mut self, most: usize) {
        let used = |number: u64| self.place.is_some_and(|place| place.from == number || place.to == number);
        while self.known.len() > most.clamp(4, MOST) {
            let Some(oldest) = self.known.iter().position(|known| !used(known.number)) else { return };
            self.known.remove(oldest);
        }
        let is_known = |number: &u64| self.known.iter().any(|known| known.number == *number);
        self.ways.retain(|way| way.iter().all(is_known));
    }

    fn poses_of(&self, number: u64) -> Option<&[DAffine3]> {
        self.known.iter().find(|known| known.number == number).map(|known| &known.poses[..])
    }

    /// The known place next to poses, and the turn by which they miss it [rad].
    fn nearest(&self, poses: &[DAffine3]) -> Option<(Place, f64)> {
        let points = self
            .known
            .iter()
            .map(|known| (Place { from: known.number, to: known.number, share: 0.0 }, turned(&known.poses, poses)));
        let ways = self.ways.iter().filter_map(|[from, to]| {
            let (share, off) = on_the_way(self.poses_of(*from)?, self.poses_of(*to)?, poses);
            Some((Place { from: *from, to: *to, share }, off))
        });
        // A way comes before its ends, so that a joint that moves stays on it.
        ways.chain(points.filter(|(_, off)| *off <= STILL)).min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The place of joints that rest: the nearest finding within a turn [rad], or one of their own.
    fn rest(&mut self, poses: &[DAffine3], limit: f64) -> Place {
        let off = self.known.iter().map(|known| (known.number, turned(&known.poses, poses)));
        let nearest = off.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, off)| *off <= limit);
        let number = nearest.map_or_else(|| self.push(poses.to_vec()), |(number, _)| number);
        Place { from: number, to: number, share: 0.0 }
    }

    /// Adds a way from the last finding, or from these poses, to poses that are foreseen. Where a step turns a joint too far for that, or none, it adds these
    /// poses alone.
    fn extend(&mut self, before: &[DAffine3], poses: &[DAffine3]) -> Place {
        let step = turned(before, poses);
        if !step.is_finite() || step <= STILL || step > self.angle {
            let number = self.push(poses.to_vec());
            return Place { from: number, to: number, share: 0.0 };
        }
        let angle = self.angle;
        let ahead = |from: &[DAffine3]| {
            let steps = ((angle - turned(from, poses)) / step).max(1.0);
            between(before, poses, 1.0 + steps)
        };
        let last = self.place.and_then(|place| Some((place.to, self.poses_of(place.to)?)));
        let on = last.and_then(|(number, from)| {
            let to = ahead(from);
            let (share, off) = on_the_way(from, &to, poses);
            (off <= SLACK * self.angle && turned(from, poses) < self.angle).then_some((number, to, share))
        });
        let (from, to, share) = match on {
            Some(on) => on,
            None => (self.push(poses.to_vec()), ahead(poses), 0.0),
        };
        let to = self.push(to);
        self.ways.push([from, to]);
        Place { from, to, share }
    }

    /// Adds poses. Returns their number.
    fn push(&mut self, poses: Vec<DAffine3>) -> u64 {
        self.made += 1;
        self.known.push(KnownPose { number: self.made, poses, found: None });
        self.made
    }

    /// The poses between which the rows in use lie.
    pub(crate) fn rows(&self) -> Option<RowsBetween> {
        let Place { from, to, share } = self.place?;
        Some(RowsBetween { from: self.poses_of(from)?.to_vec(), to: self.poses_of(to)?.to_vec(), share })
    }

    /// What holds now.
    pub(crate) fn held(&self) -> Option<&Arc<FindingPair<T>>> {
        self.now.as_ref()
    }

    /// The mean that holds now.
    pub(crate) fn found(&self) -> Option<&Arc<T>> {
        self.now.as_ref().map(|held| held.mean())
    }

    /// The poses, without their findings.
    pub(crate) fn save(&self) -> PosedState {
        PosedState {
            known: self.known.iter().map(|known| (known.number, known.poses.clone())).collect(),
            ways: self.ways.clone(),
            place: self.place,
            last: self.last.clone(),
            stalest: self.stalest,
        }
    }

    /// Restores a saved state, and makes what held then.
    pub(crate) fn restore(
        &mut self,
        saved: &PosedState,
        find: &mut dyn FnMut(&[DAffine3]) -> Arc<T::Packed>,
    ) -> Option<&Arc<FindingPair<T>>> {
        let known =
            |(number, poses): &(u64, Vec<DAffine3>)| KnownPose { number: *number, poses: poses.clone(), found: None };
        self.known = saved.known.iter().take(MOST).map(known).collect();
        self.ways.clone_from(&saved.ways);
        self.last.clone_from(&saved.last);
        (self.place, self.stalest, self.now) = (saved.place, saved.stalest, None);
        self.whole.clear();
        self.made = saved.known.iter().map(|known| known.0).max().unwrap_or(0);
        self.enter(saved.place?, false, &[], find);
        self.now.as_ref()
    }
}

/// Share of a way that whole steps take while a mean is held for at most a share `hold`. All of it where the step is rounding.
fn held_steps(hold: f64, step: f64) -> f64 {
    if step > STILL { step * (hold / step).floor() } else { hold }
}

#[cfg(test)]
mod tests;
