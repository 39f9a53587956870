//! Findings for poses of the joints, kept for when the poses come back. New poses are worked on a share in each step, so that no step stalls.

use glam::DAffine3;

use crate::exchange::turn::turned;

/// A turn below this is rounding [rad].
const STILL: f64 = 1e-9;
/// Most poses that are kept. The oldest makes room.
const MOST: usize = 64;

/// The work that a finder is asked for.
#[derive(Debug, Clone, Copy)]
pub(super) enum Task<'a> {
    /// All for these poses, at once.
    Whole(&'a [DAffine3]),
    /// A share of the work for these poses, by its number.
    Share(&'a [DAffine3], u32),
    /// The result of all shares.
    Take(&'a [DAffine3]),
}

/// The saved poses, without what was found for them.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct PosedState {
    known: Vec<Vec<DAffine3>>,
    now: usize,
    pending: Option<(Vec<DAffine3>, u32)>,
    stalest: f64,
}

/// Findings for poses of the joints. One holds for all poses within an angle of its own.
#[derive(Debug, Clone)]
pub(super) struct Posed<T> {
    angle: f64,
    /// Steps over which the work for new poses is spread. With 1 it is done at once.
    shares: u32,
    /// Poses with their findings. After a restart a finding is made anew when it is needed.
    known: Vec<(Vec<DAffine3>, Option<T>)>,
    now: usize,
    /// Poses that are worked on, and for how many steps.
    pending: Option<(Vec<DAffine3>, u32)>,
    /// Largest turn of a joint against the poses of the finding in use [rad].
    pub(crate) stalest: f64,
}

impl<T> Posed<T> {
    /// Nothing is found yet. Findings hold within `angle` [rad]. The work for new poses is spread over `shares` steps, and its result is taken after as many again.
    pub(crate) fn new(angle: f64, shares: u32) -> Self {
        Self { angle, shares, known: Vec::new(), now: 0, pending: None, stalest: 0.0 }
    }

    /// Chooses the finding that holds for poses, or makes one by `find`. Returns it where another finding held before. With `at_once` new poses are
    /// not worked on by shares.
    ///
    /// # Errors
    /// An error of `find`.
    pub(crate) fn turn<E>(
        &mut self,
        poses: &[DAffine3],
        at_once: bool,
        find: &mut dyn FnMut(Task<'_>) -> Result<Option<T>, E>,
    ) -> Result<Option<&T>, E> {
        let before = self.known.get(self.now).is_some_and(|(_, found)| found.is_some()).then_some(self.now);
        let spread = self.shares > 1;
        // Work that takes many steps begins early.
        let limit = if spread { 0.5 * self.angle } else { self.angle }.max(STILL);
        let turns = self.known.iter().map(|(own, _)| turned(own, poses)).enumerate();
        let nearest = turns.min_by(|a, b| a.1.total_cmp(&b.1));
        let later = spread && !at_once && before.is_some();
        match nearest {
            Some((place, turn)) if turn <= limit || later => {
                self.now = place;
                if turn > limit && self.pending.is_none() {
                    self.pending = Some((poses.to_vec(), 0));
                }
            }
            _ => self.push(poses.to_vec(), None),
        }
        let (own, found) = &mut self.known[self.now];
        if found.is_none() {
            *found = find(Task::Whole(own))?;
        }
        let mut changed = before != Some(self.now);
        if let Some((own, age)) = self.pending.take() {
            if age + 1 < 2 * self.shares {
                if age < self.shares {
                    find(Task::Share(&own, age))?;
                }
                self.pending = Some((own, age + 1));
            } else {
                let found = find(Task::Take(&own))?;
                let gains = turned(&own, poses) < turned(&self.known[self.now].0, poses);
                let now = self.now;
                self.push(own, found);
                if !gains {
                    self.now = now.min(self.known.len() - 2);
                }
                changed |= gains;
            }
        }
        self.stalest = self.stalest.max(turned(&self.known[self.now].0, poses));
        Ok(self.known[self.now].1.as_ref().filter(|_| changed))
    }

    /// Adds poses, which hold from now on.
    fn push(&mut self, poses: Vec<DAffine3>, found: Option<T>) {
        if self.known.len() >= MOST {
            // The poses in use may be the oldest.
            self.known.remove(usize::from(self.now == 0));
        }
        self.known.push((poses, found));
        self.now = self.known.len() - 1;
    }

    /// Poses of the finding that holds now.
    pub(crate) fn poses(&self) -> Option<&[DAffine3]> {
        self.known.get(self.now).map(|known| &known.0[..])
    }

    /// The finding that holds now.
    pub(crate) fn found(&self) -> Option<&T> {
        self.known.get(self.now)?.1.as_ref()
    }

    /// The poses, without their findings.
    pub(crate) fn save(&self) -> PosedState {
        PosedState {
            known: self.known.iter().map(|(poses, _)| poses.clone()).collect(),
            now: self.now,
            pending: self.pending.clone(),
            stalest: self.stalest,
        }
    }

    /// Restores a saved state, and makes the finding that held then.
    ///
    /// # Errors
    /// The errors of `find`.
    pub(crate) fn restore<E>(
        &mut self,
        saved: &PosedState,
        find: impl FnOnce(&[DAffine3]) -> Result<T, E>,
    ) -> Result<Option<&T>, E> {
        self.known = saved.known.iter().take(MOST).map(|poses| (poses.clone(), None)).collect();
        (self.now, self.stalest) = (saved.now, saved.stalest);
        self.pending.clone_from(&saved.pending);
        match self.known.get_mut(self.now) {
            Some((poses, found)) => Ok(Some(found.insert(find(poses)?))),
            None => Ok(None),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    fn found(posed: &mut Posed<u32>, count: &mut u32, angle: f64) -> Option<u32> {
        let poses = [DAffine3::IDENTITY, DAffine3::from_rotation_z(angle)];
        let Ok(found) = posed.turn(&poses, false, &mut |task| {
            Ok::<_, Infallible>((!matches!(task, Task::Share(..))).then(|| {
                *count += 1;
                *count
            }))
        });
        found.copied()
    }

    #[test]
    fn what_was_found_holds_within_its_angle_and_when_the_pose_comes_back() {
        let (mut posed, mut count) = (Posed::new(0.1, 1), 0);
        let anew = [0.0, 0.05, 0.2, 0.25, 0.02, 0.21, 0.4].map(|angle| found(&mut posed, &mut count, angle));
        assert_eq!(anew, [Some(1), None, Some(2), None, Some(1), Some(2), Some(3)]);
        let saved = posed.save();
        let mut again = Posed::new(0.1, 1);
        let restored = again.restore(&saved, |poses| Ok::<_, Infallible>(poses[1].matrix3.x_axis.y));
        assert!(restored.expect("a saved state").is_some_and(|sine| (sine - 0.4f64.sin()).abs() < 1e-12));
        assert!(turned(&[], &[DAffine3::IDENTITY]).is_infinite());
    }

    #[test]
    fn the_work_for_a_new_pose_is_spread_and_its_result_comes_later() {
        let (mut posed, mut count) = (Posed::new(0.1, 2), 0);
        let anew = [0.0, 0.04, 0.06, 0.08, 0.1, 0.12, 0.14].map(|angle| found(&mut posed, &mut count, angle));
        // Work begins at 0.06, takes two steps, and its result is taken two steps later.
        assert_eq!(anew, [Some(1), None, None, None, None, Some(2), None]);
        assert!((posed.stalest - 0.1).abs() < 1e-12, "{}", posed.stalest);
        // The state in the middle of the work goes on alike.
        let (mut posed, mut count) = (Posed::new(0.1, 2), 0);
        for angle in [0.0, 0.06, 0.08] {
            found(&mut posed, &mut count, angle);
        }
        let mut again = Posed::new(0.1, 2);
        again.restore(&posed.save(), |_| Ok::<_, Infallible>(1)).expect("a saved state");
        let anew = [0.1, 0.12].map(|angle| found(&mut again, &mut count, angle));
        assert_eq!(anew, [None, Some(2)]);
    }
}
