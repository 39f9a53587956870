//! A hard case as it was measured, and the table that shows it.

use serde::Serialize;

use super::Case;
use crate::bench::tables::Table;
use crate::output::html::{kelvin, significant};

/// A case on a device.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct HardRow {
    /// Name.
    pub name: String,
    /// What is done, and what is expected.
    pub what: String,
    /// Unit of errors and limit.
    pub unit: String,
    /// Largest error.
    pub error: Option<f64>,
    /// Largest error that is allowed.
    pub limit: f64,
    /// Who says so.
    pub limit_source: String,
    /// Whether the error is within the limit; `None` where nothing was to be measured.
    pub holds: Option<bool>,
    /// What keeps the error below the limit.
    pub remedy: String,
    /// What was done in its place.
    pub removed: String,
    /// The error then; `null` in JSON where no number came out.
    pub without: f64,
    /// Why nothing was to be measured.
    pub omitted: Option<String>,
    /// Why a measurement failed.
    pub failed: Option<String>,
    /// Wall time of the measurement [s].
    pub wall_s: f64,
}

impl HardRow {
    /// A case before it is measured.
    pub fn of(case: &Case, without: f64) -> Self {
        Self {
            name: case.name.clone(),
            what: case.what.clone(),
            unit: case.unit.to_owned(),
            limit: case.limit,
            limit_source: case.source.clone(),
            remedy: case.remedy.to_owned(),
            removed: case.removed.to_owned(),
            without,
            ..Self::default()
        }
    }

    /// A measured value with its unit.
    pub fn in_unit(&self, value: f64) -> String {
        if !value.is_finite() {
            return "no number".to_owned();
        }
        if self.unit == "K" {
            let (value, unit) = kelvin(value);
            return format!("{value} {unit}");
        }
        // Counts are whole.
        let figure = if value.fract() == 0.0 && self.unit != "s" { value.to_string() } else { significant(value) };
        format!("{figure} {}", self.unit)
    }

    /// Whether, how and by how much the limit is missed; `None` where it is not.
    pub fn miss(&self) -> Option<String> {
        if self.holds != Some(false) {
            return None;
        }
        let found = match (&self.failed, self.error) {
            (Some(reason), _) => reason.clone(),
            (None, error) => self.in_unit(error.unwrap_or(f64::INFINITY)),
        };
        Some(format!("{}: {found}, limit {}", self.name, self.in_unit(self.limit)))
    }
}

/// The hard cases of a device; `None` where they were not measured.
pub fn table(device: &str, rows: &[HardRow]) -> Option<Table> {
    if rows.is_empty() {
        return None;
    }
    let cells = |row: &HardRow| {
        let error = match (&row.failed, &row.omitted, row.error) {
            (Some(reason), ..) => format!("failed: {reason}"),
            (None, Some(reason), _) => format!("- ({reason})"),
            (None, None, error) => error.map_or_else(|| "-".to_owned(), |error| row.in_unit(error)),
        };
        let holds = match row.holds {
            Some(true) => "yes",
            Some(false) => "NO",
            None => "-",
        };
        vec![
            row.name.clone(),
            row.what.clone(),
            error,
            format!("{} ({})", row.in_unit(row.limit), row.limit_source),
            holds.to_owned(),
            row.remedy.clone(),
            format!("{} ({})", row.in_unit(row.without), row.removed),
        ]
    };
    let count = |wanted: Option<bool>| rows.iter().filter(|row| row.holds == wanted).count();
    let mut notes = vec![format!(
        "{} hold, {} miss, {} were not to be measured here. {:.0} s.",
        count(Some(true)),
        count(Some(false)),
        count(None),
        rows.iter().map(|row| row.wall_s).sum::<f64>()
    )];
    notes.extend(rows.iter().filter_map(HardRow::miss).map(|miss| format!("Missed: {miss}.")));
    Some(Table {
        title: format!("Hard cases on {device}"),
        head: ["case", "what", "largest error", "limit (source)", "holds", "remedy", "without it (in its place)"]
            .map(str::to_owned)
            .to_vec(),
        rows: rows.iter().map(cells).collect(),
        notes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(error: Option<f64>, failed: Option<&str>) -> HardRow {
        let holds = Some(failed.is_none() && error.is_some_and(|error| error <= 0.02));
        let (name, unit, failed) = ("a case".to_owned(), "K".to_owned(), failed.map(str::to_owned));
        HardRow { name, unit, error, limit: 0.02, holds, failed, without: f64::INFINITY, ..HardRow::default() }
    }

    #[test]
    fn what_misses_says_by_how_much_or_why() {
        assert_eq!(row(Some(0.02), None).miss(), None);
        assert_eq!(row(Some(0.03), None).miss().as_deref(), Some("a case: 30.0 mK, limit 20.0 mK"));
        assert_eq!(row(Some(f64::INFINITY), None).miss().as_deref(), Some("a case: no number, limit 20.0 mK"));
        assert_eq!(row(None, Some("no device")).miss().as_deref(), Some("a case: no device, limit 20.0 mK"));
        let omitted = HardRow { holds: None, omitted: Some("itself".to_owned()), ..row(None, None) };
        assert_eq!(omitted.miss(), None);
    }

    #[test]
    fn the_table_counts_what_holds_and_names_what_misses() {
        let rows = [row(Some(0.01), None), row(Some(0.03), None), HardRow { holds: None, ..row(None, None) }];
        let table = table("a device", &rows).unwrap();
        assert!(table.rows.iter().all(|cells| cells.len() == table.head.len()));
        assert_eq!(table.rows.iter().map(|cells| cells[4].as_str()).collect::<Vec<_>>(), ["yes", "NO", "-"]);
        assert!(table.rows[0][6].starts_with("no number"), "{:?}", table.rows[0]);
        assert!(table.notes[0].starts_with("1 hold, 1 miss, 1 were not"), "{:?}", table.notes);
        assert!(table.notes[1].contains("a case: 30.0 mK"), "{:?}", table.notes);
        assert_eq!(super::table("a device", &[]), None);
    }

    #[test]
    fn counts_are_whole_and_others_have_three_digits() {
        let of = |unit: &str, value| HardRow { unit: unit.to_owned(), ..HardRow::default() }.in_unit(value);
        assert_eq!(of("accepted", 272.0), "272 accepted");
        assert_eq!(of("s", 100.0), "100 s");
        assert_eq!(of("K", 2.0e-4), "200 \u{b5}K");
    }
}
