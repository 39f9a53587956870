//! The data of a step response, checked.

use crate::thermal::function::TemperatureSample;

/// Fewest rows, more than the free parameters of any function.
pub(crate) const FEWEST_ROWS: usize = 6;

/// Rows used in the search for a start. The fit itself uses all rows.
const SEARCH_ROWS: usize = 200;
/// Highest temperature [K]. The fourth power of a much higher one would overflow.
const HOTTEST: f64 = 1e6;
/// Longest time. Beyond it the search for t_max would overflow.
const LARGEST_TIME: f64 = 1e100;

/// An error in the data. Rows count from 1, without the header.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum FitError {
    #[error("{0} rows are too few: a step response needs at least {FEWEST_ROWS}")]
    TooFew(usize),
    /// A number that is not finite, or a temperature below 0 K.
    #[error("row {row}: {what} is {value}; {wanted}")]
    Value {
        row: usize,
        /// `time` or `temperature`.
        what: &'static str,
        value: f64,
        /// Allowed values.
        wanted: &'static str,
    },
    /// Times that do not increase.
    #[error("row {row}: time {time} does not lie after {before}, the time of the row before")]
    Order {
        row: usize,
        time: f64,
        /// Time of the row before.
        before: f64,
    },
    /// Temperatures that do not change.
    #[error("the temperature is {0} K in every row: there is no response to fit")]
    Constant(f64),
    /// A target that is not a valid temperature.
    #[error("the target is {0} K; it must be from 0 to 1e6 K, and not the temperature of the first row")]
    Target(f64),
    /// A target in the opposite direction of the data.
    #[error("the data move from {first} K to {extreme} K, away from the target of {target} K")]
    Direction {
        /// First temperature [K].
        first: f64,
        /// Temperature farthest from it [K].
        extreme: f64,
        /// The target [K].
        target: f64,
    },
}

impl FitError {
    /// The error with a line number of the file instead of the row number.
    pub(crate) fn in_lines(mut self, lines: &[u64]) -> Self {
        if let Self::Value { row, .. } | Self::Order { row, .. } = &mut self {
            *row = lines.get(*row - 1).map_or(*row, |line| *line as usize);
        }
        self
    }
}

/// Checked data: times [unit of the data] since the first row, and temperatures [K]. The first row itself is left out.
pub(super) struct FitData {
    pub(crate) rows: Vec<[f64; 2]>,
    pub(crate) initial: f64,
    /// Temperature difference to the row farthest from the first [K], negative for cooling.
    pub(crate) span: f64,
    pub(crate) range: f64,
    pub(crate) target: Option<f64>,
}

impl FitData {
    pub(crate) fn new(samples: &[TemperatureSample], target: Option<f64>) -> Result<Self, FitError> {
        for (row, sample) in (1..).zip(samples) {
            let value = |what, value, wanted| FitError::Value { row, what, value, wanted };
            if !sample.time.is_finite() || sample.time.abs() > LARGEST_TIME {
                return Err(value("time", sample.time, "it must be finite and within 1e100"));
            }
            if !(0.0..=HOTTEST).contains(&sample.temperature) {
                return Err(value("temperature", sample.temperature, "it must be from 0 to 1e6 K"));
            }
        }
        for (row, pair) in (2..).zip(samples.windows(2)) {
            if pair[1].time <= pair[0].time {
                return Err(FitError::Order { row, time: pair[1].time, before: pair[0].time });
            }
        }
        let [first, rest @ ..] = samples else { return Err(FitError::TooFew(0)) };
        if samples.len() < FEWEST_ROWS {
            return Err(FitError::TooFew(samples.len()));
        }
        let initial = first.temperature;
        let rows: Vec<[f64; 2]> = rest.iter().map(|row| [row.time - first.time, row.temperature]).collect();
        let distance = rows.iter().map(|row| row[1] - initial);
        let span = distance.fold(0.0, |span: f64, d| if d.abs() > span.abs() { d } else { span });
        if span == 0.0 {
            return Err(FitError::Constant(initial));
        }
        if let Some(target) = target {
            if !(0.0..=HOTTEST).contains(&target) || target == initial {
                return Err(FitError::Target(target));
            }
            if (target - initial) * span < 0.0 {
                return Err(FitError::Direction { first: initial, extreme: initial + span, target });
            }
        }
        Ok(Self { rows, initial, span, range: span.abs(), target })
    }

    pub(crate) fn last_time(&self) -> f64 {
        self.rows[self.rows.len() - 1][0]
    }

    /// About `SEARCH_ROWS` rows at even intervals, with the last one.
    pub(crate) fn thinned(&self) -> Vec<[f64; 2]> {
        let stride = self.rows.len().div_ceil(SEARCH_ROWS);
        let mut rows: Vec<[f64; 2]> = self.rows.iter().rev().step_by(stride).copied().collect();
        rows.reverse();
        rows
    }
}
