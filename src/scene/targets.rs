//! Reads targets by step: a CSV file with the columns step and target.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::files;

/// Highest temperature of a scene [K], whose fourth power still fits an f32.
const HOTTEST: f64 = 1e6;
/// Most steps of a response. A larger number is probably a mistake.
pub(crate) const MAX_STEPS: u32 = 10_000_000;

/// An error in a file of targets.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{}: {message}", path.display())]
pub struct TargetsError {
    pub(crate) path: PathBuf,
    /// Row, column, fault and valid values.
    pub(crate) message: String,
}

/// A row of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetRow {
    pub(crate) step: u32,
    /// Temperature [K].
    pub(crate) target: f64,
}

/// Reads and checks a file of targets.
///
/// # Errors
/// A file that cannot be read, and everything that [`parse`] refuses.
pub(crate) fn load(path: &Path) -> Result<Vec<TargetRow>, TargetsError> {
    let wrong = |message: String| TargetsError { path: path.to_path_buf(), message };
    parse(&files::read_text_or_pipe(path).map_err(|error| wrong(format!("cannot be read: {error}")))?, path)
}

/// Checks the text of a file of targets as if it lay at `path`.
///
/// # Errors
/// The first error, with its row and column.
pub fn parse(text: &str, path: &Path) -> Result<Vec<TargetRow>, TargetsError> {
    let wrong = |message: String| TargetsError { path: path.to_path_buf(), message };
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).flexible(true).from_reader(text.as_bytes());
    let headers = reader.headers().map_err(|error| wrong(error.to_string()))?.clone();
    let column = |name: &str| {
        let column = headers.iter().position(|header| header.eq_ignore_ascii_case(name));
        column.ok_or_else(|| wrong(format!("row 1: must name the columns step and target; there is no '{name}'")))
    };
    let (step, target) = (column("step")?, column("target")?);
    let mut rows: Vec<TargetRow> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| wrong(error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let in_row = |message: String| wrong(format!("row {line}: {message}"));
        let (step, target) = (record.get(step).unwrap_or(""), record.get(target).unwrap_or(""));
        let row = TargetRow {
            step: step
                .parse()
                .ok()
                .filter(|step| *step <= MAX_STEPS)
                .ok_or_else(|| in_row(format!("step: '{step}' is no whole number from 0 to {MAX_STEPS}")))?,
            target: parse_temperature(target).map_err(|message| in_row(format!("target: {message}")))?,
        };
        if rows.last().is_some_and(|last| last.step >= row.step) {
            return Err(in_row(format!("step {step} does not come after the one before: steps must rise")));
        }
        rows.push(row);
    }
    if rows.is_empty() { Err(wrong("has no rows".to_owned())) } else { Ok(rows) }
}

/// The target of every step from 1 to `steps` [K].
pub(crate) fn commanded(rows: &[TargetRow], initial: f64, steps: u32) -> Vec<f64> {
    let mut rows = rows.iter().peekable();
    let mut target = initial;
    (1..=steps)
        .map(|step| {
            while let Some(row) = rows.next_if(|row| row.step <= step) {
                target = row.target;
            }
            target
        })
        .collect()
}

/// Parses a temperature [K] in the range of a scene.
///
/// # Errors
/// A message if the text is not a number or is out of range.
pub(crate) fn parse_temperature(text: &str) -> Result<f64, String> {
    let temperature: f64 = text.trim().parse().map_err(|_| format!("'{text}' is not a number"))?;
    if !(0.0..=HOTTEST).contains(&temperature) {
        return Err(format!("a temperature is from 0 to {HOTTEST} K, not {text}"));
    }
    Ok(temperature)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_hold_until_the_next_row() {
        let rows = [TargetRow { step: 2, target: 10.0 }, TargetRow { step: 4, target: 20.0 }];
        assert_eq!(commanded(&rows, 5.0, 6), [5.0, 10.0, 10.0, 20.0, 20.0, 20.0]);
        assert_eq!(commanded(&[TargetRow { step: 0, target: 7.0 }], 5.0, 2), [7.0, 7.0]);
        assert_eq!(commanded(&rows, 5.0, 1), [5.0]);
    }

    #[test]
    fn bad_targets_say_which_row() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("targets.csv");
        for (text, reason) in [
            ("step,target\n1,267\n1,300\n", "row 3: step 1 does not come after"),
            ("step,target\n1,nan\n", "row 2: target: a temperature is from 0 to 1000000 K"),
            ("step,target\n1,inf\n", "row 2: target: a temperature is from 0 to 1000000 K"),
            ("step,target\n1,-4\n", "from 0 to 1000000 K, not -4"),
            ("step,target\n1.5,4\n", "row 2: step: '1.5' is no whole number"),
            ("step,goal\n1,4\n", "there is no 'target'"),
            ("step,target\n", "has no rows"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = load(&path).unwrap_err().to_string();
            assert!(error.contains(reason) && error.contains("targets.csv"), "{error}");
        }
        assert!(load(&folder.path().join("none.csv")).unwrap_err().to_string().contains("cannot be read"));
    }
}
