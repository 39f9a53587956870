//! Errors as Python exceptions, with file, line and key.

use isotherm::{EngineError, SimulationError};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

/// The exception of an error.
pub fn raised(py: Python<'_>, error: &SimulationError) -> PyErr {
    let class = match error {
        SimulationError::Prepare(_) => "SceneError",
        SimulationError::Gpu(_) | SimulationError::Engine(EngineError::Gpu(_)) => "DeviceError",
        SimulationError::Engine(_) | SimulationError::NotFinite { .. } => "IsothermError",
        _ => "RequestError",
    };
    let (file, line, key) = error.place();
    let file = file.map(|file| file.display().to_string());
    made(py, class, (error.to_string(), file, line, key))
}

/// The exception of a call that can not be answered.
pub fn refused(py: Python<'_>, message: String) -> PyErr {
    made(py, "RequestError", (message, None, None, None))
}

/// The exception of arguments that do not go together.
pub fn wrong_arguments(message: &str) -> PyErr {
    PyTypeError::new_err(message.to_owned())
}

type Arguments<'a> = (String, Option<String>, Option<usize>, Option<&'a str>);

fn made(py: Python<'_>, class: &str, arguments: Arguments<'_>) -> PyErr {
    let call = || py.import("isotherm._errors")?.getattr(class)?.call1(arguments);
    call().map_or_else(|error| error, PyErr::from_value)
}
