//! The process that works: a child of `fork` has none of its threads, and would wait for them for ever.

use std::process;
use std::sync::OnceLock;

use pyo3::prelude::*;

use crate::error::refused;

/// The process that began to work.
static FIRST: OnceLock<u32> = OnceLock::new();

/// Whether this process was forked from the one that began to work.
pub fn is_forked() -> bool {
    *FIRST.get_or_init(process::id) != process::id()
}

/// Refuses to work in a child of `fork`.
///
/// # Errors
/// `RequestError` in a child.
pub fn refuse_child(py: Python<'_>) -> PyResult<()> {
    if !is_forked() {
        return Ok(());
    }
    let message = "this process was forked from one that used isotherm, and threads and devices do not survive a fork: start workers by \
                   multiprocessing.get_context(\"spawn\"), or use isotherm in the workers alone";
    Err(refused(py, message.to_owned()))
}
