//! Which function and t_max follow a measured step response best.
//!
//! A step response starts at rest, at the temperature of its first row, and moves to one target. For every kind of
//! function, in T and in T^4, t_max, the function's own numbers and (where it is not given) the target are found by
//! least squares on the temperatures; then the kinds are ordered by Schwarz's criterion, n ln(mean square) + p ln n with
//! p free numbers (Schwarz, "Estimating the dimension of a model", 1978): a function with more numbers must earn them.

use crate::thermal::least_squares::{Minimum, minimise};

mod data;
#[cfg(test)]
mod tests;

use data::Data;
pub use data::{FEWEST_ROWS, FitError, Sample};

/// Values of t_max that the search tries.
const SEARCH_T_MAX: usize = 60;
/// Starts that the search hands to the fit.
const STARTS: usize = 4;
/// Residuals below this share of the data's range tell nothing.
const NOTHING: f64 = 1e-6;
/// How far a polynomial stays from standing still at an end: rounded coefficients must not make it turn back.
const STEEPNESS: f64 = 1e-5;
/// Rate of an exponential whose end does not show in the data: 0.1 % of the way is left at t_max, ln 1000.
const RATE_WITHOUT_END: f64 = 6.907_755_278_982_137;

/// The kinds of functions with numbers of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// f(s) = s.
    Linear,
    /// f(s) = 1 - (1 - s)^2.
    Quadratic,
    /// f(s) = (1 - e^-ks) / (1 - e^-k).
    Exponential,
    /// f(s) = ln(1 + ks) / ln(1 + k).
    Logarithmic,
    /// A polynomial of degree 3 that never turns back.
    Polynomial,
}

/// All kinds, the one with the fewest numbers first.
pub const KINDS: [Kind; 5] = [Kind::Linear, Kind::Quadratic, Kind::Exponential, Kind::Logarithmic, Kind::Polynomial];

/// What the function is applied to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// The temperature.
    T,
    /// Its fourth power.
    T4,
}

/// A function with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// [`Kind::Linear`].
    Linear,
    /// [`Kind::Quadratic`].
    Quadratic,
    /// [`Kind::Exponential`] with its rate.
    Exponential(f64),
    /// [`Kind::Logarithmic`] with its rate.
    Logarithmic(f64),
    /// [`Kind::Polynomial`] by its coefficients of s, s^2 and s^3, whose sum is 1.
    Polynomial([f64; 3]),
}

/// The best that a kind can do.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Which function.
    pub shape: Shape,
    /// What it is applied to.
    pub domain: Domain,
    /// Time to the target, in the unit of the data.
    pub t_max: f64,
    /// Initial temperature [K]: that of the first row.
    pub initial: f64,
    /// Target [K], given or found.
    pub target: f64,
    /// Free numbers.
    pub parameters: usize,
    /// Root mean square of the differences from the data [K].
    pub rms: f64,
    /// Largest difference [K].
    pub max: f64,
    /// Whether the response ends after the last row, so that t_max is an extrapolation.
    pub ends_after_data: bool,
}

impl Shape {
    /// The share of the way done at the share `s` of the time, in [0, 1]; the end is held.
    pub fn done(&self, s: f64) -> f64 {
        let s = s.clamp(0.0, 1.0);
        match self {
            Self::Linear => s,
            Self::Quadratic => s * (2.0 - s),
            Self::Exponential(k) => (-k * s).exp_m1() / (-k).exp_m1(),
            Self::Logarithmic(k) => (k * s).ln_1p() / k.ln_1p(),
            Self::Polynomial([a, b, c]) => s * (a + s * (b + s * c)),
        }
    }
}

impl Domain {
    fn power(self) -> i32 {
        match self {
            Self::T => 1,
            Self::T4 => 4,
        }
    }
}

impl Fit {
    /// Temperature [K] at a time after the first row.
    pub fn temperature(&self, time: f64) -> f64 {
        response(&self.shape, self.domain, [self.initial, self.target], time / self.t_max)
    }
}

fn response(shape: &Shape, domain: Domain, [initial, target]: [f64; 2], s: f64) -> f64 {
    let power = domain.power();
    let done = shape.done(s);
    let mixed = initial.powi(power) * (1.0 - done) + target.powi(power) * done;
    if domain == Domain::T { mixed } else { mixed.sqrt().sqrt() }
}

/// Fits every kind in both domains; the best comes first.
///
/// # Errors
/// Data that are no step response, or a target [K] that cannot be theirs.
pub fn fit(samples: &[Sample], target: Option<f64>) -> Result<Vec<Fit>, FitError> {
    let data = Data::new(samples, target)?;
    let mut fits: Vec<Fit> = Vec::new();
    for kind in KINDS {
        for domain in [Domain::T, Domain::T4] {
            fits.push(Problem { data: &data, kind, domain }.solve());
        }
    }
    let n = data.rows.len() as f64;
    let floor = NOTHING * data.range;
    let criterion = |fit: &Fit| n * (fit.rms * fit.rms + floor * floor).ln() + fit.parameters as f64 * n.ln();
    fits.sort_by(|a, b| criterion(a).total_cmp(&criterion(b)));
    Ok(fits)
}

/// One kind in one domain. Variables: ln t_max, the way to the target over the data's span, then the function's own.
struct Problem<'a> {
    data: &'a Data,
    kind: Kind,
    domain: Domain,
}

impl Problem<'_> {
    fn solve(&self) -> Fit {
        let data = self.data;
        let rows = data.thinned();
        let mut starts: Vec<Minimum> = Vec::new();
        let mut warm = self.first_guess();
        for ln_t_max in self.search_range() {
            let held = self.bounds(Some(ln_t_max));
            let found =
                [self.first_guess(), warm].map(|start| minimise(&|x| self.residuals(&rows, x), &start, &held, 6));
            let [a, b] = found;
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
            // The end is not in the data: where other ends do as well, the one that says least is taken.
            let t_max = match self.shape(&best.x) {
                Shape::Exponential(rate) => (best.x[0].exp() / rate * RATE_WITHOUT_END).max(data.last_time()),
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
        self.fit(&best)
    }

    fn fit(&self, best: &Minimum) -> Fit {
        let residuals = self.residuals(&self.data.rows, &best.x);
        let mean = residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64;
        let given = usize::from(self.data.target.is_some());
        let t_max = best.x[0].exp();
        Fit {
            shape: self.shape(&best.x),
            domain: self.domain,
            t_max,
            initial: self.data.initial,
            target: self.target(&best.x),
            parameters: best.x.len() - given,
            rms: mean.sqrt(),
            max: residuals.iter().fold(0.0, |max, r| max.max(r.abs())),
            ends_after_data: t_max > self.data.last_time() * (1.0 + 1e-9),
        }
    }

    fn residuals(&self, rows: &[[f64; 2]], x: &[f64]) -> Vec<f64> {
        let (shape, t_max) = (self.shape(x), x[0].exp());
        let ends = [self.data.initial, self.target(x)];
        rows.iter().map(|[time, t]| response(&shape, self.domain, ends, time / t_max) - t).collect()
    }

    fn target(&self, x: &[f64]) -> f64 {
        self.data.target.unwrap_or_else(|| (self.data.initial + self.data.span * x[1]).max(0.0))
    }

    fn shape(&self, x: &[f64]) -> Shape {
        match self.kind {
            Kind::Linear => Shape::Linear,
            Kind::Quadratic => Shape::Quadratic,
            Kind::Exponential => Shape::Exponential(x[2].exp()),
            Kind::Logarithmic => Shape::Logarithmic(x[2].exp()),
            Kind::Polynomial => {
                // Bernstein coefficients 0 <= b1 <= b2 <= 1 make a cubic that never turns back (its derivative's
                // coefficients are their differences).
                let b1 = x[2];
                let b2 = b1 + (1.0 - b1) * x[3];
                let (c1, c2) = (3.0 * b1, 3.0 * (b2 - 2.0 * b1));
                Shape::Polynomial([c1, c2, 1.0 - c1 - c2])
            }
        }
    }

    fn first_guess(&self) -> Vec<f64> {
        let mut x = vec![self.data.last_time().ln(), 1.0];
        match self.kind {
            Kind::Linear | Kind::Quadratic => {}
            Kind::Exponential | Kind::Logarithmic => x.push(2f64.ln()),
            Kind::Polynomial => x.extend([0.5, 0.5]),
        }
        x
    }

    /// Ends of the variables; t_max is held where it is given.
    fn bounds(&self, ln_t_max: Option<f64>) -> Vec<[f64; 2]> {
        let search = self.search_range();
        let t_max = ln_t_max.map_or([search[0], search[search.len() - 1]], |held| [held, held]);
        let way = if self.data.target.is_some() {
            [1.0, 1.0]
        } else if self.data.span < 0.0 {
            // Not below 0 K.
            [0.2, (self.data.initial / self.data.range).clamp(0.2, 20.0)]
        } else {
            [0.2, 20.0]
        };
        let mut bounds = vec![t_max, way];
        match self.kind {
            Kind::Linear | Kind::Quadratic => {}
            Kind::Exponential => bounds.push([0.01f64.ln(), 20f64.ln()]),
            Kind::Logarithmic => bounds.push([0.01f64.ln(), 1e4f64.ln()]),
            Kind::Polynomial => bounds.extend([[STEEPNESS, 1.0 - STEEPNESS]; 2]),
        }
        bounds
    }

    /// ln t_max from the first interval to far beyond the data: the farther where a given target says how far.
    fn search_range(&self) -> Vec<f64> {
        let beyond: f64 = if self.data.target.is_some() { 1000.0 } else { 10.0 };
        let (low, high) = (self.data.rows[0][0].ln(), (self.data.last_time() * beyond).ln());
        (0..SEARCH_T_MAX).map(|i| low + (high - low) * i as f64 / (SEARCH_T_MAX - 1) as f64).collect()
    }
}
