//! How often the step of the one pass is halved: the estimated error decides, after the first four steps of the scene and then after every sixteen.

use std::sync::Arc;

use super::told::Estimate;

/// Steps of the scene after which the estimate decides.
const CHECKED: u32 = 16;
/// Steps of the scene after which the estimate decides first.
const FIRST: u32 = 4;
pub(crate) const HALVINGS_AT_MOST: u32 = 3;
/// Share of the bounds below which a halving is taken back. Twice the step has four times the error.
const RELAXED: f64 = 1.0 / 16.0;
/// Least bound of the error of a single node [K], and that bound over the tolerance.
const NODE_BOUND: (f64, f64) = (1.0, 10.0);

/// Halvings of the step, and when to decide on them again.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Halving {
    /// Largest root mean square error that is accepted [K].
    pub(crate) tolerance: f64,
    /// Halvings of the step of the scene that the network needs to fit. These count towards [`HALVINGS_AT_MOST`].
    pub(crate) least: u32,
    /// Halvings beyond the least.
    pub(crate) count: u32,
    /// Steps of the scene since the last decision. The first one comes early.
    pub(crate) since: u32,
    /// Decisions at which the error exceeded the tolerance with the most halvings.
    pub(crate) exceeded: u32,
    /// Greatest number of halvings beyond the least so far.
    pub(crate) most: u32,
}

impl Halving {
    pub(crate) fn new(tolerance: f64, least: u32) -> Self {
        Self { tolerance, least, count: 0, since: CHECKED - FIRST, exceeded: 0, most: 0 }
    }

    /// The decisions of a saved state under the bounds of this one.
    pub(crate) fn with_decisions_of(self, saved: Self) -> Self {
        Self { tolerance: self.tolerance, least: self.least, count: saved.count.min(HALVINGS_AT_MOST), ..saved }
    }

    /// Steps in the longest step that the network fits.
    pub(crate) fn parts(&self) -> u32 {
        1 << self.count
    }

    /// Counts a step of the scene. Returns whether the estimate is to be taken before it.
    pub(crate) fn is_due(&mut self) -> bool {
        let due = self.since == CHECKED;
        self.since = if due { 1 } else { self.since + 1 };
        due
    }

    /// Decides by the estimate since the last decision.
    pub(crate) fn take(&mut self, recent: Estimate) {
        let most = (NODE_BOUND.1 * self.tolerance).max(NODE_BOUND.0);
        let within = |share: f64| recent.rms <= share * self.tolerance && recent.most <= share * most;
        if !within(1.0) {
            if self.least + self.count < HALVINGS_AT_MOST {
                self.count += 1;
            } else {
                self.exceeded += 1;
            }
        } else if within(RELAXED) {
            self.count = self.count.saturating_sub(1);
        }
        self.most = self.most.max(self.count);
    }
}

/// Who decides how often the steps of the scene are halved. A run beside another one takes its halvings, because a difference of their temperatures would
/// otherwise hold a difference of their methods.
#[derive(Debug, Clone, Default)]
pub enum HalvingCourse {
    /// The estimated error.
    #[default]
    Decided,
    /// The estimated error, and the halvings of each step of the scene from here on are kept.
    Kept(Vec<u32>),
    /// The halvings that another run kept, and the number of the next step. After their end the estimated error decides.
    Followed(Arc<[u32]>, usize),
}

impl HalvingCourse {
    /// The halvings of each step that were kept. Empty where they were not.
    pub(crate) fn kept(self) -> Arc<[u32]> {
        if let Self::Kept(kept) = self { kept.into() } else { Arc::default() }
    }
}

/// Halvings of the step, and who decides on them.
#[derive(Debug, Clone)]
pub(crate) struct Halvings {
    pub(crate) now: Halving,
    course: HalvingCourse,
}

impl Halvings {
    pub(crate) fn new(tolerance: f64, least: u32) -> Self {
        Self { now: Halving::new(tolerance, least), course: HalvingCourse::Decided }
    }

    /// Counts a step of the scene. Returns whether the estimate is to be taken before it.
    pub(crate) fn is_due(&mut self) -> bool {
        let due = self.now.is_due();
        let HalvingCourse::Followed(kept, next) = &mut self.course else { return due };
        let Some(count) = kept.get(*next) else { return due };
        (self.now.count, *next) = (*count, *next + 1);
        false
    }

    /// Steps of a step of the scene that begins, in the longest step that the network fits.
    pub(crate) fn begin(&mut self) -> u32 {
        if let HalvingCourse::Kept(kept) = &mut self.course {
            kept.push(self.now.count);
        }
        self.now.parts()
    }

    /// Takes another course from the next step on. Returns the course so far.
    pub(crate) fn take_course(&mut self, course: HalvingCourse) -> HalvingCourse {
        std::mem::replace(&mut self.course, course)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_follows_the_halvings_of_another() {
        let much = Estimate { rms: 1.0, most: 1.0, node: 0 };
        let run = |course: HalvingCourse, errs: bool| {
            let mut halvings = Halvings::new(0.1, 0);
            halvings.take_course(course);
            let step = |_| {
                if halvings.is_due() && errs {
                    halvings.now.take(much);
                }
                halvings.begin()
            };
            let parts: Vec<u32> = (0..22).map(step).collect();
            (parts, halvings.take_course(HalvingCourse::Decided).kept())
        };
        let (first, kept) = run(HalvingCourse::Kept(Vec::new()), true);
        assert_eq!((first[3], first[4], first[20]), (1, 2, 4));
        assert_eq!(run(HalvingCourse::Followed(kept.clone(), 0), false).0, first);
        let short = HalvingCourse::Followed(kept[..10].into(), 0);
        assert_eq!(run(short, true).0[20], 4, "the estimate decides after the last step that was kept");
        assert_ne!(run(HalvingCourse::Decided, false).0, first);
    }

    #[test]
    fn steps_are_halved_above_the_tolerance_and_doubled_far_below_it() {
        let mut halving = Halving::new(0.1, 0);
        let told = |rms, most| Estimate { rms, most, node: 0 };
        for (estimate, parts) in [
            (told(0.09, 0.9), 1),
            (told(0.11, 0.9), 2),
            (told(0.03, 0.9), 2),
            (told(0.03, 1.1), 4),
            (told(0.2, 0.1), 8),
            (told(f64::NAN, 0.1), 8),
            (told(0.006, 0.06), 4),
            (told(0.006, 0.07), 4),
        ] {
            halving.take(estimate);
            assert_eq!(halving.parts(), parts, "{estimate:?}");
        }
        assert_eq!((halving.exceeded, halving.most), (1, 3));
        let mut shorter = Halving::new(0.1, 2);
        for parts in [2, 2] {
            shorter.take(told(0.2, 0.1));
            assert_eq!(shorter.parts(), parts, "a quarter of the step is halved once");
        }
        assert_eq!(shorter.exceeded, 1);
    }

    #[test]
    fn the_estimate_is_due_after_four_steps_and_then_after_sixteen() {
        let mut halving = Halving::new(0.1, 0);
        let due: Vec<u32> = (0..40).filter(|_| halving.is_due()).collect();
        assert_eq!(due, [4, 20, 36]);
    }
}
