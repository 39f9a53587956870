//! A response function from measured times and temperatures: normalised and interpolated by a monotone cubic.
//!
//! The cubic follows Fritsch & Carlson 1980 (SIAM J. Numer. Anal. 17, 238). Hermite pieces run through all points. Their slopes come from the
//! parabola through three neighbours, reduced where a piece would not be monotone.

use std::path::Path;

use super::error::FunctionError;

/// Largest time of a table in its unit, and largest temperature [K].
const LARGEST_TIME: f64 = 1e15;
const LARGEST_TEMPERATURE: f64 = 1e6;
/// Shortest way of a table [K].
const LEAST_WAY: f64 = 1e-9;
/// Shortest distance between two points as a share of the whole time. Below it their slopes are rounding.
const SHORTEST_STEP: f64 = 1e-12;

/// A measured temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TemperatureSample {
    /// Time in any unit and from any origin.
    pub time: f64,
    /// Temperature [K].
    pub temperature: f64,
}

/// Points (share of the time left, share of the way left) from the end to the start, with their slopes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MeasuredFunction {
    r: Vec<f64>,
    left: Vec<f64>,
    slope: Vec<f64>,
}

impl MeasuredFunction {
    pub(super) fn new(samples: &[TemperatureSample], target: Option<f64>) -> Result<Self, FunctionError> {
        let rows: Vec<u64> = (1..=samples.len() as u64).collect();
        Self::checked(samples, &rows, target, None)
    }

    pub(super) fn read(path: &Path, target: Option<f64>) -> Result<Self, FunctionError> {
        let unreadable = |reason: String| FunctionError::Unreadable { path: path.to_path_buf(), reason };
        let text = crate::files::read_text_or_pipe(path).map_err(|fault| unreadable(fault.to_string()))?;
        Self::parse(&text, path, target)
    }

    pub(super) fn parse(text: &str, path: &Path, target: Option<f64>) -> Result<Self, FunctionError> {
        let (samples, rows) = read_samples(text, path)?;
        Self::checked(&samples, &rows, target, Some(path))
    }

    /// Number of points, including the end of an extrapolation.
    pub(crate) fn len(&self) -> usize {
        self.r.len()
    }

    fn checked(
        samples: &[TemperatureSample],
        rows: &[u64],
        target: Option<f64>,
        path: Option<&Path>,
    ) -> Result<Self, FunctionError> {
        let owned = || path.map(Path::to_path_buf);
        let row_error = |index: usize, message: String| FunctionError::Row { path: owned(), row: rows[index], message };
        let table_error = |message: &str| FunctionError::Table { path: owned(), message: message.to_owned() };
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
            return Err(table_error("a table needs at least two rows"));
        };
        if samples.len() < 2 {
            return Err(table_error("a table needs at least two rows"));
        }
        samples
            .iter()
            .enumerate()
            .try_for_each(|(index, sample)| check_range(sample).map_err(|message| row_error(index, message)))?;
        let way = target.unwrap_or(last.temperature) - first.temperature;
        if way == 0.0 || !way.is_finite() {
            return Err(table_error("the first and the last temperature are equal: nothing moves"));
        }
        if !(LEAST_WAY..=LARGEST_TEMPERATURE).contains(&way.abs()) {
            let message = format!("it moves by {way:e} K; a way has {LEAST_WAY:e} to {LARGEST_TEMPERATURE:e} K");
            return Err(table_error(&message));
        }
        for (index, pair) in samples.windows(2).enumerate() {
            check_order(pair, way, first.temperature).map_err(|message| row_error(index + 1, message))?;
        }
        let done = |sample: &TemperatureSample| (sample.temperature - first.temperature) / way;
        if done(last) > 1.0 {
            return Err(row_error(samples.len() - 1, format!("{} K is beyond the target", last.temperature)));
        }
        let mut times: Vec<f64> = samples.iter().map(|sample| sample.time).collect();
        let mut left: Vec<f64> = samples.iter().map(|sample| 1.0 - done(sample)).collect();
        if left[left.len() - 1] > 0.0 {
            let last = *slopes(&times, &left).last().unwrap_or(&0.0);
            if last >= 0.0 {
                return Err(table_error("the last rate is 0: the target is never reached"));
            }
            times.push(times[times.len() - 1] - left[left.len() - 1] / last);
            left.push(0.0);
        }
        let (start, end) = (first.time, times[times.len() - 1]);
        let r: Vec<f64> = times.iter().rev().map(|time| (end - time) / (end - start)).collect();
        let are_apart = r.windows(2).all(|pair| pair[1] - pair[0] >= SHORTEST_STEP);
        if !are_apart {
            let message = format!(
                "two times lie closer together than {SHORTEST_STEP:e} of the way from {start:e} to {end:e}, where the target \
                 is reached"
            );
            return Err(table_error(&message));
        }
        left.reverse();
        let slope = slopes(&r, &left);
        Ok(Self { r, left, slope })
    }

    /// Ends of the pieces as shares of the time left, in rising order.
    pub(crate) fn knots(&self) -> &[f64] {
        &self.r
    }

    pub(super) fn remaining(&self, r: f64) -> f64 {
        let i = self.r.partition_point(|knot| *knot <= r).clamp(1, self.r.len() - 1) - 1;
        let width = self.r[i + 1] - self.r[i];
        let t = (r - self.r[i]) / width;
        let (w0, w1) = (self.left[i], self.left[i + 1]);
        let (m0, m1) = (width * self.slope[i], width * self.slope[i + 1]);
        let step = w1 - w0;
        // w0 + t (m0 + t (c2 + t c3)) is exact at both ends up to rounding.
        let (c2, c3) = (3.0 * step - 2.0 * m0 - m1, m0 + m1 - 2.0 * step);
        (w0 + t * (m0 + t * (c2 + t * c3))).clamp(w0, w1)
    }
}

/// Slopes of the monotone cubic through (x, y), x rising.
fn slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let secants: Vec<f64> = x.windows(2).zip(y.windows(2)).map(|(x, y)| (y[1] - y[0]) / (x[1] - x[0])).collect();
    let mut slopes = Vec::with_capacity(x.len());
    slopes.push(secants[0]);
    slopes.extend(x.windows(3).zip(secants.windows(2)).map(|(x, secant)| {
        let (before, after) = (x[1] - x[0], x[2] - x[1]);
        (after * secant[0] + before * secant[1]) / (before + after)
    }));
    slopes.push(secants[secants.len() - 1]);
    for (i, secant) in secants.iter().enumerate() {
        if *secant == 0.0 {
            (slopes[i], slopes[i + 1]) = (0.0, 0.0);
            continue;
        }
        let (a, b) = (slopes[i] / secant, slopes[i + 1] / secant);
        let size = (a * a + b * b).sqrt();
        if size > 3.0 {
            slopes[i] *= 3.0 / size;
            slopes[i + 1] *= 3.0 / size;
        }
    }
    slopes
}

/// Rows of a CSV text with the columns `time` and `temperature`, each with its line number.
fn read_samples(text: &str, path: &Path) -> Result<(Vec<TemperatureSample>, Vec<u64>), FunctionError> {
    let unreadable = |reason: String| FunctionError::Unreadable { path: path.to_path_buf(), reason };
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).flexible(true).from_reader(text.as_bytes());
    let headers = reader.headers().map_err(|error| unreadable(error.to_string()))?.clone();
    let column = |name: &str| {
        headers.iter().position(|header| header.eq_ignore_ascii_case(name)).ok_or_else(|| FunctionError::Row {
            path: Some(path.to_path_buf()),
            row: 1,
            message: format!("the first row must name the columns time and temperature; there is no '{name}'"),
        })
    };
    let (time, temperature) = (column("time")?, column("temperature")?);
    let (mut samples, mut rows) = (Vec::new(), Vec::new());
    for record in reader.records() {
        let record = record.map_err(|error| unreadable(error.to_string()))?;
        let row = record.position().map_or(0, csv::Position::line);
        let number = |index: usize, name: &str| {
            let field = record.get(index).unwrap_or("");
            field.parse::<f64>().map_err(|_| FunctionError::Row {
                path: Some(path.to_path_buf()),
                row,
                message: format!("{name}: '{field}' is not a number"),
            })
        };
        samples
            .push(TemperatureSample { time: number(time, "time")?, temperature: number(temperature, "temperature")? });
        rows.push(row);
    }
    Ok((samples, rows))
}

/// Refuses a sample that is not finite or too large.
fn check_range(sample: &TemperatureSample) -> Result<(), String> {
    if !(sample.time.is_finite() && sample.temperature.is_finite()) {
        return Err("time and temperature must be finite".to_owned());
    }
    if sample.time.abs() > LARGEST_TIME || sample.temperature.abs() > LARGEST_TEMPERATURE {
        let message = format!(
            "a time is from -{LARGEST_TIME:e} to {LARGEST_TIME:e}, a temperature from -{LARGEST_TEMPERATURE:e} to \
             {LARGEST_TEMPERATURE:e} K, found {:e} and {:e} K",
            sample.time, sample.temperature
        );
        return Err(message);
    }
    Ok(())
}

/// Refuses neighbours with times that do not rise, or with temperatures that turn back from `first` [K].
fn check_order(pair: &[TemperatureSample], way: f64, first: f64) -> Result<(), String> {
    let [before, after] = [pair[0], pair[1]];
    if after.time == before.time {
        let message = format!("time {} stands twice: times must rise", after.time);
        return Err(message);
    }
    if after.time < before.time {
        let message = format!("time {} comes after {}: times must rise", after.time, before.time);
        return Err(message);
    }
    if (after.temperature - before.temperature) * way < 0.0 {
        let towards = if way > 0.0 { "rises" } else { "falls" };
        let message = format!(
            "{} K at time {} comes after {} K, but the table {towards} from {} K: it must not turn back \
             (smooth the noise away)",
            after.temperature, after.time, before.temperature, first
        );
        return Err(message);
    }
    Ok(())
}
