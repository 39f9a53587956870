//! Temperatures over time: a row for each step, with columns for parts, materials, the whole craft and probes.

use std::collections::HashSet;
use std::io::{self, Write};

use super::OutputError;
use super::csv_rows::write_rows;
use super::statistics::Summary;
use crate::text::time_of_step;

/// Temperatures of one step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SeriesRow {
    /// Time since the start [s].
    pub(crate) time: f64,
    pub(crate) all: Option<Summary>,
    pub(crate) parts: Vec<Option<Summary>>,
    pub(crate) materials: Vec<Option<Summary>>,
    /// Each probe [K].
    pub(crate) probes: Vec<f32>,
}

/// Rows and the names of their columns.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TemperatureSeries {
    parts: Vec<String>,
    materials: Vec<String>,
    probes: Vec<String>,
    rows: Vec<SeriesRow>,
}

impl TemperatureSeries {
    /// An empty series. Repeated names get `#2`, `#3`, so that every column has its own name.
    pub(crate) fn new(parts: &[String], materials: &[String], probes: &[String]) -> Self {
        Self { parts: unique(parts), materials: unique(materials), probes: unique(probes), rows: vec![] }
    }

    /// Adds the row of a step.
    ///
    /// # Errors
    /// The row lacks a value for a column.
    pub(crate) fn push(&mut self, row: SeriesRow) -> Result<(), OutputError> {
        self.check(&row)?;
        self.rows.push(row);
        Ok(())
    }

    fn check(&self, row: &SeriesRow) -> Result<(), OutputError> {
        let groups = [
            ("part", row.parts.len(), self.parts.len()),
            ("material", row.materials.len(), self.materials.len()),
            ("probe", row.probes.len(), self.probes.len()),
        ];
        for (group, values, columns) in groups {
            if values != columns {
                let time = row.time;
                let reason =
                    format!("series row at {time} s has {values} {group} values for {columns} {group} columns");
                return Err(OutputError::Mismatch(reason));
            }
        }
        Ok(())
    }

    pub(crate) fn parts(&self) -> &[String] {
        &self.parts
    }

    pub(crate) fn materials(&self) -> &[String] {
        &self.materials
    }

    pub(crate) fn probes(&self) -> &[String] {
        &self.probes
    }

    /// The rows, in the order in which they were added.
    pub(crate) fn rows(&self) -> &[SeriesRow] {
        &self.rows
    }

    /// The cells of a row in the file, without keeping the row.
    ///
    /// # Errors
    /// The row lacks a value for a column.
    pub(crate) fn cells(&self, row: &SeriesRow) -> Result<Vec<String>, OutputError> {
        self.check(row)?;
        Ok(cells(row))
    }

    /// Writes the content of `series.csv`: `time` [s], then `part:NAME:min`, `:mean`, `:max` [K] for each part, the same for each
    /// `material:NAME` and for `all`, then `probe:NAME` [K]. A group without area has empty cells. Means have six
    /// decimals. Other numbers have the fewest digits that read back to the same f32 (`min`, `max`, probes) or f64
    /// (`time`).
    pub(crate) fn write(&self, writer: impl Write) -> io::Result<()> {
        write_rows(writer, std::iter::once(self.column_names()).chain(self.rows.iter().map(cells)))
    }

    pub(crate) fn column_names(&self) -> Vec<String> {
        let three = |prefix: String| ["min", "mean", "max"].map(|which| format!("{prefix}:{which}"));
        let parts = self.parts.iter().flat_map(|name| three(format!("part:{name}")));
        let materials = self.materials.iter().flat_map(|name| three(format!("material:{name}")));
        let probes = self.probes.iter().map(|name| format!("probe:{name}"));
        let time = std::iter::once("time".to_owned());
        time.chain(parts).chain(materials).chain(three("all".to_owned())).chain(probes).collect()
    }
}

fn cells(row: &SeriesRow) -> Vec<String> {
    let mut record = vec![time_of_step(row.time)];
    for summary in row.parts.iter().chain(&row.materials).chain([&row.all]) {
        match summary {
            Some(Summary { min, mean, max }) => {
                record.extend([min.to_string(), format!("{mean:.6}"), max.to_string()]);
            }
            None => record.extend(vec![String::new(); 3]),
        }
    }
    record.extend(row.probes.iter().map(f32::to_string));
    record
}

/// Makes names unique: a repeated name gets the first free suffix `#2`, `#3`.
pub(super) fn unique(names: &[String]) -> Vec<String> {
    let given: HashSet<&String> = names.iter().collect();
    let mut used = HashSet::new();
    let mut result = Vec::with_capacity(names.len());
    for name in names {
        let mut candidate = name.clone();
        let mut suffix = 2;
        while used.contains(&candidate) || (candidate != *name && given.contains(&candidate)) {
            candidate = format!("{name}#{suffix}");
            suffix += 1;
        }
        used.insert(candidate.clone());
        result.push(candidate);
    }
    result
}

#[cfg(test)]
pub(crate) mod tests;
