//! The guard on every number of a result.

use super::OutputError;

/// Refuses a number that is not finite. `what` names the number, with its node and its step or time.
///
/// # Errors
/// [`OutputError::NotFinite`].
pub(crate) fn finite(value: f64, what: impl FnOnce() -> String) -> Result<f64, OutputError> {
    if value.is_finite() { Ok(value) } else { Err(OutputError::NotFinite { what: what(), value }) }
}
