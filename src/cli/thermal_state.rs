//! `--from-state`: reads a thermal state, and refuses one of another craft.

use std::path::Path;

use super::error::CliError;
use crate::files;
use crate::output::OutputError;
use crate::output::console::say;
use crate::output::state_file::decode;
use crate::saved::{Saved, SavedError};
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;
use crate::simulation::thermal_state::{differences, origin};

/// The state in a file, which fits the scene and the place of computation.
pub(super) fn read(path: &Path, prepared: &Prepared, chosen: &Target) -> Result<Saved, CliError> {
    let refused = |reason: String| CliError::from(OutputError::ThermalState(path.to_path_buf(), reason));
    let absent = |error: SavedError| refused(format!("is no thermal state of --save-state: {error}"));
    let bytes = files::read(path).map_err(|fault| refused(format!("cannot be read: {fault}")))?;
    let saved = decode(&bytes).map_err(refused)?;
    let found = differences(&saved, prepared, chosen.device().is_some()).map_err(absent)?;
    if !found.is_empty() {
        return Err(refused(format!("is of another craft: {}", found.join("; "))));
    }
    let origin = origin(&saved).map_err(absent)?;
    say!("assumed: The state at time 0 is that of {} ({origin}). There is no warm-up, and [initial] is not used.", path.display());
    Ok(saved)
}
