//! Gauss-Legendre quadrature on an interval, optionally smoothed at the ends.

use std::f64::consts::PI;

/// A Gauss-Legendre rule on [0, 1].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GaussLegendre {
    nodes: Vec<(f64, f64)>,
}

impl GaussLegendre {
    /// The rule with `points` nodes, exact for polynomials of degree `2 * points - 1`.
    ///
    /// The nodes are the roots of the Legendre polynomial, found by Newton's method from the cosine estimate (Press et al., Numerical Recipes, section
    /// 4.6).
    pub(crate) fn new(points: usize) -> Self {
        let nodes = (0..points)
            .map(|index| {
                let mut x = (PI * (index as f64 + 0.75) / (points as f64 + 0.5)).cos();
                let mut slope = 1.0;
                for _ in 0..NEWTON_STEPS {
                    let value;
                    (value, slope) = legendre(points, x);
                    x -= value / slope;
                }
                (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
            })
            .collect();
        Self { nodes }
    }

    /// Nodes of [`start`, `end`] and their weights.
    pub(crate) fn on(&self, start: f64, end: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let length = end - start;
        self.nodes.iter().map(move |&(x, weight)| (start + length * x, length * weight))
    }

    /// The rule with its nodes dense at both ends, for integrands that vary there as the power 1/2 or 3/2 of the distance to the end. With x = t^2 (3 - 2t)
    /// such powers become t^2 sqrt(3 - 2t) or smoother in t.
    pub(crate) fn on_smoothed(&self, start: f64, end: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let length = end - start;
        self.nodes.iter().map(move |&(t, weight)| {
            let x = t * t * (3.0 - 2.0 * t);
            (start + length * x, length * weight * 6.0 * t * (1.0 - t))
        })
    }
}

/// Newton steps from the cosine estimate. Four reach the last bit for every order tried. Six leave a margin.
const NEWTON_STEPS: usize = 6;

/// Value and slope of the Legendre polynomial of this degree at -1 < x < 1.
fn legendre(degree: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut value) = (0.0, 1.0);
    for n in 0..degree {
        let n = n as f64;
        (previous, value) = (value, ((2.0 * n + 1.0) * x * value - n * previous) / (n + 1.0));
    }
    (value, degree as f64 * (x * value - previous) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_is_exact_up_to_twice_its_points_less_one() {
        for points in [2, 4, 10, 16, 40] {
            let rule = GaussLegendre::new(points);
            let degree = 2 * points as i32 - 1;
            let moment = |degree: i32| rule.on(0.0, 2.0).map(|(x, w)| w * (x / 2.0).powi(degree)).sum::<f64>();
            let exact = |degree: i32| 2.0 / f64::from(degree + 1);
            assert!((moment(degree) - exact(degree)).abs() < 1e-14, "{points} points");
            if points <= 4 {
                assert!((moment(degree + 1) - exact(degree + 1)).abs() > 1e-6, "{points} points, one degree more");
            }
        }
    }

    #[test]
    fn smoothing_tames_a_three_halves_power() {
        let rule = GaussLegendre::new(8);
        let integral = |nodes: &mut dyn Iterator<Item = (f64, f64)>| nodes.map(|(x, w)| w * x.powf(1.5)).sum::<f64>();
        let smoothed = (integral(&mut rule.on_smoothed(0.0, 1.0)) - 0.4).abs();
        let plain = (integral(&mut rule.on(0.0, 1.0)) - 0.4).abs();
        assert!(smoothed < 1e-9, "smoothed {smoothed:e}");
        assert!(plain > 1e-6, "plain {plain:e}");
    }
}
