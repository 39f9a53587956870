//! The time that a quick measurement has: each device and each section its share, so that all of them are heard.

use std::time::{Duration, Instant};

use super::Section;

/// What `--quick` may take [s]; what is under way when a share ends goes on, so the end lies behind it.
const QUICK_S: f64 = 70.0;
/// Why a row is empty.
pub const OUT_OF_TIME: &str = "left out: --quick had no time left";

/// When a section must not begin anything new.
#[derive(Debug, Clone, Copy)]
pub struct Deadline(Option<Instant>);

impl Deadline {
    /// Never.
    pub const NONE: Self = Self(None);

    /// Whether it is past.
    pub fn is_past(self) -> bool {
        self.0.is_some_and(|end| Instant::now() >= end)
    }

    /// What one of several may take at most [s], where `most` is enough.
    pub fn share(self, of: usize, most: f64) -> f64 {
        let left = |end: Instant| end.saturating_duration_since(Instant::now()).as_secs_f64();
        self.0.map_or(most, |end| most.min(left(end) / of.max(1) as f64))
    }
}

/// A measurement that has begun.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    began: Instant,
    quick: bool,
    targets: usize,
}

impl Clock {
    /// Begins to measure on so many targets.
    pub fn start(quick: bool, targets: usize) -> Self {
        Self { began: Instant::now(), quick, targets }
    }

    /// Since it began [s].
    pub fn seconds(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    /// When a section of a target must be over, among the sections that are wanted.
    pub fn deadline(&self, target: usize, section: Section, wanted: &[Section]) -> Deadline {
        if !self.quick {
            return Deadline::NONE;
        }
        let weight = |sections: &[Section]| sections.iter().filter_map(|section| weight(*section)).sum::<f64>();
        let until: Vec<Section> = Section::ALL.into_iter().take_while(|one| *one != section).chain([section]).collect();
        let until: Vec<Section> = until.into_iter().filter(|section| wanted.contains(section)).collect();
        let share = weight(&until) / weight(wanted).max(f64::MIN_POSITIVE);
        let seconds = QUICK_S * (target as f64 + share) / self.targets.max(1) as f64;
        Deadline(Some(self.began + Duration::from_secs_f64(seconds)))
    }
}

/// Share of a device's time, in no unit; none of what ignores deadlines.
fn weight(section: Section) -> Option<f64> {
    match section {
        Section::Limits | Section::Drivers => Some(1.0),
        Section::Responses => Some(2.0),
        Section::Frames => Some(5.0),
        Section::Models => Some(4.0),
        Section::Integrators => Some(8.0),
        Section::Hard => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_follow_each_other_within_the_time() {
        let wanted = [Section::Limits, Section::Frames, Section::Integrators];
        let clock = Clock::start(true, 2);
        let seconds = |target, section| {
            let Deadline(Some(end)) = clock.deadline(target, section, &wanted) else { panic!("a quick one ends") };
            (end - clock.began).as_secs_f64()
        };
        // Weights 1, 5 and 8 of 14, in half of the time each device.
        assert!((seconds(0, Section::Limits) - QUICK_S / 28.0).abs() < 1e-6);
        assert!((seconds(0, Section::Integrators) - QUICK_S / 2.0).abs() < 1e-6);
        assert!((seconds(1, Section::Frames) - QUICK_S * (0.5 + 6.0 / 28.0)).abs() < 1e-6);
        assert!((seconds(1, Section::Integrators) - QUICK_S).abs() < 1e-6);
    }

    #[test]
    fn what_is_whole_has_no_deadline() {
        let deadline = Clock::start(false, 1).deadline(0, Section::Frames, &Section::ALL);
        assert!(!deadline.is_past());
        assert!((deadline.share(10, 3.0) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn shares_shrink_and_a_deadline_passes() {
        let past = Deadline(Some(Instant::now()));
        assert!(past.is_past());
        assert!(past.share(4, 2.0).abs() < 1e-12);
        let soon = Deadline(Some(Instant::now() + Duration::from_secs(4)));
        assert!(soon.share(8, 2.0) <= 0.5 && soon.share(1, 2.0) <= 2.0);
    }
}
