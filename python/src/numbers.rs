//! Vectors and quaternions from any Python sequence, and matrices as arrays.

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::{PyOverflowError, PyTypeError};
use pyo3::prelude::*;

use crate::error::refused;

/// `N` numbers of a sequence or an array.
pub fn numbers<const N: usize>(value: &Bound<'_, PyAny>, name: &str) -> PyResult<[f64; N]> {
    let wrong = || PyTypeError::new_err(format!("{name} must have {N} numbers"));
    let items = value.try_iter().map_err(|_| wrong())?;
    let items = items.map(|item| item?.extract::<f64>()).collect::<PyResult<Vec<f64>>>().map_err(|_| wrong())?;
    let count = items.len();
    items.try_into().map_err(|_| refused(value.py(), format!("{name} must have {N} numbers, not {count}")))
}

/// A whole number that is not negative.
pub fn count(value: &Bound<'_, PyAny>, name: &str) -> PyResult<u32> {
    value.extract().map_err(|error: PyErr| match error.is_instance_of::<PyOverflowError>(value.py()) {
        true => refused(value.py(), format!("{name} must be from 0 to {}", u32::MAX)),
        false => error,
    })
}

/// A vector.
pub fn vector(value: &Bound<'_, PyAny>, name: &str) -> PyResult<DVec3> {
    numbers::<3>(value, name).map(DVec3::from_array)
}

/// A quaternion, scalar-first.
pub fn quaternion(value: &Bound<'_, PyAny>, name: &str) -> PyResult<DQuat> {
    let [w, x, y, z] = numbers::<4>(value, name)?;
    Ok(DQuat::from_xyzw(x, y, z, w))
}

/// A vector as an array of 3 numbers.
pub fn array<'py>(py: Python<'py>, vector: DVec3) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, &vector.to_array())
}

/// A matrix as an array of 3 x 3 numbers.
pub fn matrix<'py>(py: Python<'py>, matrix: DMat3) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, &matrix.transpose().to_cols_array()).reshape([3, 3])
}

/// A pose as an array of 4 x 4 numbers.
pub fn pose<'py>(py: Python<'py>, pose: DAffine3) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, &DMat4::from(pose).transpose().to_cols_array()).reshape([4, 4])
}
