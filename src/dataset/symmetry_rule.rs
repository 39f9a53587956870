//! Symmetries of the craft as a SPEC states them.

use glam::DVec3;

use super::reader::SpecTable;
use crate::labels::symmetry::{Symmetry, SymmetryTurns};
use crate::scene::SceneError;

/// Keys of `[[symmetry]]`.
pub(crate) const SYMMETRY: &[&str] = &["kind", "axis", "origin", "count", "object", "tolerance"];

/// Most turns about an axis.
const MOST: u64 = 100;
/// Share of an object's diameter by which its turned mesh may lie beside itself.
const TOLERANCE: f64 = 0.01;

/// Reads each `[[symmetry]]`.
pub(super) fn symmetries(root: &SpecTable) -> Result<Vec<Symmetry>, SceneError> {
    root.tables("symmetry", SYMMETRY)?.iter().map(symmetry).collect()
}

fn symmetry(table: &SpecTable) -> Result<Symmetry, SceneError> {
    let kinds = [("discrete", true), ("continuous", false)];
    let discrete = table.required("kind", table.choice("kind", &kinds)?, "discrete or continuous")?;
    let count = table.whole("count", 2..=MOST)?;
    let turns = if discrete {
        SymmetryTurns::Share(table.required("count", count, "the number of turns in a circle, from 2")? as u32)
    } else if count.is_some() {
        return Err(table.error("count", "has no meaning for kind = \"continuous\""));
    } else {
        SymmetryTurns::Any
    };
    let axis = table.required("axis", table.numbers::<3>("axis")?, "[x, y, z], about which it turns")?;
    Ok(Symmetry {
        object: table.text("object")?.map(str::to_owned),
        axis: DVec3::from(axis).try_normalize().ok_or_else(|| table.error("axis", "must not be zero"))?,
        origin: DVec3::from(table.numbers::<3>("origin")?.unwrap_or_default()),
        turns,
        tolerance: table.number("tolerance", 0.0..=1.0)?.unwrap_or(TOLERANCE),
    })
}
