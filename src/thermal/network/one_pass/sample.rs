//! Which steps of the one pass estimate its error. Two steps in a row do: the first notes the heat by weak conductors, the second sees its change.
//! The estimate covers all steps since the last one, because the estimated sums need their ends only.

/// Steps from one estimate to the next.
const EVERY: u32 = 16;
/// Steps after which the estimates are that far apart. The first one has nothing to compare with, and the second lets a run decide early.
const EARLY: u32 = 4;

/// Part of a step in the estimate of the error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub(crate) enum EstimatePart {
    /// None.
    #[default]
    None,
    /// The step notes the heat by weak conductors.
    Note,
    /// The step estimates the error.
    Estimate,
}

impl EstimatePart {
    /// The part of a step after `age` steps of the same length.
    pub(crate) fn of(age: u32) -> Self {
        match (age < EARLY || age % EVERY >= EVERY - 2, age % 2) {
            (false, _) => Self::None,
            (true, 0) => Self::Note,
            (true, _) => Self::Estimate,
        }
    }
}

/// Steps since the last estimate, at an estimate after `age` steps. 0 at the first one.
pub(crate) fn since(age: u32) -> u32 {
    match age {
        0..2 => 0,
        2..EARLY => 2,
        EARLY..EVERY => EVERY - EARLY,
        _ => EVERY,
    }
}

/// Number of estimates in `count` steps after `age` ones, without the first one.
pub(crate) fn estimates(age: u32, count: u32) -> u64 {
    let told = |age: &u32| EstimatePart::of(*age) == EstimatePart::Estimate && since(*age) > 0;
    (age..age.saturating_add(count)).filter(told).count() as u64
}

/// Share that radiation leaves of equal errors of `steps` steps, in the mean. Radiation lets a share of exp(-`fading`) pass in a step. Twin:
/// `left_in_the_mean` of `glsl/one_pass.comp`.
pub(crate) fn left_in_the_mean(fading: f64, steps: u32) -> f64 {
    let steps = f64::from(steps.max(1));
    if fading < 1e-3 {
        return 1.0 - 0.5 * (steps - 1.0) * fading;
    }
    (1.0 - (-steps * fading).exp()) / (steps * (1.0 - (-fading).exp()).max(1e-4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_cover_all_steps_once() {
        let mut last = None;
        for age in 0..100 {
            if EstimatePart::of(age) == EstimatePart::Estimate {
                assert_eq!(EstimatePart::of(age - 1), EstimatePart::Note);
                assert_eq!(since(age), last.map_or(0, |last| age - last), "{age}");
                last = Some(age);
            }
        }
        assert_eq!((last, estimates(0, 100), estimates(15, 16)), (Some(95), 7, 1));
    }

    #[test]
    fn the_mean_share_is_that_of_a_sum() {
        for fading in [0.0, 1e-4, 9.9e-4, 1.1e-3, 0.1, 3.0] {
            let sum: f64 = (0..16).map(|step| (-fading * f64::from(step)).exp()).sum();
            let computed = left_in_the_mean(fading, 16);
            assert!((computed - sum / 16.0).abs() < 1e-4 * computed, "{fading}: {computed}");
        }
    }
}
