//! Converts the thermal CSV files of s2e-core (ut-issl/s2e-core, `src/dynamics/thermal`) to a network file.

use std::fmt::Write;
use std::path::Path;

use super::write::quoted;
use crate::files;
use crate::text::plain;

const CELSIUS: f64 = 273.15;

/// A network file, and notes about missing values.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// Text of the network file.
    pub text: String,
    /// One sentence for each assumption and omission.
    pub(crate) notes: Vec<String>,
}

/// A row of node.csv.
struct S2eNode {
    id: String,
    label: String,
    kind: &'static str,
    heater: usize,
    capacity: f64,
    temperature: f64,
}

/// Reads the files of `folder`.
///
/// # Errors
/// A message with file and line if a file is missing or invalid.
pub(crate) fn import(folder: &Path) -> Result<Imported, String> {
    let read = |file: &str| {
        let path = folder.join(file);
        if !path.exists() {
            return Ok(None);
        }
        files::read_text(&path).map(Some).map_err(|fault| format!("{}: cannot be read: {fault}", path.display()))
    };
    convert(&Files { folder, read: &read })
}

/// The files of a folder, by name. A file that is absent has no text.
pub struct Files<'a> {
    /// The folder that messages name.
    pub folder: &'a Path,
    /// Text of a file.
    pub read: &'a dyn Fn(&str) -> Result<Option<String>, String>,
}

impl Files<'_> {
    fn path(&self, file: &str) -> String {
        self.folder.join(file).display().to_string()
    }
}

/// Converts the texts of the files.
///
/// # Errors
/// As for [`import`].
pub fn convert(folder: &Files) -> Result<Imported, String> {
    let mut notes = vec![
        "Solar heat on node normals (alpha, area) is left out: add it as heat tables.".to_owned(),
        "Output times are left for you to add: [output] times.".to_owned(),
    ];
    let nodes = nodes(folder)?;
    let heaters = heaters(folder)?;
    let loads = loads(folder, &nodes)?;
    let mut text = "# From the thermal CSV files of s2e-core.\n".to_owned();
    for (node, load) in nodes.iter().zip(&loads) {
        let _ = write!(text, "\n[[node]]\nlabel = {}\nkind = \"{}\"\n", quoted(&node.label), node.kind);
        if node.kind == "diffusive" {
            let _ = writeln!(text, "capacitance = {:?}", node.capacity);
        }
        let _ = writeln!(text, "temperature = {:?}", node.temperature);
        if let Some((times, powers)) = load.as_ref().filter(|(_, powers)| powers.iter().any(|power| *power != 0.0)) {
            let _ = writeln!(text, "heat = {{ time = {times:?}, power = {powers:?} }}");
            notes.push(format!(
                "The heat of '{}' holds after {:?} s, where s2e-core repeats its table.",
                node.label,
                times.last().unwrap_or(&0.0)
            ));
        }
    }
    for (file, section, key) in
        [("cij.csv", "linear_conductor", "conductance"), ("rij.csv", "radiative_conductor", "exchange_area")]
    {
        let matrix = matrix(folder, file, nodes.len())?;
        for a in 0..nodes.len() {
            for b in a + 1..nodes.len() {
                let value = matrix[a][b];
                if value != matrix[b][a] {
                    return Err(format!(
                        "{}: '{}' to '{}' is {value}, the way back {}: a conductor has one value",
                        folder.path(file),
                        nodes[a].label,
                        nodes[b].label,
                        matrix[b][a]
                    ));
                }
                if value != 0.0 {
                    let (a, b) = (quoted(&nodes[a].label), quoted(&nodes[b].label));
                    let _ = write!(text, "\n[[{section}]]\nnodes = [{a}, {b}]\n{key} = {value:?}\n");
                }
            }
        }
    }
    for node in nodes.iter().filter(|node| node.heater > 0) {
        let Some([power, lower, upper]) = heaters.get(node.heater - 1) else {
            let path = folder.path("heaters.csv");
            return Err(format!("{}: has no heater {}, which '{}' names", path, node.heater, node.label));
        };
        let (label, name, on, off) = (&node.label, quoted(&node.label), lower + CELSIUS, upper + CELSIUS);
        let _ = write!(
            text,
            "\n[[thermostat]]\nnode = {name}\nsensor = {name}\npower = {power:?}\non_below = {on:?}\n\
             off_above = {off:?}\ninitially_on = false\n"
        );
        notes.push(format!(
            "The thermostat of '{label}' is off at time 0 and switches at its thresholds, not once a step."
        ));
    }
    Ok(Imported { text, notes })
}

/// The records of a file after its header, each with its line. `None` if there is no such file.
fn records(folder: &Files, file: &str) -> Result<Option<Vec<(u64, csv::StringRecord)>>, String> {
    let Some(text) = (folder.read)(file)? else { return Ok(None) };
    let wrong = |error: csv::Error| format!("{}: {error}", folder.path(file));
    let mut reader =
        csv::ReaderBuilder::new().has_headers(false).trim(csv::Trim::All).flexible(true).from_reader(text.as_bytes());
    let rows = reader.records().map(|record| {
        let record = record.map_err(wrong)?;
        Ok((record.position().map_or(0, csv::Position::line), record))
    });
    rows.collect::<Result<Vec<_>, String>>().map(Some)
}

fn needed(folder: &Files, file: &str) -> Result<Vec<(u64, csv::StringRecord)>, String> {
    records(folder, file)?.ok_or_else(|| format!("{}: cannot be read: there is no such file", folder.path(file)))
}

fn number(folder: &Files, file: &str, line: u64, record: &csv::StringRecord, column: usize) -> Result<f64, String> {
    let cell = record.get(column).unwrap_or("");
    cell.parse::<f64>()
        .ok()
        .filter(|value| value.is_finite())
        .ok_or_else(|| format!("{}:{line}: column {}: '{cell}' is not a number", folder.path(file), column + 1))
}

/// node.csv: a header, then id, label, type (0 diffusive, 1 boundary, 2 arithmetic), heater, capacity, alpha, epsilon,
/// area, normal, temperature.
fn nodes(folder: &Files) -> Result<Vec<S2eNode>, String> {
    let file = "node.csv";
    let rows = needed(folder, file)?;
    let header = rows.first().map(|(_, header)| header.iter().map(str::to_lowercase).collect::<Vec<_>>());
    let header = header.unwrap_or_default();
    let column = |part: &str| {
        header
            .iter()
            .position(|name| name.contains(part))
            .ok_or_else(|| format!("{}:1: no column of the header is named like '{part}'", folder.path(file)))
    };
    let (id, label, kind) = (column("node_id")?, column("label")?, column("node_type")?);
    let (heater, capacity, temperature) = (column("heater")?, column("capacity")?, column("temperature")?);
    let mut nodes = Vec::new();
    for (line, record) in rows.iter().skip(1) {
        let number = |column| number(folder, file, *line, record, column);
        let kind = match number(kind)? {
            0.0 => "diffusive",
            1.0 => "boundary",
            2.0 => "arithmetic",
            other => {
                return Err(format!("{}:{line}: node type {other} is none of 0, 1, 2", folder.path(file)));
            }
        };
        let text = |column: usize| plain(record.get(column).unwrap_or("")).into_owned();
        nodes.push(S2eNode {
            id: text(id),
            label: text(label),
            kind,
            heater: number(heater)?.max(0.0) as usize,
            capacity: number(capacity)?,
            temperature: number(temperature)?,
        });
    }
    Ok(nodes)
}

/// heaters.csv: id, power [W], lower and upper threshold [degC]. Row n is heater n.
fn heaters(folder: &Files) -> Result<Vec<[f64; 3]>, String> {
    let file = "heaters.csv";
    let rows = records(folder, file)?.unwrap_or_default();
    let row = |(line, record): &(u64, csv::StringRecord)| {
        let number = |column| number(folder, file, *line, record, column);
        Ok([number(1)?, number(2)?, number(3)?])
    };
    rows.iter().skip(1).map(row).collect()
}

type Load = Option<(Vec<f64>, Vec<f64>)>;

/// heatload.csv: times in the header, then a row of powers [W] for each node.
fn loads(folder: &Files, nodes: &[S2eNode]) -> Result<Vec<Load>, String> {
    let file = "heatload.csv";
    let mut loads: Vec<Load> = nodes.iter().map(|_| None).collect();
    let rows = records(folder, file)?.unwrap_or_default();
    let Some((line, header)) = rows.first() else { return Ok(loads) };
    let values = |line: u64, record: &csv::StringRecord| {
        (1..header.len()).map(|column| number(folder, file, line, record, column)).collect::<Result<Vec<_>, _>>()
    };
    let times = values(*line, header)?;
    for (line, record) in rows.iter().skip(1) {
        let id = &*plain(record.get(0).unwrap_or(""));
        let Some(at) = nodes.iter().position(|node| node.id == id) else {
            return Err(format!("{}:{line}: node.csv has no node {id}", folder.path(file)));
        };
        loads[at] = Some((times.clone(), values(*line, record)?));
    }
    Ok(loads)
}

/// cij.csv [W/K] and rij.csv [m2]: a square of values below a header and beside a column of labels.
fn matrix(folder: &Files, file: &str, size: usize) -> Result<Vec<Vec<f64>>, String> {
    let rows = needed(folder, file)?;
    if rows.len() != size + 1 {
        let count = rows.len().saturating_sub(1);
        return Err(format!("{}: has {count} rows for {size} nodes", folder.path(file)));
    }
    let row = |(line, record): &(u64, csv::StringRecord)| {
        (1..=size).map(|column| number(folder, file, *line, record, column)).collect()
    };
    rows.iter().skip(1).map(row).collect()
}
