//! Conduction inside a large block, as a polynomial of its rates: the twin of `glsl/one_pass_stage.comp`.
//!
//! The change of a block in a step is P(X) (D - X T). X are the rates of its conductors times the step, D is the change of its nodes by the heat that
//! they receive, T their temperatures at the start, and P(x) = (1 - e^-x) / x. A Chebyshev series of P takes one stage for each power of X, and a
//! stage reads the neighbours of a node only (Trefethen, Approximation Theory and Approximation Practice, SIAM 2013, chapters 3 and 8).

use super::exponential::mean_exponential;

/// Sum of the coefficients that are left out. A change of 10 K is so exact to 0.3 mK.
const LEFT_OUT: f64 = 3e-5;
pub(crate) const STAGES_AT_MOST: usize = 256;

/// A stage: the vector is `rate` times X of the one before, plus `here` times the one before, plus `older` times the one before that. The sum of all vectors
/// times `part` is the change.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct SeriesStage {
    /// Factor of X of the vector before.
    pub(crate) rate: f64,
    /// Factor of the vector before.
    pub(crate) here: f64,
    /// Factor of the second vector before.
    pub(crate) older: f64,
    /// Share of the vector in the change.
    pub(crate) part: f64,
}

/// The Chebyshev series of P for 0 <= x <= `fastest`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ChebyshevSeries {
    fastest: f64,
    coefficients: Vec<f64>,
}

impl ChebyshevSeries {
    /// The shortest series for eigenvalues of X up to `fastest`.
    pub(crate) fn new(fastest: f64) -> Self {
        // Above this degree the coefficients are far below rounding.
        let count = 32 + (10.0 * fastest.sqrt()).ceil() as usize;
        let angle = |at: usize| std::f64::consts::PI * (at as f64 + 0.5) / count as f64;
        let values: Vec<f64> = (0..count).map(|at| mean_exponential(0.5 * fastest * (1.0 + angle(at).cos()))).collect();
        let coefficient = |degree: usize| {
            let sum: f64 = values.iter().enumerate().map(|(at, value)| value * (degree as f64 * angle(at)).cos()).sum();
            sum * if degree == 0 { 1.0 } else { 2.0 } / count as f64
        };
        let mut coefficients: Vec<f64> = (0..count).map(coefficient).collect();
        let mut left_out = 0.0;
        while coefficients.len() > 2 {
            left_out += coefficients[coefficients.len() - 1].abs();
            if left_out > LEFT_OUT {
                break;
            }
            coefficients.pop();
        }
        // A common source heats all nodes alike, so that heat is conserved: P(0) = 1.
        let at_0: f64 = coefficients.iter().enumerate().map(|(k, c)| if k % 2 == 0 { *c } else { -c }).sum();
        coefficients[0] += 1.0 - at_0;
        Self { fastest, coefficients }
    }

    /// Number of stages after the first vector, which is D - X T.
    pub(crate) fn stages(&self) -> usize {
        self.coefficients.len() - 1
    }

    /// Share of the first vector in the change.
    pub(crate) fn first(&self) -> f64 {
        self.coefficients[0]
    }

    /// A stage, counted from 1.
    pub(crate) fn stage(&self, number: usize) -> SeriesStage {
        let part = self.coefficients[number];
        match number {
            1 => SeriesStage { rate: 2.0 / self.fastest, here: -1.0, older: 0.0, part },
            _ => SeriesStage { rate: 4.0 / self.fastest, here: -2.0, older: -1.0, part },
        }
    }

    /// P(X) of a vector. `rates` gives X of a vector.
    pub(crate) fn apply(&self, vector: Vec<f64>, rates: impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
        let mut sum: Vec<f64> = vector.iter().map(|value| self.first() * value).collect();
        let (mut before, mut older) = (vector, vec![0.0; sum.len()]);
        for number in 1..=self.stages() {
            let stage = self.stage(number);
            let moved = rates(&before);
            for (node, older) in older.iter_mut().enumerate() {
                *older = stage.rate * moved[node] + stage.here * before[node] + stage.older * *older;
                sum[node] += stage.part * *older;
            }
            std::mem::swap(&mut before, &mut older);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_is_p_and_a_shorter_one_is_not() {
        for fastest in [1e-6, 0.1, 1.0, 7.0, 118.0, 3000.0] {
            let series = ChebyshevSeries::new(fastest);
            let error = |series: &ChebyshevSeries| {
                let at = |k: i32| fastest * f64::from(k) / 1000.0;
                let of = |x: f64| series.apply(vec![1.0], |v| vec![x * v[0]])[0] - mean_exponential(x);
                (0..=1000).map(|k| of(at(k)).abs()).fold(0.0, f64::max)
            };
            let computed = error(&series);
            println!("rates up to {fastest}: {} stages, {computed:.1e} off", series.stages());
            assert!(computed < 2.0 * LEFT_OUT, "{fastest}: {computed}");
            assert!((series.apply(vec![1.0], |_| vec![0.0])[0] - 1.0).abs() < 1e-12, "heat is conserved");
            if series.stages() > 4 {
                let mut shorter = series.clone();
                shorter.coefficients.truncate(3 * series.stages() / 4);
                assert!(error(&shorter) > 5.0 * LEFT_OUT, "{fastest}: three quarters of the stages do as well");
            }
        }
    }

    /// Stages grow with the root of the rates, as those of RKL do.
    #[test]
    fn stages_grow_with_the_root_of_the_rates() {
        let stages = |fastest| ChebyshevSeries::new(fastest).stages() as f64;
        let ratio = stages(4000.0) / stages(1000.0);
        assert!(ratio > 1.7 && ratio < 2.1, "{ratio}");
    }
}
