//! Fits to measurements.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use isotherm::Reach;
use isotherm::package::fit_files;
use pyo3::prelude::*;

use crate::device::open;
use crate::error::raised;
use crate::interrupt::interruptible;
use crate::process::refuse_child;

/// Fits ``parameters`` of a scene or a network file to ``measured`` files, as ``isotherm fit`` does: telemetry (CSV) and images (EXR, PNG). Writes the files of the command into ``output``,
/// an absent or empty folder, where it is given. Returns the content of ``fit.json``: ``parameters`` with values and standard deviations, ``covariance_of_logarithms``, ``correlation``,
/// ``condition``, ``directions``, ``rms`` [K], and ``text``, the result in sentences.
#[pyfunction]
#[pyo3(signature = (model, *, measured, parameters, output=None, device=None, allow_outside=false))]
pub fn fit<'py>(
    py: Python<'py>,
    model: PathBuf,
    measured: Vec<PathBuf>,
    parameters: PathBuf,
    output: Option<PathBuf>,
    device: Option<&str>,
    allow_outside: bool,
) -> PyResult<Bound<'py, PyAny>> {
    refuse_child(py)?;
    let work = |stop: &Arc<AtomicBool>| {
        let reach = if allow_outside { Reach::Anywhere } else { Reach::of(&model) };
        fit_files([&model, &parameters], &measured, output.as_deref(), reach, || open(device), stop)
    };
    let fitted = py.detach(|| interruptible(work))?;
    let json = fitted.map_err(|error| raised(py, &error))?;
    py.import("json")?.call_method1("loads", (json,))
}
