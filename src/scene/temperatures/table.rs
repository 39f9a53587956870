//! Reads temperatures from CSV: a row for each node and time, or a column for each node.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;

use super::solution::{HOTTEST, Solution, SolvedNode};
use crate::environment::scene_time::SceneTime;
use crate::scene::error::SceneError;
use crate::text::plain;

const NAMED: usize = 20;

pub(super) fn refuse(path: &Path, line: u64, key: &str, message: impl std::fmt::Display) -> SceneError {
    let (key, message) = (plain(key).into_owned(), plain(&message.to_string()).into_owned());
    SceneError::Value { path: path.to_path_buf(), line: line as usize, key, message }
}

pub(super) fn reader(text: &str) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).flexible(true).from_reader(text.as_bytes())
}

/// Place of the first column with one of the names.
pub(super) fn column(headers: &csv::StringRecord, names: &[&str]) -> Option<usize> {
    headers.iter().position(|header| names.iter().any(|name| header.eq_ignore_ascii_case(name)))
}

fn number(path: &Path, line: u64, key: &str, cell: &str) -> Result<f64, SceneError> {
    let parsed = cell.parse::<f64>().ok().filter(|value| value.is_finite());
    parsed.ok_or_else(|| refuse(path, line, key, format!("'{cell}' is not a number")))
}

/// A cell as a time [s].
fn time_of(path: &Path, line: u64, cell: &str) -> Result<f64, SceneError> {
    let time = SceneTime::new(number(path, line, "time", cell)?);
    time.map(SceneTime::seconds).map_err(|error| refuse(path, line, "time", error))
}

/// A cell as a temperature [K], where `zero` [K] is 0 of its unit.
fn temperature(path: &Path, line: u64, key: &str, cell: &str, zero: f64) -> Result<f64, SceneError> {
    let kelvin = number(path, line, key, cell)? + zero;
    if (0.0..=HOTTEST).contains(&kelvin) {
        return Ok(kelvin);
    }
    Err(refuse(path, line, key, format!("is {kelvin} K; a temperature is from 0 to {HOTTEST} K (temperatures.unit)")))
}

/// The name that a table of isotherm has guarded with an apostrophe against spreadsheets.
fn unguarded(name: &str) -> &str {
    match name.strip_prefix('\'') {
        Some(rest) if rest.starts_with(['=', '+', '-', '@']) => rest,
        _ => name,
    }
}

/// Reads a table. `zero` [K] is 0 of its unit.
pub(super) fn parse(text: &str, path: &Path, zero: f64) -> Result<Solution, SceneError> {
    let mut reader = reader(text);
    let headers = reader.headers().map_err(|error| refuse(path, 1, "header", error))?.clone();
    let records = reader.records().map(|record| {
        let record = record.map_err(|error| refuse(path, 1, "row", error))?;
        Ok((record.position().map_or(0, csv::Position::line), record))
    });
    let records = records.collect::<Result<Vec<_>, SceneError>>()?;
    if records.is_empty() {
        return Err(refuse(path, 1, "row", "is missing: the table is empty"));
    }
    let node = column(&headers, &["node", "part"]);
    let value = column(&headers, &["temperature", "T"]);
    match (node, value) {
        (Some(node), Some(value)) => long(&headers, &records, [node, value], path, zero),
        _ if headers.get(0).is_some_and(|first| first.eq_ignore_ascii_case("time")) && headers.len() > 1 => {
            wide(&headers, &records, path, zero)
        }
        _ => {
            let message = "must have the columns node and temperature, with time, x, y and z where they are known; or \
                           time and a column for each node";
            Err(refuse(path, 1, "header", message))
        }
    }
}

/// `time`, and a column for each node.
fn wide(
    headers: &csv::StringRecord,
    records: &[(u64, csv::StringRecord)],
    path: &Path,
    zero: f64,
) -> Result<Solution, SceneError> {
    let named = |name: &str| SolvedNode { name: unguarded(name).to_owned(), label: String::new(), place: None };
    let nodes: Vec<SolvedNode> = headers.iter().skip(1).map(named).collect();
    if let Some(at) = (1..nodes.len()).find(|at| nodes[..*at].iter().any(|node| node.name == nodes[*at].name)) {
        return Err(refuse(path, 1, "header", format!("two columns are named '{}'", nodes[at].name)));
    }
    let (mut times, mut temperatures): (Vec<f64>, _) = (Vec::new(), Vec::new());
    for (line, record) in records {
        let time = time_of(path, *line, record.get(0).unwrap_or(""))?;
        if times.last().is_some_and(|last| *last >= time) {
            return Err(refuse(path, *line, "time", format!("{time} s does not come after the row before")));
        }
        if record.len() != headers.len() {
            let message = format!("has {} cells below {} headers", record.len(), headers.len());
            return Err(refuse(path, *line, "row", message));
        }
        times.push(time);
        for (node, cell) in nodes.iter().zip(record.iter().skip(1)) {
            temperatures.push(temperature(path, *line, &node.name, cell, zero)?);
        }
    }
    Ok(Solution { nodes, times, temperatures, notes: Vec::new() })
}

/// A row for each node and time.
fn long(
    headers: &csv::StringRecord,
    records: &[(u64, csv::StringRecord)],
    [node, value]: [usize; 2],
    path: &Path,
    zero: f64,
) -> Result<Solution, SceneError> {
    let (time, label) = (column(headers, &["time"]), column(headers, &["label"]));
    let axes = ["x", "y", "z"].map(|axis| column(headers, &[axis]));
    let placed = match axes {
        [Some(x), Some(y), Some(z)] => Some([x, y, z]),
        [None, None, None] => None,
        _ => return Err(refuse(path, 1, "header", "must have all of x, y and z, or none")),
    };
    let mut numbers: HashMap<String, usize> = HashMap::new();
    let (mut nodes, mut samples): (Vec<SolvedNode>, Vec<Vec<(f64, f64)>>) = (Vec::new(), Vec::new());
    for (line, record) in records {
        let cell = |column: usize| record.get(column).unwrap_or("");
        let name = unguarded(cell(node));
        if name.is_empty() {
            return Err(refuse(path, *line, "node", "is empty"));
        }
        let place = match placed {
            None => None,
            Some(columns) => {
                let [x, y, z] = columns.map(|column| number(path, *line, &headers[column], cell(column)));
                Some(DVec3::new(x?, y?, z?))
            }
        };
        let number_of = *numbers.entry(name.to_owned()).or_insert_with(|| {
            let label = label.map(|column| cell(column).to_owned()).unwrap_or_default();
            nodes.push(SolvedNode { name: name.to_owned(), label, place });
            samples.push(Vec::new());
            nodes.len() - 1
        });
        if nodes[number_of].place != place {
            return Err(refuse(path, *line, "x", format!("node '{name}' has another place in an earlier row")));
        }
        let at = time.map_or(Ok(0.0), |column| time_of(path, *line, cell(column)))?;
        let kelvin = temperature(path, *line, "temperature", cell(value), zero)?;
        if samples[number_of].last().is_some_and(|(last, _)| *last >= at) {
            return Err(refuse(
                path,
                *line,
                "time",
                format!("{at} s of node '{name}' does not come after its row before"),
            ));
        }
        samples[number_of].push((at, kelvin));
    }
    let mut times: Vec<f64> = samples.iter().flatten().map(|(time, _)| *time).collect();
    times.sort_unstable_by(f64::total_cmp);
    times.dedup();
    let short: Vec<&str> = nodes
        .iter()
        .zip(&samples)
        .filter(|(_, samples_of_node)| samples_of_node.len() < times.len())
        .map(|(node, _)| &*node.name)
        .collect();
    let mut notes = Vec::new();
    if !short.is_empty() {
        let listed = short[..short.len().min(NAMED)].join(", ");
        let more = if short.len() > NAMED { ", .." } else { "" };
        notes.push(format!(
            "{} of {} nodes lack some of the {} times; their temperatures are linear across the gaps, and held before their \
             first time and after their last: {listed}{more}.",
            short.len(),
            nodes.len(),
            times.len()
        ));
    }
    let temperatures =
        times.iter().flat_map(|time| samples.iter().map(|samples_of_node| between(samples_of_node, *time))).collect();
    Ok(Solution { nodes, times, temperatures, notes })
}

/// The value of a line through points at a time, held beyond its ends.
fn between(points: &[(f64, f64)], time: f64) -> f64 {
    let next = points.partition_point(|(known, _)| *known < time);
    match (next.checked_sub(1).map(|last| points[last]), points.get(next)) {
        (Some((from, before)), Some((to, after))) => before + (after - before) * (time - from) / (to - from),
        (Some((_, before)), None) => before,
        (None, Some((_, after))) => *after,
        (None, None) => 0.0,
    }
}
