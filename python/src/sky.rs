//! Sun and planet as the craft sees them.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::numbers::{array, matrix};

/// Sun and planet in the body frame at one time.
#[pyclass(frozen, module = "isotherm")]
pub struct Sky(pub isotherm::Sky);

#[pymethods]
impl Sky {
    /// Time since the start [s].
    #[getter]
    fn time(&self) -> f64 {
        self.0.time
    }

    /// Unit vector to the Sun, body frame, shape (3,).
    #[getter]
    fn sun_direction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.0.sun_direction)
    }

    /// Unit vector to the planet's centre, body frame, shape (3,).
    #[getter]
    fn nadir_direction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.0.nadir_direction)
    }

    /// Share of the Sun's disc that the planet leaves visible, 0 to 1.
    #[getter]
    fn lit_fraction(&self) -> f64 {
        self.0.lit_fraction
    }

    /// Distance to the planet's centre over its radius.
    #[getter]
    fn distance_ratio(&self) -> f64 {
        self.0.distance_ratio
    }

    /// Rotates inertial vectors into the body frame, shape (3, 3).
    #[getter]
    fn body_from_inertial<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.0.body_from_inertial)
    }

    /// Rotates vectors of the orbit frame (X along the velocity, Z to nadir) into the body frame, shape (3, 3).
    #[getter]
    fn body_from_orbit<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.0.body_from_orbit)
    }

    fn __repr__(&self) -> String {
        format!("Sky(time={}, lit_fraction={})", self.0.time, self.0.lit_fraction)
    }
}
