//! A trajectory as a CSV table with the columns time, x, y, z and optionally vx, vy, vz.

use std::path::Path;

use glam::DVec3;

use super::super::error::SceneError;
use super::stated::{Options, StateLine, Stated};
use super::text::{FileLine, number};

/// Rows with their line numbers, and the positions of the named columns. The optional columns may all be missing.
pub(in crate::scene) struct Columns<'a> {
    pub(in crate::scene) rows: Vec<(usize, Vec<&'a str>)>,
    required: Vec<usize>,
    optional: Option<Vec<usize>>,
}

/// A row: the first required column as text, the other required numbers, and the optional numbers.
type Cells = (String, Vec<f64>, Option<Vec<f64>>);

impl<'a> Columns<'a> {
    /// Reads a comma-separated table with a header. Lines that start with `#` are comments.
    pub(super) fn read(path: &Path, text: &'a str, required: &[&str], optional: &[&str]) -> Result<Self, SceneError> {
        Self::read_beside(path, text, required, optional, &[])
    }

    /// Reads a table that may also have the columns `beside`, which are ignored.
    pub(in crate::scene) fn read_beside(
        path: &Path,
        text: &'a str,
        required: &[&str],
        optional: &[&str],
        beside: &[&str],
    ) -> Result<Self, SceneError> {
        let mut lines = text
            .lines()
            .enumerate()
            .map(|(index, line)| (index + 1, line.trim_start_matches('\u{feff}').trim()))
            .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
            .map(|(number, line)| (number, line.split(',').map(str::trim).collect::<Vec<_>>()));
        let (line, header) = lines.next().unwrap_or((1, Vec::new()));
        let at = FileLine { path, line };
        let place = |name: &str| header.iter().position(|cell| cell.eq_ignore_ascii_case(name));
        let all = format!(
            "{}{}",
            required.join(","),
            if optional.is_empty() { String::new() } else { format!("[,{}]", optional.join(",")) }
        );
        let find = |names: &[&str]| {
            names
                .iter()
                .map(|name| {
                    place(name).ok_or_else(|| at.error(name, format!("is missing in the header; a table has {all}")))
                })
                .collect::<Result<Vec<_>, _>>()
        };
        let known =
            |cell: &&&str| required.iter().chain(optional).chain(beside).any(|name| name.eq_ignore_ascii_case(cell));
        if !header.iter().any(|cell| known(&cell)) {
            let message =
                format!("begins neither with the header of a table, {all}, nor as another format that is read here");
            return Err(at.error("the file", message));
        }
        if let Some(other) = header.iter().find(|cell| !known(cell)) {
            return Err(at.error(other, format!("is no column that is known here; a table has {all}")));
        }
        let stated = optional.iter().any(|name| place(name).is_some());
        let columns = Self {
            required: find(required)?,
            optional: if stated { Some(find(optional)?) } else { None },
            rows: lines.collect(),
        };
        if let Some((line, row)) = columns.rows.iter().find(|(_, row)| row.len() != header.len()) {
            let message = format!("has {} cells, and the header {}", row.len(), header.len());
            return Err(FileLine { path, line: *line }.error("row", message));
        }
        Ok(columns)
    }

    pub(in crate::scene) fn cells(&self, path: &Path, (line, row): &(usize, Vec<&str>)) -> Result<Cells, SceneError> {
        let time = row[self.required[0]].to_owned();
        let numbers = |places: &[usize]| {
            let read = |place: &usize| {
                number(row[*place]).ok_or_else(|| {
                    let message = format!("'{}' is not a number", row[*place]);
                    FileLine { path, line: *line }.error(&format!("time {time}"), message)
                })
            };
            places.iter().map(read).collect::<Result<Vec<_>, _>>()
        };
        let required = numbers(&self.required[1..])?;
        let optional = self.optional.as_deref().map(numbers).transpose()?;
        Ok((time, required, optional))
    }
}

/// Reads the single segment of a table. The scene must state the frame.
pub(super) fn parse(path: &Path, text: &str, options: &Options) -> Result<Vec<Stated>, SceneError> {
    let columns = Columns::read(path, text, &["time", "x", "y", "z"], &["vx", "vy", "vz"])?;
    let frame = options.frame.clone().ok_or_else(|| {
        let message =
            "is missing: a table needs orbit.frame, one of 'EME2000', 'J2000', 'ICRF', 'GCRF', 'TEME', 'ITRF'";
        FileLine { path, line: 1 }.error("orbit.frame", message)
    })?;
    let mut stated = Stated {
        line: 1,
        frame: Some((1, frame)),
        time_system: Some((1, options.time_system.clone().unwrap_or_else(|| "UTC".to_owned()))),
        ..Stated::default()
    };
    for row in &columns.rows {
        let (epoch, position, velocity) = columns.cells(path, row)?;
        let vector = |numbers: &[f64]| DVec3::new(numbers[0], numbers[1], numbers[2]);
        stated.lines.push(StateLine {
            line: row.0,
            epoch,
            position: vector(&position),
            velocity: velocity.as_deref().map(vector),
        });
    }
    Ok(vec![stated])
}
