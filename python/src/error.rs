//! Errors as Python exceptions, with file, line and key.

use std::any::Any;

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

/// The exception of an error of a call: a scene that was taken is no longer at fault.
pub fn raised_by_call(py: Python<'_>, error: &SimulationError) -> PyErr {
    match error {
        SimulationError::Prepare(error) => refused(py, error.to_string()),
        other => raised(py, other),
    }
}

/// The exception of a fault of this program, which would be a panic in Rust.
pub fn faulty(py: Python<'_>, panic: &(dyn Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    let message = format!("this is a fault of isotherm, please report it: {}", text.unwrap_or("without a message"));
    made(py, "IsothermError", (message, None, None, None))
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
