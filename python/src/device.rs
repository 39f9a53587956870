//! The devices of this computer. All simulations of a process share the context of a device.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use isotherm::package::Context;
use isotherm::{SimulationError, Target, package};
use pyo3::prelude::*;

use crate::error::raised;
use crate::process::refuse_child;

/// Contexts that are open, by the name that was asked for.
static OPEN: Mutex<BTreeMap<Option<String>, Weak<Context>>> = Mutex::new(BTreeMap::new());

/// Opens a device, or takes the context that is open already.
pub fn open(name: Option<&str>) -> Result<Target, SimulationError> {
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    let key = name.map(str::to_lowercase);
    if let Some(context) = open.get(&key).and_then(Weak::upgrade) {
        return Ok(Target::Device(context));
    }
    let target = Target::open(name)?;
    if let Some(context) = target.device() {
        open.insert(key, Arc::downgrade(context));
    }
    Ok(target)
}

/// Names of the Vulkan devices of this computer, best first. Beside them there is always ``"cpu"``, the reference in double precision.
#[pyfunction]
pub fn devices(py: Python<'_>) -> PyResult<Vec<String>> {
    refuse_child(py)?;
    let found = py.detach(package::devices).map_err(|error| raised(py, &error.into()))?;
    Ok(found.into_iter().filter(|device| device.lacks.is_empty()).map(|device| device.name).collect())
}

/// Messages of the Vulkan validation layer about the devices in use. There are none without ``ISOTHERM_VALIDATION=1`` in the environment.
#[pyfunction]
pub fn validation_messages() -> Vec<String> {
    let open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    open.values().filter_map(Weak::upgrade).flat_map(|context| context.validation_messages()).collect()
}
