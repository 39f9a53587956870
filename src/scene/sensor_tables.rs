//! Tables of numbers that `[sensor]` names: a measured point spread, and a map of vignetting.

use std::path::Path;

use crate::files;
use crate::thermal::sensor::spread::{MOST_RADIUS, Spread};

/// A measured point spread: a CSV file with as many rows as columns, an odd number, no weight below 0.
pub(super) fn kernel(path: &Path) -> Result<Spread, String> {
    let rows = numbers(path)?;
    let side = rows.len();
    if side.is_multiple_of(2) || !(3..=2 * MOST_RADIUS + 1).contains(&side) {
        return Err(format!("has {side} rows: a kernel has an odd number from 3 to {}", 2 * MOST_RADIUS + 1));
    }
    if let Some((row, line)) = rows.iter().enumerate().find(|(_, line)| line.len() != side) {
        return Err(format!(
            "row {} has {} numbers, and the kernel has {side} rows: both must be the same",
            row + 1,
            line.len()
        ));
    }
    let weights: Vec<f64> = rows.concat();
    if let Some(weight) = weights.iter().find(|weight| **weight < 0.0) {
        return Err(format!("has the weight {weight}: none may be below 0"));
    }
    if !(1e-30..=1e30).contains(&weights.iter().sum::<f64>()) {
        return Err("has weights whose sum is 0 or beyond reason".to_owned());
    }
    Ok(Spread::measured(side / 2, &weights))
}

/// Shares of the light: a CSV file with a row of numbers for each row of pixels, each above 0 and at most 1.
pub(super) fn map(path: &Path, [width, height]: [usize; 2]) -> Result<Vec<f64>, String> {
    let rows = numbers(path)?;
    if rows.len() != height {
        return Err(format!("has {} rows, and the image has {height}", rows.len()));
    }
    for (row, line) in rows.iter().enumerate() {
        if line.len() != width {
            return Err(format!("row {} has {} numbers, and the image has {width} columns", row + 1, line.len()));
        }
        if let Some((column, share)) = line.iter().enumerate().find(|(_, share)| !(1e-3..=1.0).contains(*share)) {
            return Err(format!("row {}, column {}: a share is from 0.001 to 1, found {share}", row + 1, column + 1));
        }
    }
    Ok(rows.concat())
}

/// The numbers of a CSV file without a header.
fn numbers(path: &Path) -> Result<Vec<Vec<f64>>, String> {
    let text = files::read_text(path).map_err(|fault| format!("{}: cannot be read: {fault}", path.display()))?;
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let row = |(number, line): (usize, &str)| {
        let number = number + 1;
        let one = |word: &str| match word.trim().parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(format!("line {number}: '{}' is no finite number", crate::text::plain(word.trim()))),
        };
        line.split(',').map(one).collect::<Result<Vec<f64>, String>>()
    };
    lines.map(row).collect()
}
