//! How many steps of Newton's method find the phase of a merge on the device, found by trial when a function is made.
//!
//! The device takes a fixed number of steps, written out: on lavapipe a loop costs more than the steps. Where a function's
//! relative rate turns, or where no few steps do, it searches in a bracket instead.

use std::f64::consts::PI;

use super::{Kind, Point};

/// Most steps that are written out.
const MOST: u32 = 6;
/// Shares of time from which a phase may be sent; to eight times as many.
const SAMPLES: u32 = 48;
/// Error of the phase after a merge that is good enough. It is one of the phase, not of the rate: where a function starts
/// flat its rate says little of the phase, which lasts.
const GOOD: f64 = 2e-8;
/// Each step is at most this much of the one before: where the steps are regular everywhere on the grid, they are between
/// its points too.
const SHRINKS: f64 = 0.5;
/// A step that is as good as none.
const NO_STEP: f64 = 1e-9;
/// The last step, over which the device takes w for a parabola.
const LAST: f64 = 4e-3;
/// Interval over which rates are differenced.
const INTERVAL: f64 = 1e-5;

/// The steps that a function needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Newton {
    /// Steps beyond the first, each with an evaluation of its own.
    pub steps: u32,
    /// Whether w/f' is made to agree; else w/(w + f').
    pub by_rate: bool,
}

/// The fewest steps that do from everywhere to everywhere; `None` where none are enough.
pub(super) fn plan(kind: &Kind) -> Option<Newton> {
    (1..=MOST)
        .flat_map(|steps| [true, false].map(|by_rate| Newton { steps, by_rate }))
        .find(|newton| newton.is_enough(kind))
}

impl Newton {
    fn is_enough(self, kind: &Kind) -> bool {
        let start = kind.at(1.0);
        // Denser towards both ends, where the shapes of functions differ most.
        let places = |number: u32| {
            let even = (0..=number).map(move |i| 0.5 - 0.5 * (f64::from(i) / f64::from(number) * PI).cos());
            even.map(|r| r.max(1e-3)).chain([1e-6, 1e-5, 1e-4, 1.0 - 1e-4, 1.0 - 1e-5])
        };
        places(SAMPLES).all(|r| places(8 * SAMPLES).all(|wanted| self.arrives(kind, start, r, wanted)))
    }

    /// Whether the steps lead from r to the phase at which the relative rate is that of `wanted`.
    fn arrives(self, kind: &Kind, start: Point, r: f64, wanted: f64) -> bool {
        let (here, there) = (kind.at(r), kind.at(wanted));
        // d/u, by the derivation in phase.rs; a gap that would be reversed is no merge.
        let change = (there.relative_rate() - here.relative_rate()) / (start.relative_rate() - here.relative_rate());
        if !change.is_finite() || change >= 1.0 || here.left <= 0.0 {
            return true;
        }
        let gap = here.left / (1.0 - change);
        let rate = gap * there.relative_rate();
        let step = |r: f64| {
            let Point { left, rate: speed } = kind.at(r);
            let (low, high) = ((r - INTERVAL).max(0.0), (r + INTERVAL).min(1.0));
            let bend = (kind.at(high).rate - kind.at(low).rate) / (high - low);
            let (weight, sum) = if self.by_rate { (speed, rate) } else { (speed + left, rate + gap) };
            (speed * gap - left * rate) * weight / (sum * (speed * speed - left * bend)).max(1e-35)
        };
        let (mut x, mut last) = (r, f64::INFINITY);
        for _ in 0..=self.steps {
            let full = step(x).abs();
            if full > SHRINKS * last && full > NO_STEP {
                return false;
            }
            (last, x) = (full, (x + step(x)).clamp(1e-3 * x, 1.0));
        }
        last < LAST && (x - wanted).abs() < GOOD
    }
}

#[cfg(test)]
mod tests {
    use super::super::Function;
    use super::*;

    fn of(function: Result<Function, crate::thermal::function::FunctionError>) -> Option<Newton> {
        let Ok(Function::Shaped(shape)) = function else { panic!("a shape") };
        plan(&shape.kind)
    }

    #[test]
    fn a_power_needs_one_step_and_what_starts_flat_a_search() {
        assert_eq!(of(Function::polynomial(&[0.0, 2.0, -1.0])), Some(Newton { steps: 1, by_rate: true }));
        // One step finds the rate of an s-curve's start from afar, but not its phase.
        assert_eq!(of(Function::expression("s*s*s*(s*(s*6.0-15.0)+10.0)")), None);
        // A rate that starts infinitely steeply bent: no few steps do.
        assert_eq!(of(Function::expression("pow(s, 1.5)")), None);
    }
}
