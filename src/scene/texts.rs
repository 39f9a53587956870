//! Checks the contents of one file that a scene can name, without the scene.

use std::path::Path;
use std::sync::Arc;

use hifitime::{Epoch, TimeScale};

use super::ephemeris::{self, AttitudeOptions, Options, read_attitude};
use super::epoch::parse_epoch;
use super::error::SceneError;
use super::faults::Faults;
use super::planet::map_of;
use super::table::MaterialTable;
use super::temperatures::mesh_nodes;
use crate::environment::rotation_history::{HistoryFrame, RotationHistory};
use crate::environment::trajectory::Trajectory;
use crate::files::Reach;

/// Time 0 of a table whose times are seconds.
fn start() -> Option<Epoch> {
    parse_epoch("2023-10-29T00:00:00", TimeScale::UTC).ok()
}

/// The number of entries of a materials table.
///
/// # Errors
/// The first error, with its line and key.
pub fn materials(text: &str, path: &Path) -> Result<usize, SceneError> {
    MaterialTable::parse(text, path, &Reach::of(path), 1.0, &Faults::default()).map(|table| table.len())
}

/// A trajectory: two-line elements, an OEM as KVN or XML, or a table in ITRF.
///
/// # Errors
/// The first error, with its line and key.
pub fn trajectory(text: &str, path: &Path) -> Result<Arc<Trajectory>, SceneError> {
    let is_table = text.trim_start().starts_with("time");
    let options = Options {
        frame: is_table.then(|| "ITRF".to_owned()),
        time_system: is_table.then(|| "UTC".to_owned()),
        start: start().filter(|_| is_table),
        ..Options::default()
    };
    ephemeris::read(path, text, &options, &mut Vec::new())
}

/// An attitude: an AEM as KVN or XML, or a table of quaternions in the inertial frame.
///
/// # Errors
/// The first error, with its line and key.
pub fn attitude(text: &str, path: &Path) -> Result<Arc<RotationHistory>, SceneError> {
    let frame = text.trim_start().starts_with("time").then_some(HistoryFrame::Inertial);
    let options = AttitudeOptions { frame, start: start(), ..AttitudeOptions::default() };
    read_attitude(path, text, &options, &mut Vec::new())
}

/// The number of places of a mesh with temperatures (`.vtu`, `.vtp`).
///
/// # Errors
/// The first error, with its line and key.
pub fn mesh(bytes: &[u8], path: &Path) -> Result<usize, SceneError> {
    mesh_nodes(bytes, path)
}

/// The number of cells of a planet's map, PNG with temperatures 100 K + its values / 256, or EXR.
///
/// # Errors
/// A message.
pub fn planet_map(bytes: &[u8]) -> Result<usize, String> {
    map_of(bytes, Some([1.0 / 256.0, 100.0])).map(|map| map.cells().len())
}
