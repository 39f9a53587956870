//! The data of a step response, checked.

use crate::thermal::function::Sample;

/// Fewest rows: more than any function has free numbers.
pub const FEWEST_ROWS: usize = 6;

/// Rows that the search for a start looks at; the fit itself uses all.
const SEARCH_ROWS: usize = 200;
/// Highest temperature [K]; the fourth power of a much higher one would overflow.
const HOTTEST: f64 = 1e6;
/// Beyond this the search for t_max would overflow.
const LARGEST_TIME: f64 = 1e100;

/// Data from which nothing can be fitted. Rows count from 1, the header left out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Too few rows.
    #[error("{0} rows are too few: a step response needs at least {FEWEST_ROWS}")]
    TooFew(usize),
    /// A number that is not finite, or a temperature below 0 K.
    #[error("row {row}: {what} is {value}; {wanted}")]
    Value {
        /// Which row.
        row: usize,
        /// `time` or `temperature`.
        what: &'static str,
        /// What is there.
        value: f64,
        /// What should be.
        wanted: &'static str,
    },
    /// Times that do not rise.
    #[error("row {row}: time {time} does not lie after {before}, the time of the row before")]
    Order {
        /// Which row.
        row: usize,
        /// Its time.
        time: f64,
        /// That of the row before.
        before: f64,
    },
    /// Nothing moves.
    #[error("the temperature is {0} K in every row: there is no response to fit")]
    Constant(f64),
    /// A target that cannot be one.
    #[error("the target is {0} K; it must be from 0 to 1e6 K, and not the temperature of the first row")]
    Target(f64),
    /// A target against the data's direction.
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
    /// The same error with the line of a file in place of the number of the row.
    pub fn in_lines(mut self, lines: &[u64]) -> Self {
        if let Self::Value { row, .. } | Self::Order { row, .. } = &mut self {
            *row = lines.get(*row - 1).map_or(*row, |line| *line as usize);
        }
        self
    }
}

/// Checked data: times [unit of the data] since the first row, which is left out, and temperatures [K].
pub(super) struct Data {
    pub rows: Vec<[f64; 2]>,
    pub initial: f64,
    /// Distance to the row farthest from the first [K], negative for cooling.
    pub span: f64,
    pub range: f64,
    pub target: Option<f64>,
}

impl Data {
    pub fn new(samples: &[Sample], target: Option<f64>) -> Result<Self, FitError> {
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

    pub fn last_time(&self) -> f64 {
        self.rows[self.rows.len() - 1][0]
    }

    /// About `SEARCH_ROWS` of the rows, evenly chosen, the last included.
    pub fn thinned(&self) -> Vec<[f64; 2]> {
        let stride = self.rows.len().div_ceil(SEARCH_ROWS);
        let mut rows: Vec<[f64; 2]> = self.rows.iter().rev().step_by(stride).copied().collect();
        rows.reverse();
        rows
    }
}
