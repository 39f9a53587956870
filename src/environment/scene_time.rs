//! Time since the start of a scene, checked at every door, and the ends of steps, which are counted.

/// Latest time, before or after the start [s]: 3000 years. Sun and planets are not known better beyond.
pub(crate) const LATEST: f64 = 1e11;
/// Largest number of a step since the start. The end of a step is then known to 2e-3 of a step.
const LARGEST_STEP: f64 = 1e13;
/// Share of a step by which a time may be rounded.
pub(crate) const ROUNDING: f64 = 1e-9;

/// Seconds since the start: finite, and at most [`LATEST`] before or after it.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub(crate) struct SceneTime(f64);

/// Why a number is no time, or why steps do not lead to it.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TimeError {
    /// Not a number, or infinite.
    #[error("{0} s is no time: it must be finite")]
    NotFinite(f64),
    /// Too early or too late.
    #[error("{0:e} s lies beyond the limit of {LATEST:e} s")]
    Beyond(f64),
    /// Steps that are too short for their number to be exact, or too many of them.
    #[error("{steps:.3e} steps of {step} s lie between {from} s and {to} s; the limit is {most:e}")]
    Steps {
        /// Time from which the steps go [s].
        from: f64,
        /// Time to which the steps go [s].
        to: f64,
        /// Length of a step [s].
        step: f64,
        /// Number of the steps.
        steps: f64,
        /// Largest number.
        most: f64,
    },
}

impl SceneTime {
    /// Checks a number [s].
    ///
    /// # Errors
    /// A number that is no time of a scene.
    pub(crate) fn new(seconds: f64) -> Result<Self, TimeError> {
        if !seconds.is_finite() {
            return Err(TimeError::NotFinite(seconds));
        }
        if seconds.abs() > LATEST { Err(TimeError::Beyond(seconds)) } else { Ok(Self(seconds)) }
    }

    /// The number [s].
    pub(crate) fn seconds(self) -> f64 {
        self.0
    }

    /// The ends of steps of a length [s] that lie between this time and a later one, without the ends at these two times.
    ///
    /// # Errors
    /// More than `most` steps, or steps that are too short so far from the start.
    pub(crate) fn ends_of_steps(self, to: Self, step: f64, most: f64) -> Result<impl Iterator<Item = f64>, TimeError> {
        let [from, to] = [self.0, to.0];
        let too_many = |steps, most| Err(TimeError::Steps { from, to, step, steps, most });
        let steps = (to - from) / step;
        if steps > most {
            return too_many(steps, most);
        }
        let farthest = from.abs().max(to.abs()) / step;
        if farthest > LARGEST_STEP {
            return too_many(farthest, LARGEST_STEP);
        }
        let first = (from / step + ROUNDING).floor() as i64 + 1;
        let last = (to / step).ceil() as i64;
        let ends = (first..=last).map(move |number| number as f64 * step);
        Ok(ends.skip_while(move |end| *end <= from).take_while(move |end| *end < to - ROUNDING * step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(from: f64, to: f64, step: f64) -> Result<Vec<f64>, TimeError> {
        let [from, to] = [from, to].map(|time| SceneTime::new(time).expect("a time"));
        from.ends_of_steps(to, step, 1e5).map(Iterator::collect)
    }

    #[test]
    fn a_number_beyond_reason_is_no_time() {
        for wrong in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1.000_001e11, -1.1e11, 1e17, f64::MAX] {
            assert!(SceneTime::new(wrong).is_err(), "{wrong}");
        }
        for right in [0.0, -0.0, 1e11, -1e11, f64::MIN_POSITIVE] {
            assert_eq!(SceneTime::new(right).expect("a time").seconds(), right);
        }
        assert_eq!(SceneTime::new(1e17).unwrap_err().to_string(), "1e17 s lies beyond the limit of 1e11 s");
    }

    #[test]
    fn ends_of_steps_lie_between_two_times() {
        assert_eq!(ends(0.0, 30.0, 10.0).expect("few"), [10.0, 20.0]);
        assert_eq!(ends(7.0, 30.5, 10.0).expect("few"), [10.0, 20.0, 30.0]);
        assert_eq!(ends(-25.0, 5.0, 10.0).expect("few"), [-20.0, -10.0, 0.0]);
        assert!(ends(10.0, 10.0, 10.0).expect("none").is_empty());
        assert!(ends(20.0, 10.0, 10.0).expect("none").is_empty());
        // The end of step 3 is 0.30000000000000004 s. A time that is rounded otherwise is the same time.
        assert_eq!(ends(0.1, 0.3, 0.1).expect("few"), [0.2]);
        assert_eq!(ends(3.0 * 0.1, 0.55, 0.1).expect("few"), [4.0 * 0.1, 0.5]);
    }

    /// Far from the start a quotient is rounded by more than the slack. A count never stands still.
    #[test]
    fn steps_far_from_the_start_end() {
        for (from, step) in [(9.9e10, 0.1), (9.9e10, 0.3), (-9.9e10, 0.7), (1.7e9, 1e-3), (9.99e10, 0.01)] {
            let list = ends(from, from + 1000.5 * step, step).expect("few");
            assert!((list.len() as i64 - 1000).abs() <= 1, "{} ends from {from} s", list.len());
            assert!(list.is_sorted_by(|one, next| one < next) && list[0] > from);
        }
        assert!(ends(9.9e10, 9.9e10 + 1.0, 1e-3).is_err(), "an end would be known to a hundredth of a step");
        assert!(ends(0.0, 1e6, 1.0).is_err(), "a million steps are more than allowed");
    }
}
