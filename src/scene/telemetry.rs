//! A table of telemetry: time, sensor, temperature and its standard deviation.

use std::path::Path;

use hifitime::{Epoch, TimeScale};

use super::ephemeris::FileLine;
use super::epoch::parse_epoch;
use super::error::SceneError;
use super::file::read_text;
use super::temperatures::CELSIUS;
use crate::environment::trajectory::seconds_between;
use crate::text::plain;

/// Highest temperature of a row [K].
const HOTTEST: f64 = 1e4;

/// A row of telemetry.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TelemetryRow {
    pub(crate) line: usize,
    /// Time of the scene [s].
    pub(crate) time: f64,
    pub(crate) sensor: String,
    /// Temperature [K].
    pub(crate) temperature: f64,
    /// Standard deviation [K], where the table states one.
    pub(crate) sigma: Option<f64>,
}

/// Reads a table with the columns `time`, `sensor`, `temperature` [K] or `temperature_degC`, and `sigma` [K], which may be absent. Dates count from `start`.
///
/// # Errors
/// A file that cannot be read, a column that is missing, a value that is none, or a table without rows.
pub(crate) fn read_telemetry(path: &Path, start: Option<Epoch>) -> Result<Vec<TelemetryRow>, SceneError> {
    let text = read_text(path)?;
    let at = |line: usize| FileLine { path, line };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let heads = reader.headers().map_err(|error| at(1).error("table", error))?.clone();
    let column = |name: &str| heads.iter().position(|head| head.trim_start_matches('\u{feff}') == name);
    let needed = |name: &str| {
        let message = format!("is missing in the header '{}'", plain(&heads.iter().collect::<Vec<_>>().join(",")));
        column(name).ok_or_else(|| at(1).error(name, message))
    };
    let (time, sensor) = (needed("time")?, needed("sensor")?);
    let (kelvin, zero) = match column("temperature_degC") {
        Some(_) if column("temperature").is_some() => {
            return Err(at(1).error("temperature", "stands beside temperature_degC: state one of them"));
        }
        Some(column) => (column, CELSIUS),
        None => (needed("temperature")?, 0.0),
    };
    let sigma = column("sigma");
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(1, |position| position.line() as usize);
            at(line).error("table", error)
        })?;
        let here = at(record.position().map_or(1, |position| position.line() as usize));
        let number = |key: &str, cell: &str| {
            let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| here.error(key, format!("'{}' is no number", plain(cell))))
        };
        let temperature = number("temperature", &record[kelvin])? + zero;
        if !(0.0..=HOTTEST).contains(&temperature) || temperature == 0.0 {
            return Err(
                here.error("temperature", format!("must be above 0 K and at most {HOTTEST} K, not {temperature} K"))
            );
        }
        let sigma = sigma.map(|column| &record[column]).filter(|cell| !cell.is_empty());
        let sigma = sigma.map(|cell| number("sigma", cell)).transpose()?;
        if let Some(wrong) = sigma.filter(|sigma| *sigma <= 0.0) {
            return Err(here.error("sigma", format!("must be above 0 K, not {wrong}")));
        }
        rows.push(TelemetryRow {
            line: here.line,
            time: seconds(&here, &record[time], start)?,
            sensor: plain(&record[sensor]).into_owned(),
            temperature,
            sigma,
        });
    }
    if rows.is_empty() { Err(at(1).error("table", "has no rows")) } else { Ok(rows) }
}

fn seconds(here: &FileLine<'_>, cell: &str, start: Option<Epoch>) -> Result<f64, SceneError> {
    if let Some(seconds) = cell.parse::<f64>().ok().filter(|seconds| seconds.is_finite()) {
        return Ok(seconds);
    }
    let epoch = parse_epoch(cell, TimeScale::UTC).map_err(|message| here.error("time", message))?;
    let none = || here.error("time", format!("'{}' is a date, for which the scene needs time.start", plain(cell)));
    Ok(seconds_between(start.ok_or_else(none)?, epoch))
}
