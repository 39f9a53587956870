//! The result of a fit: values, their errors, and how measured and computed temperatures differ.

use serde_json::{Value, json};

use super::FittingError;
use super::least_squares::BestFit;
use super::measurements::Measurements;
use super::posterior::Posterior;
use super::prior::Unknown;
use super::words::{rounded, sentence, share};
use crate::scene::Loss;
use crate::text::significant;

/// Reduced chi-squared from which the errors of the values are void: they are too small by the root of it.
const MOST_CHI_SQUARED: f64 = 2.0;

/// A model whose values are fitted.
pub(super) trait FitModel {
    /// Temperatures of all that was measured [K], with the values of each parameter times a factor.
    ///
    /// # Errors
    /// A run that fails, or the end by the user.
    fn computed(&mut self, factors: &[f64]) -> Result<Vec<f64>, FittingError>;

    /// Fitted values as TOML that can be used. `head` becomes comments at its begin.
    fn fitted_text(&self, factors: &[f64], head: &[String]) -> String;
}

/// The result of a fit.
pub(crate) struct Fitted {
    /// Name of the model.
    pub(super) name: String,
    pub(super) unknowns: Vec<Unknown>,
    pub(super) posterior: Posterior,
    pub(super) measurements: Measurements,
    /// Computed temperatures of the model as it is [K].
    pub(super) before: Vec<f64>,
    pub(super) best: BestFit,
    pub(super) loss: (Loss, f64),
    /// The fitted values as TOML.
    pub(super) text: String,
}

/// Root mean square of measured minus computed temperatures [K], before and after the fit, of so many values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Misfits {
    pub(super) count: usize,
    pub(super) before: f64,
    pub(super) after: f64,
    /// The same after the fit in standard deviations.
    pub(super) sigmas: f64,
}

impl Fitted {
    /// Whether the user ended the fit before its end. The values are the best until then.
    pub(crate) fn is_stopped(&self) -> bool {
        self.best.stopped
    }

    /// Value of a parameter, or its factor where its owners have several.
    pub(super) fn value(&self, i: usize) -> f64 {
        self.unknowns[i].value.unwrap_or(1.0) * self.best.x[i].exp()
    }

    /// Misfits of a group, or of all groups, among the fitted or among the held out values.
    pub(super) fn misfits(&self, group: Option<usize>, held_out: bool) -> Misfits {
        let mut sums = [0.0; 3];
        let mut count = 0;
        for (i, point) in self.measurements.points.iter().enumerate() {
            if point.held_out == held_out && group.is_none_or(|group| group == point.group) {
                let [before, after] = [self.before[i], self.best.computed[i]].map(|computed| point.value - computed);
                count += 1;
                for (sum, off) in sums.iter_mut().zip([before, after, after / point.sigma]) {
                    *sum += off * off;
                }
            }
        }
        let [before, after, sigmas] = sums.map(|sum| (sum / count.max(1) as f64).sqrt());
        Misfits { count, before, after, sigmas }
    }

    /// Squares of the fitted residuals in standard deviations, as the loss weighs them, over the number of values beyond the number of parameters.
    fn reduced_chi_squared(&self) -> f64 {
        let points = self.measurements.points.iter().zip(&self.best.computed).filter(|(point, _)| !point.held_out);
        let squares = points.map(|(point, computed)| ((computed - point.value) / point.sigma).powi(2));
        let weighed = squares.zip(&self.best.weights).map(|(square, weight)| square * weight).sum::<f64>();
        weighed / self.degrees_of_freedom()
    }

    fn degrees_of_freedom(&self) -> f64 {
        self.best.weights.len().saturating_sub(self.unknowns.len()).max(1) as f64
    }

    /// A warning where the residuals are too large for the stated errors to hold.
    pub(crate) fn warning(&self) -> Option<String> {
        let chi_squared = self.reduced_chi_squared();
        // Five standard deviations of its distribution where the errors hold.
        let most = 1.0 + 5.0 * (2.0 / self.degrees_of_freedom()).sqrt();
        (chi_squared > most.max(MOST_CHI_SQUARED)).then(|| {
            format!(
                "the residuals are too large for the standard deviations of the data (reduced chi-squared {}): the errors of the values are void. \
                 The model, a pose or a time of the data, or these standard deviations are wrong",
                rounded(chi_squared)
            )
        })
    }

    /// Rows of the table of parameters, with its head.
    pub(super) fn parameter_rows(&self) -> Vec<Vec<String>> {
        let head = [
            "parameter",
            "unit",
            "before",
            "value",
            "sigma",
            "low_95",
            "high_95",
            "log_sigma",
            "prior_value",
            "prior_log_sigma",
            "from_data",
        ];
        let digits = significant;
        let row = |(i, unknown): (usize, &Unknown)| {
            let (value, sigma) = (self.value(i), self.posterior.sigma(i));
            let start = unknown.value.unwrap_or(1.0);
            let ends = [-1.96, 1.96].map(|times: f64| value * (times * sigma).exp());
            let prior = |place: usize, of: fn(f64) -> f64| {
                unknown.prior.map_or(String::new(), |prior| digits(of(prior[place])))
            };
            let centre = unknown.prior.map_or(String::new(), |[centre, _]| digits(start * centre.exp()));
            vec![
                unknown.name.clone(),
                if unknown.value.is_some() { unknown.unit.to_owned() } else { "factor".to_owned() },
                digits(start),
                digits(value),
                digits((value * sigma).abs()),
                digits(ends[0].min(ends[1])),
                digits(ends[0].max(ends[1])),
                digits(sigma),
                centre,
                prior(1, |sigma| sigma),
                format!("{:.3}", self.posterior.data_shares[i]),
            ]
        };
        let rows = self.unknowns.iter().enumerate().map(row);
        std::iter::once(head.map(str::to_owned).to_vec()).chain(rows).collect()
    }

    /// What the data say of the parameters, in sentences.
    pub(crate) fn sentences(&self) -> Vec<String> {
        let mut all: Vec<String> = Vec::new();
        let misfits = self.misfits(None, false);
        all.push(format!(
            "{} measured values: {:.3} K rms before, {:.3} K after, {:.2} standard deviations",
            misfits.count, misfits.before, misfits.after, misfits.sigmas
        ));
        let held = self.misfits(None, true);
        if held.count > 0 {
            all.push(format!(
                "{} values held out: {:.3} K rms before, {:.3} K after, {:.2} standard deviations",
                held.count, held.before, held.after, held.sigmas
            ));
        }
        all.extend(self.warning());
        let directions = &self.posterior.directions;
        all.extend(directions.iter().map(|direction| sentence(direction, &self.posterior, &self.unknowns)));
        all.push(format!("condition of the data: {:.3e}", self.posterior.condition));
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let x = self.best.x[i];
            if unknown.bounds.contains(&x) {
                all.push(format!(
                    "'{}' stands at its bound, {}: its error is none of a free value",
                    unknown.name,
                    self.value(i)
                ));
            }
            if let Some([centre, sigma]) = unknown.prior.filter(|[centre, sigma]| (x - centre).abs() > 3.0 * sigma) {
                let off = (x - centre) / sigma;
                all.push(format!("'{}' lies {off:+.1} standard deviations from its prior", unknown.name));
            }
        }
        if !self.best.converged {
            let why = if self.best.stopped { "stopped" } else { "the most steps were taken" };
            all.push(format!("the fit did not come to its end ({why}): these are the best values so far"));
        }
        all
    }

    /// All results as JSON.
    pub(crate) fn json(&self) -> Value {
        let count = self.unknowns.len();
        let matrix = |at: &dyn Fn(usize, usize) -> f64| -> Value {
            (0..count).map(|i| (0..count).map(|j| at(i, j)).collect::<Vec<f64>>()).collect::<Vec<_>>().into()
        };
        let parameter = |(i, unknown): (usize, &Unknown)| {
            let sigma = self.posterior.sigma(i);
            json!({
                "name": unknown.name,
                "unit": unknown.unit,
                "before": unknown.value,
                "value": unknown.value.map(|_| self.value(i)),
                "factor": self.best.x[i].exp(),
                "sigma": unknown.value.map(|_| (self.value(i) * sigma).abs()),
                "log_sigma": sigma,
                "prior": unknown.prior.map(|[centre, sigma]| json!({"factor": centre.exp(), "log_sigma": sigma})),
                "from_data": self.posterior.data_shares[i],
            })
        };
        let finite = |value: f64| value.is_finite().then_some(value);
        let direction = |direction: &super::posterior::DataDirection| {
            json!({
                "vector": direction.vector,
                "log_sigma_data": finite(direction.data),
                "log_sigma_prior": finite(direction.prior),
                "fixed": direction.is_fixed(),
                "known": share(direction.data.min(direction.prior)),
                "text": sentence(direction, &self.posterior, &self.unknowns),
            })
        };
        let misfits = |group: Option<usize>, held_out: bool| {
            let misfits = self.misfits(group, held_out);
            let rms = json!({"values": misfits.count, "before_k": misfits.before, "after_k": misfits.after, "after_sigmas": misfits.sigmas});
            if misfits.count > 0 { rms } else { Value::Null }
        };
        let groups = self.measurements.groups.iter().enumerate().map(|(i, group)| {
            json!({"kind": group.kind, "name": group.name, "place": group.place, "rms": misfits(Some(i), false), "held_out": misfits(Some(i), true)})
        });
        json!({
            "model": self.name,
            "version": env!("CARGO_PKG_VERSION"),
            "loss": format!("{:?}", self.loss.0),
            "loss_scale": self.loss.1,
            "steps": self.best.steps,
            "converged": self.best.converged,
            "stopped": self.best.stopped,
            "parameters": self.unknowns.iter().enumerate().map(parameter).collect::<Vec<_>>(),
            "covariance_of_logarithms": matrix(&|i, j| self.posterior.covariance[(i, j)]),
            "correlation": matrix(&|i, j| self.posterior.correlation(i, j)),
            "condition": finite(self.posterior.condition),
            "reduced_chi_squared": self.reduced_chi_squared(),
            "directions": self.posterior.directions.iter().map(direction).collect::<Vec<_>>(),
            "rms": misfits(None, false),
            "held_out": misfits(None, true),
            "measured": groups.collect::<Vec<_>>(),
            "text": self.sentences(),
        })
    }
}
