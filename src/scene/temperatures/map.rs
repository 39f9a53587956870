//! The table of `temperatures.map`: which nodes belong to which parts.

use std::path::Path;

use super::table::{column, reader, refuse};
use crate::scene::error::SceneError;

/// Rows of patterns of parts and of nodes.
pub(super) fn parse(text: &str, path: &Path) -> Result<Vec<[String; 2]>, SceneError> {
    let mut reader = reader(text);
    let headers = reader.headers().map_err(|error| refuse(path, 1, "header", error))?.clone();
    let needed = |name: &str| {
        let missing = || refuse(path, 1, "header", format!("has no column '{name}'; the columns are part and node"));
        column(&headers, &[name]).ok_or_else(missing)
    };
    let columns = [needed("part")?, needed("node")?];
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| refuse(path, 1, "row", error))?;
        let line = record.position().map_or(0, csv::Position::line);
        let row = columns.map(|column| record.get(column).unwrap_or("").to_owned());
        if row.iter().any(String::is_empty) {
            return Err(refuse(path, line, "row", "needs a part and a node"));
        }
        rows.push(row);
    }
    if rows.is_empty() { Err(refuse(path, 1, "row", "is missing: the table is empty")) } else { Ok(rows) }
}
