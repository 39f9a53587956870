//! Divides the time of a quick measurement between devices and measurements.

use std::time::{Duration, Instant};

use super::plan::Measurement;

/// Time for `--quick` [s]. A running measurement still finishes.
const QUICK_S: f64 = 70.0;
/// Reason for an empty row.
pub(crate) const OUT_OF_TIME: &str = "left out: --quick had no time left";

/// The time after which no new measurement may begin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Deadline(Option<Instant>);

impl Deadline {
    pub(crate) const NONE: Self = Self(None);

    /// Whether the deadline is over.
    pub(crate) fn is_past(self) -> bool {
        self.0.is_some_and(|end| Instant::now() >= end)
    }

    /// Time for one of `of` measurements [s], at most `most`.
    pub(crate) fn share(self, parts: usize, most: f64) -> f64 {
        let left = |end: Instant| end.saturating_duration_since(Instant::now()).as_secs_f64();
        self.0.map_or(most, |end| most.min(left(end) / parts.max(1) as f64))
    }
}

/// The start of the measurements and their time limits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BenchClock {
    began: Instant,
    quick: bool,
    targets: usize,
}

impl BenchClock {
    pub(crate) fn start(quick: bool, targets: usize) -> Self {
        Self { began: Instant::now(), quick, targets }
    }

    /// Seconds since the start.
    pub(crate) fn seconds(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    /// Deadline of a measurement on a target, among the wanted measurements.
    pub(crate) fn deadline(&self, target: usize, measurement: Measurement, wanted: &[Measurement]) -> Deadline {
        if !self.quick {
            return Deadline::NONE;
        }
        let weight = |up_to: Measurement| -> f64 {
            wanted.iter().filter(|one| **one <= up_to).filter_map(|one| weight(*one)).sum()
        };
        let share = weight(measurement) / weight(Measurement::Hard).max(f64::MIN_POSITIVE);
        let seconds = QUICK_S * (target as f64 + share) / self.targets.max(1) as f64;
        Deadline(Some(self.began + Duration::from_secs_f64(seconds)))
    }
}

/// Relative share of a device's time. `None` for measurements without a deadline.
fn weight(measurement: Measurement) -> Option<f64> {
    match measurement {
        Measurement::Limits | Measurement::Drivers => Some(1.0),
        Measurement::Responses => Some(2.0),
        Measurement::Frames => Some(5.0),
        Measurement::Models => Some(4.0),
        Measurement::Integrators => Some(8.0),
        Measurement::Hard => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_follow_each_other_within_the_time() {
        let wanted = [Measurement::Limits, Measurement::Frames, Measurement::Integrators];
        let clock = BenchClock::start(true, 2);
        let seconds = |target, one| {
            let Deadline(Some(end)) = clock.deadline(target, one, &wanted) else { panic!("a quick one ends") };
            (end - clock.began).as_secs_f64()
        };
        // Weights 1, 5 and 8 of 14. Each device has half of the time.
        assert!((seconds(0, Measurement::Limits) - QUICK_S / 28.0).abs() < 1e-6);
        assert!((seconds(0, Measurement::Integrators) - QUICK_S / 2.0).abs() < 1e-6);
        assert!((seconds(1, Measurement::Frames) - QUICK_S * (0.5 + 6.0 / 28.0)).abs() < 1e-6);
        assert!((seconds(1, Measurement::Integrators) - QUICK_S).abs() < 1e-6);
    }

    #[test]
    fn what_is_whole_has_no_deadline() {
        let deadline = BenchClock::start(false, 1).deadline(0, Measurement::Frames, &Measurement::ALL);
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
