//! A simulation: steps, images, places and states.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use glam::DVec3;
use isotherm::package::{ThermalState, decode, encode, find_image_sigma};
use isotherm::{CameraFrame, Image, Placement, Pose, Reach, SimulationError};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};

use crate::camera::Camera;
use crate::device;
use crate::error::{raised, raised_by_call, refused, wrong_arguments};
use crate::frame::Frame;
use crate::held::Held;
use crate::interrupt::{LOOK_EVERY, guarded, interruptible, look_for_signals};
use crate::numbers::{quaternion, vector};
use crate::process::{is_forked, refuse_child};
use crate::sky::Sky;

const FRAMES: [(&str, CameraFrame); 3] =
    [("body", CameraFrame::Body), ("orbit", CameraFrame::Orbit), ("inertial", CameraFrame::Inertial)];

/// Draws the uncertainty into an image.
type DrawSigma = dyn Fn(&isotherm::Simulation, &mut Image) + Send + Sync;

/// Temperatures of a part [K].
#[pyclass(frozen, get_all, module = "isotherm")]
pub struct PartTemperature {
    /// Mean over its area [K].
    mean: f64,
    /// Lowest of its nodes [K].
    min: f64,
    /// Highest of its nodes [K].
    max: f64,
}

#[pymethods]
impl PartTemperature {
    fn __repr__(&self) -> String {
        format!("PartTemperature(mean={:.3}, min={:.3}, max={:.3})", self.mean, self.min, self.max)
    }
}

/// A scene that is stepped and drawn as its caller asks. It begins at time 0, after the warm-up of the scene.
///
/// Several simulations of a process share a device, and each may be used from its own thread: the interpreter is free while the device works.
#[pyclass(frozen, module = "isotherm")]
pub struct Simulation {
    /// `None` once it is closed.
    inner: Held<Option<isotherm::Simulation>>,
    /// The uncertainty of the run, once it is asked for.
    sigma: Mutex<Option<Arc<DrawSigma>>>,
    name: String,
    /// Names of the parts. A pixel of part ``n`` shows ``parts[n - 1]``.
    #[pyo3(get)]
    parts: Vec<String>,
    /// Names of the materials, likewise.
    #[pyo3(get)]
    materials: Vec<String>,
    /// One sentence for each default that was used.
    #[pyo3(get)]
    assumptions: Vec<String>,
    /// Remarks about the scene.
    #[pyo3(get)]
    warnings: Vec<String>,
    /// Name of the device.
    #[pyo3(get)]
    device: String,
}

impl Simulation {
    /// A handler of a signal that calls the simulation whose step it interrupts would wait for itself, and a child of `fork` for threads that it lacks.
    fn refuse_itself(&self, py: Python<'_>) -> PyResult<()> {
        refuse_child(py)?;
        if self.inner.is_held_here() {
            return Err(refused(py, "this thread is at work with the simulation already".to_owned()));
        }
        Ok(())
    }

    /// Works with the simulation while other threads of Python go on.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut isotherm::Simulation) -> Result<T, SimulationError> + Send,
    ) -> PyResult<T> {
        self.refuse_itself(py)?;
        let done = py.detach(|| {
            guarded(|| {
                let mut inner = self.inner.take(look_for_signals)?;
                Ok(inner.as_mut().map(work))
            })
        })?;
        answered(py, done)
    }

    /// The same for work that Ctrl-C ends wherever it is.
    fn with_long<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut isotherm::Simulation, &Arc<AtomicBool>) -> Result<T, SimulationError> + Send,
    ) -> PyResult<T> {
        self.refuse_itself(py)?;
        let done = py.detach(|| {
            let mut inner = self.inner.take(look_for_signals)?;
            let Some(inner) = inner.as_mut() else { return Ok(None) };
            interruptible(|stop| work(inner, stop)).map(Some)
        })?;
        answered(py, done)
    }

    /// The same for work of many steps, which Ctrl-C ends after the step under way. What precedes the first step ends at once.
    fn through(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut isotherm::Simulation, &AtomicBool, &mut dyn FnMut()) -> Result<bool, SimulationError> + Send,
    ) -> PyResult<()> {
        if !self.with(py, |simulation| Ok(simulation.has_begun()))? {
            return self.with_long(py, |simulation, stop| work(simulation, stop, &mut || ())).map(|_| ());
        }
        let mut signal: Option<PyErr> = None;
        let done = py.detach(|| {
            let stop = AtomicBool::new(false);
            let mut looked = Instant::now();
            let mut look = || {
                if looked.elapsed() >= LOOK_EVERY && signal.is_none() {
                    looked = Instant::now();
                    signal = look_for_signals().err();
                    stop.store(signal.is_some(), Ordering::Relaxed);
                }
            };
            guarded(|| {
                let mut inner = self.inner.take(look_for_signals)?;
                Ok(inner.as_mut().map(|inner| work(inner, &stop, &mut look)))
            })
        })?;
        match signal {
            Some(signal) => Err(signal),
            None => answered(py, done).map(|_| ()),
        }
    }

    fn over(inner: isotherm::Simulation) -> Self {
        let prepared = inner.prepared();
        Self {
            name: prepared.scene.name.clone(),
            parts: prepared.parts.clone(),
            materials: prepared.materials.iter().map(|material| material.name.clone()).collect(),
            assumptions: prepared.scene.assumptions.clone(),
            warnings: inner.warnings(),
            device: inner.device_name(),
            inner: Held::new(Some(inner)),
            sigma: Mutex::new(None),
        }
    }
}

/// The answer of a simulation that is not closed.
fn answered<T>(py: Python<'_>, done: Option<Result<T, SimulationError>>) -> PyResult<T> {
    let done = done.ok_or_else(|| refused(py, "the simulation is closed".to_owned()))?;
    done.map_err(|error| raised_by_call(py, &error))
}

impl Drop for Simulation {
    /// A child of `fork` would wait for the threads of its parent.
    fn drop(&mut self) {
        if is_forked() {
            self.inner.forget();
        }
    }
}

/// The frame of this name.
fn frame_named(py: Python<'_>, name: &str) -> PyResult<CameraFrame> {
    let found = FRAMES.iter().find(|(known, _)| *known == name).map(|(_, frame)| *frame);
    found.ok_or_else(|| refused(py, format!("frame must be 'body', 'orbit' or 'inertial', not '{name}'")))
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (scene, *, text=None, device=None, allow_outside=false))]
    fn new(
        py: Python<'_>,
        scene: PathBuf,
        text: Option<&str>,
        device: Option<&str>,
        allow_outside: bool,
    ) -> PyResult<Self> {
        refuse_child(py)?;
        let load = || {
            let target = device::open(device)?;
            let reach = if allow_outside { Reach::Anywhere } else { Reach::of(&scene) };
            let read = match text {
                Some(text) => {
                    let mut read = isotherm::Scene::parse_within(text, &scene, reach)?;
                    read.files.retain(|file| *file != scene);
                    read
                }
                None => isotherm::Scene::load_within(&scene, reach)?,
            };
            isotherm::Simulation::from_scene(read, &target)
        };
        let loaded = py.detach(|| interruptible(|_| load()))?.map_err(|error| raised(py, &error))?;
        Ok(Self::over(loaded))
    }

    /// The present time since the start [s].
    #[getter]
    fn time(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |simulation| Ok(simulation.time()))
    }

    /// Name of the scene.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// The camera of the scene.
    #[getter]
    fn camera(&self, py: Python<'_>) -> PyResult<Camera> {
        self.with(py, |simulation| simulation.camera().cloned()).map(Camera)
    }

    /// Sun and planet as the craft sees them at the present time.
    #[getter]
    fn sky(&self, py: Python<'_>) -> PyResult<Sky> {
        self.with(py, |simulation| Ok(simulation.sky())).map(Sky)
    }

    /// Name and present position of each joint [rad or m].
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let joints = PyDict::new(py);
        for (name, position) in self.with(py, |simulation| Ok(simulation.joints()))? {
            joints.set_item(name, position)?;
        }
        Ok(joints)
    }

    /// Brings the scene to time 0 by its warm-up. ``step_to`` and ``image`` do it too.
    fn begin(&self, py: Python<'_>) -> PyResult<()> {
        self.through(py, |simulation, stop, look| simulation.begin_with(stop, look))
    }

    /// Steps the temperatures to a time [s]. Steps end at multiples of the scene's step and at ``time``. Ctrl-C ends it between two steps, and the
    /// simulation can go on from there.
    fn step_to(&self, py: Python<'_>, time: f64) -> PyResult<()> {
        self.through(py, |simulation, stop, look| simulation.step_to_with(time, stop, look))
    }

    /// Finds how uncertain the temperatures of the run are by the ranges of ``[uncertainty]``, with two runs for each parameter. Images of the run have
    /// ``T_sigma`` and ``cause`` from then on, while the craft is on the orbit of its scene.
    fn find_sigma(&self, py: Python<'_>) -> PyResult<()> {
        let found = self.with_long(py, |simulation, stop| {
            let time = &simulation.prepared().scene.time;
            Ok(find_image_sigma(simulation, f64::from(time.steps) * time.step, stop))
        })?;
        let found = found.map_err(|error| refused(py, error))?;
        *self.sigma.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::from(found));
        Ok(())
    }

    /// What a camera sees at the present time.
    ///
    /// Without arguments it is the camera of the scene, in its own pose. ``position`` [m] needs ``quaternion`` (w, x, y, z; rotates camera axes into the frame)
    /// or ``look_at`` [m]. ``frame`` is that of the pose: ``"body"``, ``"orbit"`` or ``"inertial"``; without it, that of the scene's camera. ``up`` is the
    /// direction that is up in the image; without it -Z (zenith) in the orbit frame and +Z in the others.
    #[pyo3(signature = (*, position=None, quaternion=None, look_at=None, up=None, frame=None, camera=None))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
    fn image(
        &self,
        py: Python<'_>,
        position: Option<&Bound<'_, PyAny>>,
        quaternion: Option<&Bound<'_, PyAny>>,
        look_at: Option<&Bound<'_, PyAny>>,
        up: Option<&Bound<'_, PyAny>>,
        frame: Option<&str>,
        camera: Option<Camera>,
    ) -> PyResult<Frame> {
        let own = self.with(py, |simulation| Ok(simulation.camera().ok().cloned()))?;
        let known = || own.as_ref().map_or(CameraFrame::Body, |camera| camera.frame);
        let frame = frame.map_or_else(|| Ok(known()), |name| frame_named(py, name))?;
        let pose = match (position, quaternion, look_at) {
            (None, None, None) if up.is_none() => Ok(Pose::OfCamera),
            (Some(position), Some(rotation), None) if up.is_none() => {
                Pose::new(frame, vector(position, "position")?, self::quaternion(rotation, "quaternion")?)
            }
            (Some(position), None, Some(point)) => {
                let up = match up {
                    Some(up) => vector(up, "up")?,
                    None if frame == CameraFrame::Orbit => DVec3::NEG_Z,
                    None => DVec3::Z,
                };
                Pose::look_at(frame, vector(position, "position")?, vector(point, "look_at")?, up)
            }
            _ => {
                return Err(wrong_arguments(
                    "a pose is position= with quaternion=, or position= with look_at= and up=",
                ));
            }
        };
        let pose = pose.map_err(|error| raised_by_call(py, &error.into()))?;
        let camera = match (camera, &own) {
            (Some(camera), Some(own)) => camera.posed_as(own),
            (Some(camera), None) if position.is_some() => camera.0,
            (None, Some(own)) => own.clone(),
            _ => return Err(refused(py, "the scene has no camera: give camera= and a pose".to_owned())),
        };
        self.begin(py)?;
        let sigma = self.sigma.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let (image, names) = self.with_long(py, |simulation, _| {
            let mut image = simulation.image(&camera, &pose)?;
            sigma.iter().for_each(|sigma| sigma(simulation, &mut image));
            let bands = &simulation.prepared().scene.bands;
            Ok::<_, SimulationError>((image, bands.iter().map(|band| band.name.clone()).collect::<Vec<_>>()))
        })?;
        Frame::new(py, &self.name, &names, image)
    }

    /// Says where the craft is at a time [s] from now on, instead of the scene's own orbit and attitude. What is left out is that of the scene.
    ///
    /// ``position`` [m], ``velocity`` [m/s] and ``sun`` [m] are from the planet's centre in the inertial frame. ``quaternion`` (w, x, y, z) rotates body
    /// vectors into that frame. Times must rise, and ``step_to`` goes at most to the last one.
    #[pyo3(signature = (time, *, position=None, velocity=None, sun=None, quaternion=None))]
    fn place(
        &self,
        py: Python<'_>,
        time: f64,
        position: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        sun: Option<&Bound<'_, PyAny>>,
        quaternion: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let placement = Placement {
            time,
            position: position.map(|value| vector(value, "position")).transpose()?,
            velocity: velocity.map(|value| vector(value, "velocity")).transpose()?,
            sun: sun.map(|value| vector(value, "sun")).transpose()?,
            inertial_from_body: quaternion.map(|value| self::quaternion(value, "quaternion")).transpose()?,
        };
        self.with(py, |simulation| simulation.place(placement))
    }

    /// Holds a joint at a position [rad or m] from the present time on.
    fn set_joint(&self, py: Python<'_>, name: &str, position: f64) -> PyResult<()> {
        self.with(py, |simulation| simulation.set_joint(name, position))
    }

    /// Present temperature of each node [K], float32 of shape (nodes,). Node i is vertex i of the model with the scene's node density.
    fn node_temperatures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        self.begin(py)?;
        let values = self.with(py, isotherm::Simulation::node_temperatures)?;
        Ok(PyArray1::from_vec(py, values))
    }

    /// Position of each node in the body frame, in the file's pose [m], float32 of shape (nodes, 3).
    fn node_positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let positions = self.with(py, |simulation| Ok(simulation.node_positions()))?;
        PyArray1::from_vec(py, positions.into_iter().flatten().collect()).reshape([self.nodes(py)?, 3])
    }

    /// Index of each node's part in ``parts``, uint32 of shape (nodes,).
    fn node_parts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let parts = self.with(py, |simulation| Ok(simulation.node_parts()))?;
        Ok(PyArray1::from_vec(py, parts))
    }

    /// Number of nodes.
    #[getter]
    fn nodes(&self, py: Python<'_>) -> PyResult<usize> {
        self.with(py, |simulation| Ok(simulation.prepared().nodes.count))
    }

    /// Present temperatures of each part [K], by its name.
    fn part_temperatures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.begin(py)?;
        let parts = PyDict::new(py);
        for part in self.with(py, isotherm::Simulation::part_temperatures)? {
            let temperature = PartTemperature { mean: part.mean, min: part.least, max: part.greatest };
            parts.set_item(part.part, Bound::new(py, temperature)?)?;
        }
        Ok(parts)
    }

    /// The thermal state with the present time, as the bytes of a file of ``--save-state``.
    fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.begin(py)?;
        let state = self.with(py, isotherm::Simulation::save)?;
        let bytes = encode(&state).map_err(|error| refused(py, error.to_string()))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Goes back to a state of ``save`` and to its time, or with ``time`` [s] to another one. Places and joints that were set are forgotten.
    #[pyo3(signature = (state, *, time=None))]
    fn restore(&self, py: Python<'_>, state: &[u8], time: Option<f64>) -> PyResult<()> {
        let saved: ThermalState =
            decode(state).map_err(|fault| refused(py, format!("the state {fault}{}", fault.advice())))?;
        self.with(py, |simulation| match time {
            Some(time) => simulation.restore_at(&saved, time),
            None => simulation.restore(&saved),
        })
    }

    /// Frees the device and the memory of the simulation. Its name, parts and remarks stay readable. Closing twice is allowed.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.refuse_itself(py)?;
        py.detach(|| {
            guarded(|| {
                let simulation = self.inner.take(look_for_signals)?.take();
                drop(simulation);
                Ok(())
            })
        })
    }

    fn __enter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    #[pyo3(signature = (*_error))]
    fn __exit__(&self, py: Python<'_>, _error: &Bound<'_, PyTuple>) -> PyResult<()> {
        self.close(py)
    }

    fn __repr__(&self) -> String {
        format!("Simulation('{}' on {})", self.name, self.device)
    }
}
