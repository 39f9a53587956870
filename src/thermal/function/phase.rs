//! Where a transition goes on when its target moves: the phase of its curve that has the superposed relative rate.
//!
//! A transition under way has the gap g = D w(s) to its target and closes it at the rate D f'(s), with w = 1 - f; its
//! relative rate is h(s) = f'(s) / w(s) (times in units of `t_max`). A change d of the target superposes a new step
//! with the gap d and the rate d f'(0), so that together u = g + d and v = D f'(s) + d f'(0). The merge goes on from
//! the phase s* of the same curve with h(s*) = v/u, and with the span u / w(s*): T and its rate are both continuous.
//! Since f'(0) = h(0), the wanted relative rate is, with delta = d/u,
//!
//! > h(s*) = h(s) + delta (h(0) - h(s)),
//!
//! which has no cancellation: a change of one ulp moves it by one ulp. For w = r^p, h = p/r, and r* = u/q of
//! NUMERICS.md 1. For the exponential, h = k / (1 - e^-kr), and r* follows in closed form too.
//!
//! *Existence.* Where g and d have the same sign, 0 < delta < 1 and the wanted rate lies between h(0) and h(s): a root
//! exists. Where d is against g but does not reverse the gap, delta < 0; the wanted rate is above h(s) where h(0) <
//! h(s), and has a root because h grows without bound towards the end (w reaches 0). Where h has fallen, h(s) < h(0)
//! (a logarithm with k > e - 1 near its start), the wanted rate is below h(s), may be less than h ever is, and may even
//! be negative: there is no such phase. Then s is kept and the span rescaled: T is continuous and its rate the nearest
//! that keeps the curve. Where the gap is reversed, or none was left, the transition is a fresh one.
//!
//! *Choice.* Where h turns there may be several roots. By a step, |delta| above [`STEP`], the nearest of all is taken,
//! if one lies on the stretch around s on which h is monotone.
//!
//! *Small changes.* Near an extremum of h the root moves as the square root of a change: a change and its reverse do not
//! cancel, one of the two may have no root, and what a target that moves all the time comes to depends on how its
//! changes are divided and on rounding (a saw on a table of 7 points: 5e-2 K; a jitter of one ulp of f32 holds the phase of a
//! logarithm of k = 9 at its extremum for good). Where h turns, changes up to [`STEP`] are therefore followed along a
//! pace (`pace.rs`) that is the root's but next to the extrema, where it is limited: T is continuous, the rate is off by
//! less than what the change itself adds to it.

use super::cubics::MAX_TURNS;
use super::{Kind, Point};

/// Change from which a root on another stretch may be nearer. No whole fraction: an even ramp makes changes of 1/n.
pub const STEP: f64 = 0.13;
/// Intervals at whose borders the relative rate is looked at for extrema.
const SAMPLES: usize = 4096;
/// Change of h / (1 + h) that is no change.
const FLAT: f64 = 1e-12;

/// A gap and what it is the sum of: what the transition under way had left, and the change of the target.
#[derive(Debug, Clone, Copy)]
pub struct Superposition {
    /// delta: the change, over the gap that it leads to.
    pub change: f64,
    /// 1 - delta: what was left, over the same.
    pub left: f64,
}

impl Superposition {
    /// The sum of what was left and of a change, both in K or in units of the domain.
    pub fn new(left: f64, change: f64) -> Self {
        let gap = left + change;
        Self { change: change / gap, left: left / gap }
    }
}

/// r* for w = r^p, any p: `u/q` of NUMERICS.md 1.
pub(super) fn merged_power(r: f64, sum: Superposition) -> f64 {
    (r / (sum.left + sum.change * r)).min(1.0)
}

/// r* for the exponential of rate k: with E = e^-ks - 1,
/// r* = r - ln(1 + delta E (1 - e^-kr) / (1 - e^-k + delta e^-kr E)) / k.
pub(super) fn merged_exponential(rate: f64, r: f64, sum: Superposition) -> f64 {
    let gone = (-rate * (1.0 - r)).exp_m1();
    let rest = -(-rate * r).exp_m1();
    let whole = -(-rate).exp_m1();
    let divisor = whole + sum.change * (-rate * r).exp() * gone;
    // Where little of the old gap is in the new one, the argument of the logarithm is near 0: a sum of positive terms.
    let shift = if sum.change < 0.5 {
        (sum.change * gone * rest / divisor).ln_1p()
    } else {
        (((1.0 + gone) * rest - sum.left * gone) / divisor).ln()
    };
    let merged = r - shift / rate;
    if merged.is_finite() { merged.clamp(f64::MIN_POSITIVE, 1.0) } else { r }
}

/// r* for any function: the nearest root of h(r*) = h(r) + delta (h(1) - h(r)), or r where there is none.
pub(super) fn merged(kind: &Kind, turns: &[f64], r: f64, sum: Superposition) -> f64 {
    let (here, start) = (kind.at(r), kind.at(1.0));
    let (h, h_start) = (here.relative_rate(), start.relative_rate());
    let change = sum.change * (h_start - h);
    let wanted = sum.left * h + sum.change * h_start;
    if change == 0.0 || !wanted.is_finite() || wanted < 0.0 {
        return r;
    }
    let residual = |at: Point| {
        // h - wanted, scaled to [-1, 1]; 1/(1 + wanted) where nothing is left and h is infinite.
        let scale = at.rate + at.left;
        if scale > 0.0 { (at.rate - wanted * at.left) / (scale * (1.0 + wanted)) } else { 1.0 / (1.0 + wanted) }
    };
    let end = |x: f64| if x == 0.0 { 1.0 / (1.0 + wanted) } else { residual(kind.at(x)) };

    let number = turns.partition_point(|turn| *turn < r);
    let border = |i: usize| if i == 0 { 0.0 } else { turns.get(i - 1).copied().unwrap_or(1.0) };
    let at_r = if here.left > 0.0 { -change / ((1.0 + h) * (1.0 + wanted)) } else { 1.0 / (1.0 + wanted) };
    let on_own = [border(number), border(number + 1)]
        .into_iter()
        .filter_map(|other| root(&|x| residual(kind.at(x)), (r, at_r), (other, end(other))))
        .min_by(|a, b| (a - r).abs().total_cmp(&(b - r).abs()));
    // Of the same direction as the gap, a change leads towards the start; what is wanted may be past it by rounding.
    let to_start = sum.change > 0.5 && number == turns.len() && end(1.0).abs() < 1e-12;
    let Some(own) = on_own.or(to_start.then_some(1.0)) else { return r };
    let mut best = own;
    let is_step = sum.change.abs() > STEP;
    for stretch in (0..=turns.len()).filter(|stretch| is_step && *stretch != number) {
        let (low, high) = (border(stretch), border(stretch + 1));
        let nearest_point = if low > r { low } else { high };
        if (nearest_point - r).abs() < (best - r).abs()
            && let Some(found) = root(&|x| residual(kind.at(x)), (low, end(low)), (high, end(high)))
            && (found - r).abs() < (best - r).abs()
        {
            best = found;
        }
    }
    best.clamp(f64::MIN_POSITIVE, 1.0)
}

/// Root between two points of which the values are known: false position that halves the weight of a stuck end
/// (Illinois), with bisection where it lags. `None` where the values have the same sign.
fn root(f: &impl Fn(f64) -> f64, (a, at_a): (f64, f64), (b, at_b): (f64, f64)) -> Option<f64> {
    if at_a == 0.0 {
        return Some(a);
    }
    if at_b == 0.0 {
        return Some(b);
    }
    if at_a.signum() == at_b.signum() {
        return None;
    }
    let (mut low, mut at_low, mut high, mut at_high) = (a, at_a, b, at_b);
    for step in 0..200 {
        let width = (high - low).abs();
        let mut x = low - at_low * (high - low) / (at_high - at_low);
        if step % 4 == 3 || !x.is_finite() {
            x = 0.5 * (low + high);
        }
        if width <= f64::EPSILON * low.abs().max(high.abs()) || x == low || x == high {
            break;
        }
        let at_x = f(x);
        if at_x == 0.0 {
            return Some(x);
        }
        if at_x.signum() == at_high.signum() {
            (high, at_high) = (x, at_x);
            at_low *= 0.5;
        } else {
            (low, at_low) = (high, at_high);
            (high, at_high) = (x, at_x);
        }
    }
    Some(if at_low.abs() < at_high.abs() { low } else { high })
}

/// Shares of the time left, rising, at which the relative rate has an extremum.
pub(super) fn turns(kind: &Kind) -> Vec<f64> {
    if let Kind::Exponential { .. } = kind {
        return Vec::new();
    }
    // h = k / (y (L - ln y)) with y = 1 + ks, L = ln(1 + k), is least where ln y = L - 1.
    if let Kind::Logarithmic { rate } = *kind {
        let s = ((1.0 + rate) / std::f64::consts::E - 1.0) / rate;
        return if s > 0.0 { vec![1.0 - s] } else { Vec::new() };
    }
    let z = |r: f64| {
        let Point { left, rate } = kind.at(r);
        if left + rate > 0.0 { rate / (left + rate) } else { 1.0 }
    };
    let mut places: Vec<f64> = (0..=SAMPLES).map(|i| i as f64 / SAMPLES as f64).collect();
    if let Kind::Table(measured) = kind {
        for pair in measured.knots().windows(2) {
            places.extend((0..8).map(|i| pair[0] + (pair[1] - pair[0]) * f64::from(i) / 8.0));
        }
        places.sort_by(f64::total_cmp);
        places.dedup();
    }
    let values: Vec<f64> = places.iter().map(|r| z(*r)).collect();
    let mut turns = Vec::new();
    // The last step that was no rounding: its sign, and the place where it ended.
    let mut before: Option<(f64, usize)> = None;
    for i in 1..places.len() {
        let step = values[i] - values[i - 1];
        if step.abs() <= FLAT {
            continue;
        }
        if let Some((sign, at)) = before
            && sign != step.signum()
        {
            turns.push(extremum(&z, sign, places[at.saturating_sub(1)], places[i]));
        }
        before = Some((step.signum(), i));
    }
    while turns.len() > MAX_TURNS {
        forget_least(&z, &mut turns);
    }
    turns
}

/// Takes away the two neighbouring extrema that differ least: a ripple, which the measurement's noise may have made.
fn forget_least(z: &impl Fn(f64) -> f64, turns: &mut Vec<f64>) {
    let heights: Vec<f64> = turns.iter().map(|r| z(*r)).collect();
    let steps = heights.windows(2).map(|pair| (pair[1] - pair[0]).abs()).enumerate();
    if let Some((least, _)) = steps.min_by(|a, b| a.1.total_cmp(&b.1)) {
        turns.drain(least..least + 2);
    }
}

/// The place of the largest (`sign` 1) or smallest value of `z` in an interval, by golden section.
fn extremum(z: &impl Fn(f64) -> f64, sign: f64, mut low: f64, mut high: f64) -> f64 {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    while high - low > 1e-10 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if sign * z(a) > sign * z(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}
