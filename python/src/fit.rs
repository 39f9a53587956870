//! Fits to measurements.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use isotherm::internals::{FitCase, FitOrder, FittingError};
use isotherm::{Reach, SimulationError, Target};
use pyo3::prelude::*;

use crate::device::open;
use crate::error::{raised, refused};
use crate::interrupt::interruptible;
use crate::process::refuse_child;

/// Why there is no result.
enum NoFit {
    Fitting(FittingError),
    Simulation(SimulationError),
}

impl From<FittingError> for NoFit {
    fn from(error: FittingError) -> Self {
        Self::Fitting(error)
    }
}

impl From<SimulationError> for NoFit {
    fn from(error: SimulationError) -> Self {
        Self::Simulation(error)
    }
}

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
    let work = |stop: &Arc<AtomicBool>| -> Result<String, NoFit> {
        let reach = if allow_outside { Reach::Anywhere } else { Reach::of(&model) };
        let order = FitOrder { model: &model, measured: &measured, parameters: &parameters, reach };
        let case = FitCase::load(&order, stop, &mut |_| ())?;
        let target = if case.needs_device() { open(device)? } else { Target::Reference };
        let fitted = case.solve_into(&target, output.as_deref())?;
        Ok(fitted.json().to_string())
    };
    let json = py.detach(|| interruptible(work))?.map_err(|error| match error {
        NoFit::Simulation(error) => raised(py, &error),
        NoFit::Fitting(FittingError::Scene(error)) => raised(py, &SimulationError::Prepare(error.into())),
        NoFit::Fitting(FittingError::Prepare(error)) => raised(py, &SimulationError::Prepare(error)),
        NoFit::Fitting(FittingError::Engine(error)) => raised(py, &SimulationError::Engine(error)),
        NoFit::Fitting(other) => refused(py, other.to_string()),
    })?;
    py.import("json")?.call_method1("loads", (json,))
}
