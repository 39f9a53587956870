//! `--save-state` and `--from-state`: when a thermal state is taken, and which one a run begins with.

use std::path::Path;

use super::error::CliError;
use crate::files;
use crate::output::OutputError;
use crate::output::casts_file;
use crate::output::console::say;
use crate::output::state_file::decode;
use crate::scene::Time;
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;
use crate::simulation::thermal_state::ThermalState;

/// The state in a file, which fits the scene and the place of computation. The scene takes the rays that were cast before, from the file beside it.
pub(super) fn read(path: &Path, prepared: &Prepared, chosen: &Target) -> Result<ThermalState, CliError> {
    let refused = |reason: String| CliError::from(OutputError::ThermalState(path.to_path_buf(), reason));
    let bytes = files::read(path).map_err(|fault| refused(format!("cannot be read: {fault}")))?;
    let state: ThermalState = decode(&bytes).map_err(|fault| refused(format!("{fault}{}", fault.advice())))?;
    let changes = state.differences(prepared, chosen.device().is_some());
    if !changes.is_empty() {
        return Err(refused(format!("is of another craft: {}", changes.join("; "))));
    }
    say!(
        "assumed: The state at time 0 is that of {} ({}). There is no warm-up, and [initial] is not used.",
        path.display(),
        state.origin()
    );
    casts_file::read_beside(path, prepared);
    if prepared.scene.images.error && state.errors.is_none() {
        say!(
            "assumed: {} has no errors of temperatures (its scene has no output.error = true). T_error begins anew at time 0.",
            path.display()
        );
    }
    Ok(state)
}

/// The step of `--save-state-at`, or the last one.
pub(super) fn step_of_state(at: Option<f64>, time: &Time) -> Result<u32, CliError> {
    let Some(at) = at else { return Ok(time.steps) };
    let number = at / time.step;
    let whole = number.round();
    if !((0.0..=f64::from(time.steps)).contains(&whole) && (number - whole).abs() < 1e-6) {
        let end = f64::from(time.steps) * time.step;
        let message =
            format!("--save-state-at is the time of a step, a multiple of {} s from 0 to {end} s, not {at}", time.step);
        return Err(CliError::Usage(message));
    }
    Ok(whole as u32)
}
