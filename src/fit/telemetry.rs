//! Assigns rows of telemetry to the places of a model.

use std::path::{Path, PathBuf};

use hifitime::Epoch;

use super::FittingError;
use super::measurements::{MeasuredGroup, MeasuredPoint, Measurements};
use crate::misspelt::suggestion;
use crate::scene::{FitInput, SceneError, SensorPlace, SensorRule, TelemetryRow, read_telemetry};

/// Share of the end of a run by which a time may be rounded.
const ROUNDING: f64 = 1e-9;

/// The places whose temperatures a model computes: parts and probes of a scene, or nodes of a network file. The column of a place is its number in this order.
pub(super) struct Places {
    pub(super) parts: Vec<String>,
    pub(super) probes: Vec<String>,
    pub(super) nodes: Vec<String>,
    /// Time of the last row that a model computes [s].
    pub(super) end: f64,
    /// Date of time 0.
    pub(super) start: Option<Epoch>,
}

impl Places {
    fn column(&self, place: &SensorPlace) -> Result<usize, String> {
        let (kind, name, names, first) = match place {
            SensorPlace::Part(name) => ("part", name, &self.parts, 0),
            SensorPlace::Probe(name) => ("probe", name, &self.probes, self.parts.len()),
            SensorPlace::Node(name) => ("node", name, &self.nodes, 0),
            SensorPlace::Position(_) => return Err("a network file has no places: state a node".to_owned()),
        };
        let place = names.iter().position(|known| known == name).map(|place| first + place);
        place.ok_or_else(|| match names.is_empty() {
            true => format!("the model has no {kind}s"),
            false => format!("there is no {kind} '{name}'{}", suggestion(name, names.iter().map(String::as_str))),
        })
    }

    /// The place that has the name of a sensor itself.
    fn by_name(&self, name: &str) -> Option<SensorPlace> {
        let knows = |names: &[String]| names.iter().any(|known| known == name);
        let own = || name.to_owned();
        if knows(&self.probes) {
            return Some(SensorPlace::Probe(own()));
        }
        if knows(&self.parts) {
            return Some(SensorPlace::Part(own()));
        }
        knows(&self.nodes).then(|| SensorPlace::Node(own()))
    }

    fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.probes.iter().chain(&self.parts).chain(&self.nodes).map(String::as_str)
    }
}

fn describe(place: &SensorPlace) -> String {
    match place {
        SensorPlace::Part(name) => format!("part {name}"),
        SensorPlace::Probe(name) => format!("probe {name}"),
        SensorPlace::Node(name) => format!("node {name}"),
        SensorPlace::Position(place) => format!("position {place}"),
    }
}

/// Reads tables of telemetry. Returns the measured values and the column of each group.
///
/// # Errors
/// A wrong table, a sensor without a place or without rows, or a time outside the run.
pub(super) fn read(
    input: &FitInput,
    tables: &[PathBuf],
    places: &Places,
) -> Result<(Measurements, Vec<usize>), FittingError> {
    for rule in &input.sensors {
        places.column(&rule.place).map_err(|message| input.error(rule.line, "sensor.name", message))?;
    }
    let mut measurements = Measurements::default();
    let mut columns = Vec::new();
    for path in tables {
        for row in read_telemetry(path, places.start)? {
            let rule = input.sensors.iter().find(|rule| rule.name == row.sensor);
            let group = match measurements.groups.iter().position(|group| group.name == row.sensor) {
                Some(group) => group,
                None => {
                    let place = place_of(path, &row, rule, places)?;
                    columns.push(places.column(&place).map_err(|message| at(path, &row, "sensor", message))?);
                    let (kind, name) = ("sensor", row.sensor.clone());
                    measurements.groups.push(MeasuredGroup { kind, name, place: describe(&place) });
                    columns.len() - 1
                }
            };
            measurements.points.push(point(path, &row, rule, (group, places.end))?);
        }
    }
    let named = |rule: &&SensorRule| measurements.groups.iter().any(|group| group.name == rule.name);
    if let Some(idle) = input.sensors.iter().find(|rule| !named(rule)) {
        let near = suggestion(&idle.name, measurements.groups.iter().map(|group| group.name.as_str()));
        let message = format!("no measured row is of sensor '{}'{near}", idle.name);
        return Err(input.error(idle.line, "sensor.name", message).into());
    }
    Ok((measurements, columns))
}

fn at(path: &Path, row: &TelemetryRow, key: &str, message: String) -> SceneError {
    SceneError::Value { path: path.to_path_buf(), line: row.line, key: key.to_owned(), message }
}

fn place_of(
    path: &Path,
    row: &TelemetryRow,
    rule: Option<&SensorRule>,
    places: &Places,
) -> Result<SensorPlace, SceneError> {
    let stated = rule.map(|rule| rule.place.clone()).or_else(|| places.by_name(&row.sensor));
    stated.ok_or_else(|| {
        let near = suggestion(&row.sensor, places.names());
        let message = format!("no [[sensor]] says where '{}' is, and no place has this name{near}", row.sensor);
        at(path, row, "sensor", message)
    })
}

fn point(
    path: &Path,
    row: &TelemetryRow,
    rule: Option<&SensorRule>,
    (group, end): (usize, f64),
) -> Result<MeasuredPoint, SceneError> {
    if !(0.0..=end * (1.0 + ROUNDING)).contains(&row.time) {
        let message = format!("{} s lies outside the run, which goes from 0 to {end} s", row.time);
        return Err(at(path, row, "time", message));
    }
    let sigma = row.sigma.or(rule.and_then(|rule| rule.sigma)).ok_or_else(|| {
        let message = format!("is missing for sensor '{}': a column sigma, or sensor.sigma [K]", row.sensor);
        at(path, row, "sigma", message)
    })?;
    Ok(MeasuredPoint { group, time: row.time, value: row.temperature, sigma, held_out: false })
}
