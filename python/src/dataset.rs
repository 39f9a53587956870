//! Data sets: a shard of one, made in this process.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

use isotherm::package::{Begin, DatasetOrder, DatasetSummary, SceneText, Shard, Spec, make};
use isotherm::{DatasetError, Reach, SimulationError, Target};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::device::open;
use crate::error::{raised, refused};
use crate::interrupt::interruptible;
use crate::process::refuse_child;

fn reach(path: &Path, allow_outside: bool) -> Reach {
    if allow_outside { Reach::Anywhere } else { Reach::of(path) }
}

/// Number of the orbits of a SPEC file.
#[pyfunction]
#[pyo3(signature = (spec, *, allow_outside=false))]
pub fn dataset_orbits(py: Python<'_>, spec: PathBuf, allow_outside: bool) -> PyResult<u64> {
    let spec = Spec::load(&spec, &reach(&spec, allow_outside)).map_err(|error| dataset_error(py, error.into()))?;
    Ok(spec.orbits())
}

/// Makes the orbits j of a SPEC file with j mod ``shards`` = ``shard``, as ``isotherm dataset --resume`` does. What is there already is kept. Returns what was
/// done: ``images``, ``orbits``, ``kept`` (orbits), ``bytes``, ``seconds``, ``complete``, whether all orbits of the data set are
/// there, and ``warnings``, as ``Simulation.warnings``.
#[pyfunction]
#[pyo3(signature = (spec, output, *, shard=0, shards=1, device=None, allow_outside=false))]
pub fn make_dataset<'py>(
    py: Python<'py>,
    spec: PathBuf,
    output: PathBuf,
    shard: u64,
    shards: u64,
    device: Option<&str>,
    allow_outside: bool,
) -> PyResult<Bound<'py, PyDict>> {
    refuse_child(py)?;
    if shard >= shards {
        return Err(refused(py, format!("shard {shard} of {shards}: shards count from 0")));
    }
    let warnings = Mutex::new(Vec::new());
    let work = |stop: &Arc<AtomicBool>| -> Result<DatasetSummary, DatasetError> {
        let loaded = Spec::load(&spec, &reach(&spec, allow_outside))?;
        let scenes = SceneText::load(&loaded.scene, reach(&loaded.scene, allow_outside))?;
        let target: Target = open(device)?;
        let order = DatasetOrder {
            spec: &loaded,
            scenes: &scenes,
            target: &target,
            root: &output,
            shard: Shard { index: shard, shards },
            begin: Begin::Resume,
            allows_outside: allow_outside,
            assume: &|_| (),
            warn: &|warning| warnings.lock().unwrap_or_else(PoisonError::into_inner).push(warning.to_owned()),
        };
        make(&order, stop, &mut |_, _| ())
    };
    let made = py.detach(|| interruptible(work))?;
    let made = made.map_err(|error| dataset_error(py, error))?;
    let told = PyDict::new(py);
    told.set_item("images", made.images)?;
    told.set_item("orbits", made.orbits)?;
    told.set_item("kept", made.kept)?;
    told.set_item("bytes", made.bytes)?;
    told.set_item("seconds", made.seconds)?;
    told.set_item("complete", made.complete)?;
    told.set_item("warnings", warnings.into_inner().unwrap_or_else(PoisonError::into_inner))?;
    Ok(told)
}

fn dataset_error(py: Python<'_>, error: DatasetError) -> PyErr {
    match error {
        DatasetError::Scene(error) => raised(py, &SimulationError::Prepare(error.into())),
        DatasetError::Simulation(error) => raised(py, &error),
        other => refused(py, other.to_string()),
    }
}
