//! How fast the phase moves as the gap grows, as a polynomial, where the relative rate grows throughout.
//!
//! A merge keeps u (h(s) - h(0)), with u the gap and h the relative rate (phase.rs): h(s*) - h(0) is h(s) - h(0) times
//! the old gap over the new. As the gap grows, the phase therefore moves by
//!
//! > d ln(s/r) / d ln u = g(s) = -(h - h(0)) / (h' s r),
//!
//! and where h rises throughout g is smooth and of order one, the zeros at both ends cancelling: it is -1 for a power,
//! all along. The device integrates it from one gap to the next, in pieces that are samples of these polynomials
//! (pace.rs). Found so, a small shift has the relative accuracy of g, where one from h itself loses that of h - h(0) and
//! of h': an exponential's h hardly changes, and what rounding leaves of the difference has the same sign tick after tick.

use std::f64::consts::PI;

use super::{Kind, Point};

/// Most terms of a polynomial.
const TERMS: usize = 16;
/// Relative error of g that is good enough.
const GOOD: f64 = 1e-7;
/// Size of the terms together, over that of the least g: what f32 loses.
const SIZE: f64 = 30.0;
/// Places between the nodes at which the polynomial is compared.
const CHECKS: u32 = 300;
/// Closest to an end that g is taken, where the text of a function leaves it digits; closer where it is one of a root.
const MARGIN: f64 = 4e-3;
const MARGIN_OF_ROOT: f64 = 1e-4;

/// The polynomials: one from end to end, or one from either end to the middle.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Flow {
    /// Of s.
    Whole(Piece),
    /// The first of s, the second of r.
    Halves(Piece, Piece),
}

/// A polynomial of x = scale v - offset, with v the distance to an end or its root.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Piece {
    /// Whether v is the root.
    of_root: bool,
    /// Of x.
    scale: f64,
    /// Of x.
    offset: f64,
    /// Coefficients of the powers of x.
    coefficients: Vec<f64>,
}

impl Flow {
    /// The polynomials of fewest terms that follow g; none where sixteen do not.
    pub(super) fn new(kind: &Kind) -> Option<Self> {
        let start = kind.at(1.0).rate;
        let of_gone = |s: f64| pace(kind, start, s, 1.0 - s);
        let of_left = |r: f64| pace(kind, start, 1.0 - r, r);
        if let Some(whole) = Piece::new(&of_gone, false, 1.0 - MARGIN) {
            return Some(Self::Whole(whole));
        }
        let half = |g: &dyn Fn(f64) -> f64| [false, true].into_iter().find_map(|root| Piece::new(g, root, 0.5));
        Some(Self::Halves(half(&of_gone)?, half(&of_left)?))
    }

    /// g at s.
    pub(super) fn at(&self, s: f64) -> f64 {
        match self {
            Self::Whole(piece) => piece.at(s),
            Self::Halves(start, end) => {
                if s < 0.5 {
                    start.at(s)
                } else {
                    end.at(1.0 - s)
                }
            }
        }
    }
}

impl Piece {
    /// Of g from an end to `far` from it.
    fn new(g: &dyn Fn(f64) -> f64, of_root: bool, far: f64) -> Option<Self> {
        let (low, high) = if of_root { (MARGIN_OF_ROOT.sqrt(), far.sqrt()) } else { (MARGIN, far) };
        let (scale, offset) = (2.0 / (high - low), (high + low) / (high - low));
        let distance = |x: f64| {
            let v = (x + offset) / scale;
            if of_root { v * v } else { v }
        };
        (1..=TERMS)
            .map(|terms| Self { of_root, scale, offset, coefficients: interpolated(&|x| g(distance(x)), terms) })
            .find(|piece| {
                let size: f64 = piece.coefficients.iter().map(|c| c.abs()).sum();
                (0..=CHECKS).all(|i| {
                    let distance = distance((PI * f64::from(i) / f64::from(CHECKS)).cos());
                    let exact = g(distance);
                    (piece.at(distance) - exact).abs() < GOOD * exact.abs() && size < SIZE * exact.abs()
                })
            })
    }

    fn at(&self, distance: f64) -> f64 {
        let x = self.scale * if self.of_root { distance.sqrt() } else { distance } - self.offset;
        self.coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
    }
}

/// g at s = 1 - r, within (0, 1).
fn pace(kind: &Kind, start: f64, s: f64, r: f64) -> f64 {
    // f'' from the rates at four neighbours, of fourth order.
    let step = (0.01 * s.min(r)).min(1e-3);
    let rate = |n: f64| kind.at(r + n * step).rate;
    let bend = (8.0 * (rate(-1.0) - rate(1.0)) - (rate(-2.0) - rate(2.0))) / (12.0 * step);
    let Point { left, rate } = kind.at(r);
    -(rate - left * start) * left / ((rate * rate + left * bend) * s * r)
}

/// Coefficients of the polynomial through Chebyshev's points of [-1, 1].
fn interpolated(f: &impl Fn(f64) -> f64, terms: usize) -> Vec<f64> {
    let angle = |i: usize| PI * (i as f64 + 0.5) / terms as f64;
    let values: Vec<f64> = (0..terms).map(|i| f(angle(i).cos())).collect();
    let mut powers = vec![0.0; terms];
    // T_j in powers of x, from T_j = 2 x T_(j-1) - T_(j-2).
    let (mut before, mut chebyshev) = (vec![0.0; terms], vec![0.0; terms]);
    chebyshev[0] = 1.0;
    for j in 0..terms {
        let sum: f64 = values.iter().enumerate().map(|(i, value)| value * (j as f64 * angle(i)).cos()).sum();
        let weight = sum * if j == 0 { 1.0 } else { 2.0 } / terms as f64;
        for (power, c) in powers.iter_mut().zip(&chebyshev) {
            *power += weight * c;
        }
        let twice = if j == 0 { 1.0 } else { 2.0 };
        let next = (0..terms).map(|i| if i > 0 { twice * chebyshev[i - 1] } else { 0.0 } - before[i]).collect();
        before = std::mem::replace(&mut chebyshev, next);
    }
    powers
}

#[cfg(test)]
mod tests {
    use super::super::{Function, FunctionError};
    use super::*;

    fn of(function: Result<Function, FunctionError>) -> Option<Flow> {
        let Ok(Function::Shaped(shape)) = function else { panic!("a shape") };
        Flow::new(&shape.kind)
    }

    #[test]
    fn a_power_moves_at_one_pace_whatever_it_is_written_as() {
        for text in ["1.0-(1.0-s)*(1.0-s)*(1.0-s)", "1.0-pow(1.0-s, 2.5)"] {
            let Some(Flow::Whole(piece)) = of(Function::expression(text)) else { panic!("{text}: no flow") };
            assert_eq!(piece.coefficients.len(), 1, "{text}");
            assert!((piece.coefficients[0] + 1.0).abs() < 1e-7, "{text}: {piece:?}");
        }
    }

    /// h - h(0) of the exponential is k e^-kr / (1 - e^-kr) less that at r = 1, so that with E = e^-kr
    /// g = -(E - e^-k) (1 - E) / ((1 - e^-k) k E s r).
    #[test]
    fn the_pace_of_an_exponential_is_that_of_its_formula() {
        let k = 3.0_f64;
        let flow = of(Function::exponential(k)).expect("a flow");
        for i in 1..50 {
            let s = f64::from(i) / 50.0;
            let e = (-k * (1.0 - s)).exp();
            let exact = -(e - (-k).exp()) * (1.0 - e) / ((1.0 - (-k).exp()) * k * e * s * (1.0 - s));
            let found = flow.at(s);
            assert!((found - exact).abs() < 2e-7, "s {s}: {found} for {exact}");
            assert!((found - 1.001 * exact).abs() > 2e-7);
        }
    }

    #[test]
    fn functions_that_begin_or_end_with_a_root_flow_as_well() {
        for text in ["pow(s, 1.5)", "tanh(2.0*s)/tanh(2.0)", "s*s*s*(s*(s*6.0-15.0)+10.0)"] {
            let flow = of(Function::expression(text)).unwrap_or_else(|| panic!("{text}: no flow"));
            assert!(flow.at(0.3) < 0.0);
        }
    }

    #[test]
    fn a_corner_has_no_flow() {
        assert_eq!(of(Function::expression("s < 0.5 ? 2.0*s*s : 1.0-2.0*(1.0-s)*(1.0-s)")), None);
    }
}
