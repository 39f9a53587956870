//! How many steps of Newton's method find the phase of a merge on the device, found by trial when a function is made.
//!
//! The device takes a fixed number of steps, written out: on lavapipe a loop costs more than the steps. Where a function's
//! relative rate turns, or where no few steps do, it searches in a bracket instead.

use std::f64::consts::PI;

use super::{Kind, Point};

/// Most steps that are written out.
const MOST: u32 = 6;
/// Shares of time from which a phase may be sent; to four times as many.
const SAMPLES: u32 = 32;
/// Error of the rate after a merge, times the gap, that is good enough; in spans.
const GOOD: f64 = 1e-7;
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
            (0..=number).map(move |i| (0.5 - 0.5 * (f64::from(i) / f64::from(number) * PI).cos()).max(1e-3))
        };
        places(SAMPLES).all(|r| places(4 * SAMPLES).all(|wanted| self.arrives(kind, start, r, wanted)))
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
            let next = (x + step(x)).clamp(1e-3 * x, 1.0);
            (last, x) = (next - x, next);
        }
        let found = kind.at(x);
        let error =
            gap.min(1.0) * (found.relative_rate() - there.relative_rate()).abs() / (1.0 + there.relative_rate());
        last.abs() < LAST && (error < GOOD || (x - wanted).abs() < 1e-9)
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
    fn a_power_needs_one_step_and_an_s_curve_a_few() {
        assert_eq!(of(Function::polynomial(&[0.0, 2.0, -1.0])), Some(Newton { steps: 1, by_rate: true }));
        let curve = of(Function::expression("s*s*(3.0-2.0*s)")).map(|newton| newton.steps);
        assert!(curve.is_some_and(|steps| steps > 1), "{curve:?}");
        // A rate that starts infinitely steeply bent: no few steps do.
        assert_eq!(of(Function::expression("pow(s, 1.5)")), None);
    }
}
