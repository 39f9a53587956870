//! Temperatures over time: a row for each step, with columns for parts, materials, the whole craft and probes.

use std::collections::HashSet;
use std::io::{self, Write};

use super::OutputError;
use super::csv_rows::write_rows;
use super::statistics::Summary;

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
    let mut record = vec![row.time.to_string()];
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
pub(crate) mod tests {
    use super::*;

    /// A series of parts and materials that heat and cool smoothly over an orbit.
    pub(crate) fn orbit(parts: usize, materials: usize, probes: usize) -> TemperatureSeries {
        let names = |prefix: &str, count: usize| (0..count).map(|i| format!("{prefix}_{i}")).collect::<Vec<_>>();
        let mut series =
            TemperatureSeries::new(&names("B0_module", parts), &names("mat", materials), &names("probe", probes));
        for step in 0..=360 {
            let time = f64::from(step) * 15.5;
            let mean = |i: usize| {
                let swing = 15.0 + 9.0 * i as f64;
                260.0 + 3.0 * i as f64 + swing * (time / 5580.0 * std::f64::consts::TAU + 0.3 * i as f64).cos()
            };
            let summary = |i: usize| {
                let mean = mean(i);
                Some(Summary { min: mean as f32 - 12.0, mean, max: mean as f32 + 6.0 + i as f32 })
            };
            let row = SeriesRow {
                time,
                all: summary(0),
                parts: (0..parts).map(summary).collect(),
                materials: (0..materials).map(summary).collect(),
                probes: (0..probes).map(|i| mean(i) as f32).collect(),
            };
            series.push(row).unwrap();
        }
        series
    }

    pub(crate) fn text(series: &TemperatureSeries) -> String {
        let mut bytes = Vec::new();
        series.write(&mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(|&name| name.to_owned()).collect()
    }

    #[test]
    fn the_file_has_the_columns_and_numbers_that_are_promised() {
        let mut series = TemperatureSeries::new(&names(&["hull, left"]), &names(&["a", "a"]), &names(&["tip"]));
        let summary = Some(Summary { min: 2.7, mean: 100.123_456_789, max: 200.5 });
        let row = SeriesRow {
            time: 16.5,
            all: summary,
            parts: vec![summary],
            materials: vec![summary, None],
            probes: vec![0.1],
        };
        series.push(row.clone()).unwrap();
        let expected = "time,\"part:hull, left:min\",\"part:hull, left:mean\",\"part:hull, left:max\",\
            material:a:min,material:a:mean,material:a:max,material:a#2:min,material:a#2:mean,material:a#2:max,\
            all:min,all:mean,all:max,probe:tip\n\
            16.5,2.7,100.123457,200.5,2.7,100.123457,200.5,,,,2.7,100.123457,200.5,0.1\n";
        assert_eq!(text(&series), expected);

        let wrong = SeriesRow { probes: vec![], ..row };
        let error = series.push(wrong).unwrap_err();
        assert_eq!(error.to_string(), "series row at 16.5 s has 0 probe values for 1 probe columns");
    }

    #[test]
    fn names_become_unique_without_stealing_another_name() {
        let made = unique(&names(&["a", "a#2", "a", "a", "b"]));
        assert_eq!(made, ["a", "a#2", "a#3", "a#4", "b"]);
    }

    #[test]
    fn a_series_without_rows_or_groups_is_a_header() {
        assert_eq!(text(&TemperatureSeries::new(&[], &[], &[])), "time,all:min,all:mean,all:max\n");
    }
}
