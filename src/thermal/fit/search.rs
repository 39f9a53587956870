//! Searches for the best parameters of one kind of function in one domain.

use super::data::FitData;
use super::response::{Fit, FittedResponse, NOTHING};
use crate::thermal::function::{Function, FunctionError};
use crate::thermal::least_squares::{Minimum, minimise};
use crate::thermal::material::Domain;

const SEARCH_T_MAX: usize = 60;
const STARTS: usize = 4;
/// Distance from a bound, as a share of the range, within which a number counts as being at it.
const AT_BOUND: f64 = 1e-6;
/// Least slope of a polynomial at its ends, so that rounded coefficients do not make it decrease.
const STEEPNESS: f64 = 1e-5;
/// Rate of an exponential whose end is not in the data: ln 1000, with which 0.1 % of the way is left at t_max.
pub(super) const RATE_WITHOUT_END: f64 = 6.907_755_278_982_137;

/// The kinds of functions with few parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FitKind {
    Linear,
    Quadratic,
    Exponential,
    Logarithmic,
    /// A polynomial of degree 3 that never decreases.
    Polynomial,
}

impl FitKind {
    /// Name in scene files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Quadratic => "quadratic",
            Self::Exponential => "exponential",
            Self::Logarithmic => "logarithmic",
            Self::Polynomial => "polynomial",
        }
    }
}

/// All kinds, those with the fewest parameters first.
pub(super) const KINDS: [FitKind; 5] =
    [FitKind::Linear, FitKind::Quadratic, FitKind::Exponential, FitKind::Logarithmic, FitKind::Polynomial];

/// A function during the search: [`Function`] without its checks, which would cost too much at every point.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum FitFunction {
    Linear,
    Quadratic,
    Exponential(f64),
    Logarithmic(f64),
    /// Coefficients of s, s^2 and s^3, whose sum is 1.
    Polynomial([f64; 3]),
}

impl FitFunction {
    /// f(s) for s in [0, 1].
    pub(crate) fn done(&self, s: f64) -> f64 {
        match self {
            Self::Linear => s,
            Self::Quadratic => s * (2.0 - s),
            Self::Exponential(k) => (-k * s).exp_m1() / (-k).exp_m1(),
            Self::Logarithmic(k) => (k * s).ln_1p() / k.ln_1p(),
            Self::Polynomial([a, b, c]) => s * (a + s * (b + s * c)),
        }
    }

    /// The checked function.
    ///
    /// # Errors
    /// Parameters that the function's own checks refuse.
    pub(crate) fn function(&self) -> Result<Function, FunctionError> {
        match self {
            Self::Linear => Ok(Function::Linear),
            Self::Quadratic => Ok(Function::Quadratic),
            Self::Exponential(rate) => Function::exponential(*rate),
            Self::Logarithmic(rate) => Function::logarithmic(*rate),
            Self::Polynomial([a, b, c]) => Function::polynomial(&[0.0, *a, *b, *c]),
        }
    }
}

/// One kind in one domain. Variables: ln t_max, the way to the target over the range of the data, then the function's parameters.
pub(super) struct FitProblem<'a> {
    pub(crate) data: &'a FitData,
    pub(crate) kind: FitKind,
    pub(crate) domain: Domain,
}

impl FitProblem<'_> {
    /// The best fit of the kind.
    ///
    /// # Errors
    /// A function that its own checks refuse.
    pub(crate) fn solve(&self) -> Result<Fit, FunctionError> {
        let data = self.data;
        let rows = data.thinned();
        let mut starts: Vec<Minimum> = Vec::new();
        let mut warm = self.first_guess();
        for ln_t_max in self.search_range() {
            let held = self.bounds(Some(ln_t_max));
            let minima =
                [self.first_guess(), warm].map(|start| minimise(&|x| self.residuals(&rows, x), &start, &held, 6));
            let [a, b] = minima;
            let better = if b.sum_of_squares < a.sum_of_squares { b } else { a };
            warm = better.x.clone();
            starts.push(better);
        }
        starts.sort_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
        starts.truncate(STARTS);
        let all = |x: &[f64]| self.residuals(&data.rows, x);
        let finished = starts.iter().map(|start| minimise(&all, &start.x, &self.bounds(None), 100));
        let mut best = finished
            .min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))
            .unwrap_or(Minimum { x: self.first_guess(), sum_of_squares: f64::INFINITY });

        if best.x[0] > data.last_time().ln() && data.target.is_none() {
            // The end is not in the data. Where other ends fit equally well, the most conservative one is used.
            let t_max = match self.shape(&best.x) {
                FitFunction::Exponential(rate) => (best.x[0].exp() / rate * RATE_WITHOUT_END).max(data.last_time()),
                _ => data.last_time(),
            };
            let mut start = best.x.clone();
            start[0] = t_max.ln();
            let held = self.bounds(Some(t_max.ln()));
            let other = [start, self.first_guess()]
                .map(|start| minimise(&all, &start, &held, 100))
                .into_iter()
                .min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
            let nothing = (NOTHING * data.range).powi(2) * data.rows.len() as f64;
            if let Some(other) = other.filter(|o| o.sum_of_squares <= best.sum_of_squares * (1.0 + 1e-4) + nothing) {
                best = other;
            }
        }
        self.finish(&best)
    }

    fn finish(&self, best: &Minimum) -> Result<Fit, FunctionError> {
        let response = FittedResponse {
            function: self.shape(&best.x).function()?,
            domain: self.domain,
            t_max: best.x[0].exp(),
            initial: self.data.initial,
            target: self.target(&best.x),
        };
        let given = usize::from(self.data.target.is_some());
        Ok(Fit::new(response, best.x.len() - given, self.data, &self.data.rows, self.at_bounds(&best.x)))
    }

    /// The numbers that lie at a bound, except where that is the form of a function: a polynomial without slope at an end, or a target of 0 K.
    fn at_bounds(&self, x: &[f64]) -> Vec<&'static str> {
        let bounds = self.bounds(None);
        let at = |i: usize, side: usize| {
            let [low, high] = bounds[i];
            low < high && (x[i] - bounds[i][side]).abs() <= AT_BOUND * (high - low)
        };
        let has_rate = matches!(self.kind, FitKind::Exponential | FitKind::Logarithmic);
        let mut bounded = Vec::new();
        if at(0, 0) || at(0, 1) {
            bounded.push("t_max is");
        }
        if at(1, 0) || at(1, 1) && self.target(x) > 0.0 {
            bounded.push("the target is");
        }
        if has_rate && (at(2, 0) || at(2, 1)) {
            bounded.push("the rate is");
        }
        bounded
    }

    fn residuals(&self, rows: &[[f64; 2]], x: &[f64]) -> Vec<f64> {
        let (shape, t_max) = (self.shape(x), x[0].exp());
        let (initial, target) = (self.domain.of(self.data.initial), self.domain.of(self.target(x)));
        let temperature = |s: f64| {
            let done = shape.done(s.min(1.0));
            self.domain.temperature(initial * (1.0 - done) + target * done)
        };
        rows.iter().map(|[time, t]| temperature(time / t_max) - t).collect()
    }

    fn target(&self, x: &[f64]) -> f64 {
        self.data.target.unwrap_or_else(|| (self.data.initial + self.data.span * x[1]).max(0.0))
    }

    fn shape(&self, x: &[f64]) -> FitFunction {
        match self.kind {
            FitKind::Linear => FitFunction::Linear,
            FitKind::Quadratic => FitFunction::Quadratic,
            FitKind::Exponential => FitFunction::Exponential(x[2].exp()),
            FitKind::Logarithmic => FitFunction::Logarithmic(x[2].exp()),
            FitKind::Polynomial => {
                // Bernstein coefficients 0 <= b1 <= b2 <= 1 make a cubic that never decreases, because the coefficients of its derivative are their
                // differences.
                let b1 = x[2];
                let b2 = b1 + (1.0 - b1) * x[3];
                let (c1, c2) = (3.0 * b1, 3.0 * (b2 - 2.0 * b1));
                FitFunction::Polynomial([c1, c2, 1.0 - c1 - c2])
            }
        }
    }

    fn first_guess(&self) -> Vec<f64> {
        let mut x = vec![self.data.last_time().ln(), 1.0];
        match self.kind {
            FitKind::Linear | FitKind::Quadratic => {}
            FitKind::Exponential | FitKind::Logarithmic => x.push(2f64.ln()),
            FitKind::Polynomial => x.extend([0.5, 0.5]),
        }
        x
    }

    /// Bounds of the variables. A given t_max is held.
    fn bounds(&self, ln_t_max: Option<f64>) -> Vec<[f64; 2]> {
        let search = self.search_range();
        let t_max = ln_t_max.map_or([search[0], search[search.len() - 1]], |held| [held, held]);
        let way = if self.data.target.is_some() {
            [1.0, 1.0]
        } else if self.data.span < 0.0 {
            // Temperatures stay at or above 0 K.
            [0.2, (self.data.initial / self.data.range).clamp(0.2, 20.0)]
        } else {
            [0.2, 20.0]
        };
        let mut bounds = vec![t_max, way];
        match self.kind {
            FitKind::Linear | FitKind::Quadratic => {}
            FitKind::Exponential => bounds.push([0.01f64.ln(), 20f64.ln()]),
            FitKind::Logarithmic => bounds.push([0.01f64.ln(), 1e4f64.ln()]),
            FitKind::Polynomial => bounds.extend([[STEEPNESS, 1.0 - STEEPNESS]; 2]),
        }
        bounds
    }

    /// Range of ln t_max, from the first interval to far beyond the data. A given target extends it.
    fn search_range(&self) -> Vec<f64> {
        let beyond: f64 = if self.data.target.is_some() { 1000.0 } else { 10.0 };
        let (low, high) = (self.data.rows[0][0].ln(), (self.data.last_time() * beyond).ln());
        (0..SEARCH_T_MAX).map(|i| low + (high - low) * i as f64 / (SEARCH_T_MAX - 1) as f64).collect()
    }
}
