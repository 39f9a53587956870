//! The logarithm of the factor by which a parameter is multiplied: its prior and its bounds.

use super::FittingError;
use crate::scene::{Parameter, ParameterPrior, ParameterRange};

/// Largest factor of a parameter, in both directions.
const MOST: f64 = 1e3;

/// The logarithm of a factor that is sought.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Unknown {
    pub(crate) name: String,
    pub(crate) unit: &'static str,
    /// The value, where all owners have one.
    pub(crate) value: Option<f64>,
    /// Centre and standard deviation of the prior. `None` where nothing is known.
    pub(crate) prior: Option<[f64; 2]>,
    pub(crate) bounds: [f64; 2],
    /// Step of a difference.
    pub(crate) step: f64,
}

impl Unknown {
    /// The unknown of a parameter with these values in the model.
    ///
    /// # Errors
    /// A prior that the values do not have.
    pub(crate) fn new(parameter: &Parameter, values: &[f64]) -> Result<Self, FittingError> {
        let first = values[0];
        let value = values.iter().all(|value| (value - first).abs() <= 1e-12 * first.abs()).then_some(first);
        let centre = |key: &str, stated: f64| match value {
            Some(value) if value > 0.0 && stated > 0.0 => Ok((stated / value).ln()),
            Some(_) => Err(parameter.error(key, "must be above 0, because a fit varies the logarithm".to_owned())),
            None => {
                let message = format!("names values from {values:?}, which have no common prior: state percent");
                Err(parameter.error(key, message))
            }
        };
        let prior = match (parameter.prior, parameter.range) {
            (ParameterPrior::None, _) => None,
            (ParameterPrior::Stated(None, sigma), _) => Some([0.0, sigma]),
            (ParameterPrior::Stated(Some(stated), sigma), _) => Some([centre("prior_value", stated)?, sigma]),
            (ParameterPrior::Range, ParameterRange::Percent(percent)) => Some([0.0, (percent / 100.0).ln_1p() / 2.0]),
            (ParameterPrior::Range, ParameterRange::Values([low, high])) => {
                let ends = [centre("range", low)?, centre("range", high)?];
                Some([(ends[0] + ends[1]) / 2.0, (ends[1] - ends[0]) / 4.0])
            }
        };
        let largest = values.iter().copied().fold(0.0, f64::max);
        let most = if parameter.kind.is_share() { (1.0 / largest).ln().max(0.0) } else { MOST.ln() };
        Ok(Self {
            name: parameter.name.clone(),
            unit: parameter.kind.unit(),
            value,
            prior,
            bounds: [-MOST.ln(), most],
            step: parameter.step,
        })
    }

    /// Weight of the prior: the reciprocal of its variance, or 0.
    pub(crate) fn weight(&self) -> f64 {
        self.prior.map_or(0.0, |[_, sigma]| sigma.powi(-2))
    }

    /// Departure from the centre of the prior.
    pub(crate) fn departure(&self, x: f64) -> f64 {
        self.prior.map_or(0.0, |[centre, _]| x - centre)
    }
}
