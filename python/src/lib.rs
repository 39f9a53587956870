//! The Python package `isotherm`: its classes over `isotherm::Simulation`.

use pyo3::prelude::*;

mod camera;
#[cfg(feature = "datasets")]
mod dataset;
mod device;
mod error;
mod fit;
mod frame;
mod held;
mod interrupt;
mod numbers;
mod process;
mod simulation;
mod sky;

/// Classes and functions of the package. `isotherm/__init__.py` shows them.
#[pymodule]
mod _native {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::camera::Camera;
    #[cfg(feature = "datasets")]
    #[pymodule_export]
    use super::dataset::{dataset_orbits, make_dataset};
    #[pymodule_export]
    use super::device::{devices, validation_messages};
    #[pymodule_export]
    use super::fit::fit;
    #[pymodule_export]
    use super::frame::Frame;
    #[pymodule_export]
    use super::simulation::{PartTemperature, Simulation};
    #[pymodule_export]
    use super::sky::Sky;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
