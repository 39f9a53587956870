//! Levenberg-Marquardt in the logarithms of the factors, with priors, bounds and a loss for glitches.
//!
//! Minimises sum loss(r^2) + sum ((x - c) / s)^2 with r = (computed - measured) / sigma (Levenberg 1944, Marquardt 1963; the loss enters by its weights). Derivatives are central differences of
//! whole runs. A step that gains as much as its derivatives promised corrects them along itself (Broyden 1965) in place of new runs. The last derivatives are differences again.

use nalgebra::{DMatrix, DVector};

use super::FittingError;
use super::measurements::Measurements;
use super::prior::Unknown;
use crate::scene::Loss;

/// Most steps.
const MOST_STEPS: usize = 30;
/// The search ends at a step that lowers the sum by less than this, in squared standard deviations: 0.0015 of one.
const GAIN: f64 = 2e-6;
/// Share of the promised gain from which derivatives are corrected in place of found anew.
const GOOD: f64 = 0.7;
/// Longest step of a logarithm, so that no far extrapolation is tried.
const LONGEST: f64 = 1.0;

/// The sum that is minimised.
pub(super) struct Objective<'a> {
    pub(super) measurements: &'a Measurements,
    pub(super) unknowns: &'a [Unknown],
    pub(super) loss: Loss,
    pub(super) loss_scale: f64,
}

/// The best logarithms of the factors, and all that was found there.
#[derive(Debug, Clone)]
pub(super) struct BestFit {
    pub(super) x: Vec<f64>,
    /// Computed temperatures of all measured values [K], held out or not.
    pub(super) computed: Vec<f64>,
    /// Derivatives of the computed temperatures of the fitted values over their standard deviations, one row for each, and the weight of each row.
    pub(super) jacobian: DMatrix<f64>,
    pub(super) weights: Vec<f64>,
    pub(super) sum: f64,
    pub(super) steps: usize,
    /// Whether the user ended the search.
    pub(super) stopped: bool,
    /// Whether the search came to its end in the allowed number of steps.
    pub(super) converged: bool,
}

/// Computes the temperatures of all measured values [K] for logarithms of factors.
pub(super) type Compute<'a> = dyn FnMut(&[f64]) -> Result<Vec<f64>, FittingError> + 'a;

impl Objective<'_> {
    /// Finds the minimum near 0, whose computed temperatures are `start`. `begun` is told the number of the step and the sum before it; it may refuse the first derivatives.
    ///
    /// # Errors
    /// A run that fails, the refusal of `begun`, or the end by the user before the first derivatives were found.
    pub(super) fn minimise(
        &self,
        start: Vec<f64>,
        compute: &mut Compute<'_>,
        begun: &mut dyn FnMut(&BestFit) -> Result<(), FittingError>,
    ) -> Result<BestFit, FittingError> {
        let x = vec![0.0; self.unknowns.len()];
        let mut best = BestFit {
            sum: self.sum(&x, &start),
            jacobian: self.jacobian(&x, compute)?,
            weights: self.weights(&start),
            x,
            computed: start,
            steps: 0,
            stopped: false,
            converged: false,
        };
        let mut damping = 1e-3;
        let mut fresh = true;
        begun(&best)?;
        while best.steps < MOST_STEPS {
            match self.next(&mut best, &mut damping, &mut fresh, compute) {
                Err(FittingError::Stopped) => best.stopped = true,
                ended => best.converged = ended?,
            }
            if best.stopped || best.converged {
                return Ok(best);
            }
            begun(&best)?;
        }
        Ok(best)
    }

    /// A step, and the derivatives after it. Returns whether the search has come to its end.
    fn next(
        &self,
        best: &mut BestFit,
        damping: &mut f64,
        fresh: &mut bool,
        compute: &mut Compute<'_>,
    ) -> Result<bool, FittingError> {
        let before = (best.x.clone(), best.computed.clone());
        let [gain, promised] = self.step(best, damping, compute)?;
        best.steps += 1;
        if gain < GAIN && *fresh {
            return Ok(true);
        }
        if gain >= GAIN && gain > GOOD * promised {
            self.correct(best, &before);
            *fresh = false;
        } else {
            best.jacobian = self.jacobian(&best.x, compute)?;
            *fresh = true;
        }
        Ok(false)
    }

    /// Corrects the derivatives along the last step.
    fn correct(&self, best: &mut BestFit, (x, computed): &(Vec<f64>, Vec<f64>)) {
        let step = DVector::from_iterator(x.len(), best.x.iter().zip(x).map(|(after, before)| after - before));
        let changes =
            self.residuals(&best.computed).zip(self.residuals(computed)).map(|(after, before)| after - before);
        let off = DVector::from_iterator(best.jacobian.nrows(), changes) - &best.jacobian * &step;
        best.jacobian += off * step.transpose() / step.norm_squared();
    }

    /// A step downhill, damped until it gains. Returns the gain, 0 where no step gains, and the gain where the computed temperatures were linear.
    fn step(&self, best: &mut BestFit, damping: &mut f64, compute: &mut Compute<'_>) -> Result<[f64; 2], FittingError> {
        let (normal, downhill) = self.equations(best);
        let free: Vec<usize> = (0..best.x.len()).filter(|i| !self.leads_out(best.x[*i], downhill[*i], *i)).collect();
        while *damping < 1e10 {
            let mut damped = DMatrix::from_fn(free.len(), free.len(), |a, b| normal[(free[a], free[b])]);
            for (place, i) in free.iter().enumerate() {
                damped[(place, place)] = normal[(*i, *i)] * (1.0 + *damping) + f64::MIN_POSITIVE;
            }
            let right = DVector::from_iterator(free.len(), free.iter().map(|i| downhill[*i]));
            let Some(solved) = damped.cholesky().map(|factor| factor.solve(&right)) else {
                *damping *= 10.0;
                continue;
            };
            let shrink = (LONGEST / solved.amax()).min(1.0);
            let mut x = best.x.clone();
            for (i, step) in free.iter().zip(solved.iter()) {
                let [low, high] = self.unknowns[*i].bounds;
                x[*i] = (x[*i] + shrink * step).clamp(low, high);
            }
            let moved = DVector::from_iterator(x.len(), x.iter().zip(&best.x).map(|(after, before)| after - before));
            let promised = 2.0 * downhill.dot(&moved) - (&normal * &moved).dot(&moved);
            if x == best.x {
                return Ok([0.0; 2]);
            }
            let computed = compute(&x)?;
            let sum = self.sum(&x, &computed);
            if sum < best.sum {
                let gain = best.sum - sum;
                (best.sum, best.weights, best.x, best.computed) = (sum, self.weights(&computed), x, computed);
                *damping = (*damping * 0.1).max(1e-9);
                return Ok([gain, promised]);
            }
            // Rounding of the runs hides a gain that small.
            if promised < GAIN {
                return Ok([0.0; 2]);
            }
            *damping *= 10.0;
        }
        Ok([0.0; 2])
    }

    /// Whether a logarithm at its bound would leave it.
    fn leads_out(&self, x: f64, downhill: f64, i: usize) -> bool {
        let [low, high] = self.unknowns[i].bounds;
        (x <= low && downhill < 0.0) || (x >= high && downhill > 0.0)
    }

    /// The normal equations: information of data and priors, and the negative half gradient of the sum.
    fn equations(&self, best: &BestFit) -> (DMatrix<f64>, DVector<f64>) {
        let residuals: Vec<f64> = self.residuals(&best.computed).collect();
        let count = self.unknowns.len();
        let column = |i: usize| best.jacobian.column(i);
        let mut normal = DMatrix::zeros(count, count);
        let mut downhill = DVector::zeros(count);
        for a in 0..count {
            let weighted: Vec<f64> =
                column(a).iter().zip(&best.weights).map(|(slope, weight)| slope * weight).collect();
            for b in a..count {
                let product: f64 = weighted.iter().zip(column(b).iter()).map(|(a, b)| a * b).sum();
                (normal[(a, b)], normal[(b, a)]) = (product, product);
            }
            let unknown = &self.unknowns[a];
            normal[(a, a)] += unknown.weight();
            downhill[a] = -weighted.iter().zip(&residuals).map(|(slope, residual)| slope * residual).sum::<f64>()
                - unknown.weight() * unknown.departure(best.x[a]);
        }
        (normal, downhill)
    }

    /// Residuals of the fitted values, in standard deviations.
    fn residuals(&self, computed: &[f64]) -> impl Iterator<Item = f64> {
        let points = self.measurements.points.iter().zip(computed).filter(|(point, _)| !point.held_out);
        points.map(|(point, computed)| (computed - point.value) / point.sigma)
    }

    fn weights(&self, computed: &[f64]) -> Vec<f64> {
        self.residuals(computed).map(|residual| self.loss.of(residual * residual, self.loss_scale)[1]).collect()
    }

    fn sum(&self, x: &[f64], computed: &[f64]) -> f64 {
        let data: f64 = self.residuals(computed).map(|r| self.loss.of(r * r, self.loss_scale)[0]).sum();
        let prior = |(unknown, x): (&Unknown, &f64)| unknown.weight() * unknown.departure(*x).powi(2);
        data + self.unknowns.iter().zip(x).map(prior).sum::<f64>()
    }

    /// Central differences, or one-sided ones at a bound.
    fn jacobian(&self, x: &[f64], compute: &mut Compute<'_>) -> Result<DMatrix<f64>, FittingError> {
        let fitted: Vec<(usize, f64)> = self
            .measurements
            .points
            .iter()
            .enumerate()
            .filter(|(_, point)| !point.held_out)
            .map(|(i, point)| (i, point.sigma))
            .collect();
        let mut jacobian = DMatrix::zeros(fitted.len(), x.len());
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let mut at = |offset: f64| {
                let mut moved = x.to_vec();
                moved[i] = (moved[i] + offset).clamp(unknown.bounds[0], unknown.bounds[1]);
                Ok::<_, FittingError>((moved[i], compute(&moved)?))
            };
            let ((low, before), (high, after)) = (at(-unknown.step)?, at(unknown.step)?);
            for (row, (point, sigma)) in fitted.iter().enumerate() {
                jacobian[(row, i)] = (after[*point] - before[*point]) / ((high - low) * sigma);
            }
        }
        Ok(jacobian)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::measurements::{MeasuredGroup, MeasuredPoint};

    fn unknown(prior: Option<[f64; 2]>) -> Unknown {
        Unknown { name: "a".into(), unit: "", value: Some(1.0), prior, bounds: [-7.0, 7.0], step: 1e-3 }
    }

    /// y = a exp(-b t), of which two logarithms are sought: a = 3, b = 0.5.
    fn curve(x: &[f64]) -> Vec<f64> {
        (0..20).map(|t| x[0].exp() * (-x[1].exp() * 0.2 * f64::from(t)).exp()).collect()
    }

    fn measured(glitch: f64) -> Measurements {
        let point =
            |(t, value): (usize, f64)| MeasuredPoint { group: 0, time: t as f64, value, sigma: 0.01, held_out: false };
        let mut points: Vec<MeasuredPoint> =
            curve(&[3f64.ln(), 0.5f64.ln()]).into_iter().enumerate().map(point).collect();
        points[4].value += glitch;
        Measurements { groups: vec![MeasuredGroup { kind: "sensor", name: "s".into(), place: String::new() }], points }
    }

    fn fitted(loss: Loss, glitch: f64, unknowns: &[Unknown]) -> BestFit {
        let measurements = measured(glitch);
        let objective = Objective { measurements: &measurements, unknowns, loss, loss_scale: 3.0 };
        objective.minimise(curve(&[0.0, 0.0]), &mut |x| Ok(curve(x)), &mut |_| Ok(())).unwrap()
    }

    #[test]
    fn a_curve_is_met_and_a_glitch_moves_a_robust_fit_least() {
        let two = [unknown(None), unknown(None)];
        let off = |best: &BestFit| (best.x[0].exp() - 3.0).abs() + (best.x[1].exp() - 0.5).abs();
        let exact = fitted(Loss::Square, 0.0, &two);
        assert!(exact.converged && off(&exact) < 1e-4, "{exact:?}");
        let errors = [Loss::Square, Loss::Huber, Loss::Cauchy].map(|loss| off(&fitted(loss, 1.0, &two)));
        assert!(errors[0] > 0.05 && errors[1] < 0.02 && errors[2] < 0.003, "{errors:?}");
    }

    #[test]
    fn a_tight_prior_and_a_bound_hold() {
        let held = fitted(Loss::Square, 0.0, &[unknown(None), unknown(Some([0.0, 1e-6]))]);
        assert!(held.x[1].abs() < 1e-5 && held.x[0].exp() > 3.0);
        let bounded = Unknown { bounds: [-7.0, 0.5], ..unknown(None) };
        let at_bound = fitted(Loss::Square, 0.0, &[bounded, unknown(None)]);
        assert_eq!(at_bound.x[0], 0.5);
    }
}
