//! An image as numpy arrays.

use glam::DAffine3;
use isotherm::Image;
use isotherm::package::{CAUSES, CHANNELS, ColourScale, picture};
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::{PyKeyError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::camera::Camera;
use crate::numbers::pose;

/// One image. Its arrays have the shape (height, width); row 0 is at the top. They take over the memory of the image, so nothing is copied.
#[pyclass(frozen, module = "isotherm")]
pub struct Frame {
    scene: String,
    camera_from_body: DAffine3,
    /// Time since the start [s].
    #[pyo3(get)]
    time: f64,
    /// The camera.
    #[pyo3(get)]
    camera: Camera,
    /// Radiance in the band [W m-2 sr-1], float32.
    #[pyo3(get)]
    radiance: Py<PyArray2<f32>>,
    /// Surface temperature [K], float32. 0 where no surface is.
    #[pyo3(get)]
    temperature: Py<PyArray2<f32>>,
    /// Distance along the camera's +Z [m], float32. 0 where no surface is.
    #[pyo3(get)]
    depth: Py<PyArray2<f32>>,
    /// Index of the part in Simulation.parts plus 1, uint32. 0 where no surface is.
    #[pyo3(get)]
    part: Py<PyArray2<u32>>,
    /// Index of the material in Simulation.materials plus 1, uint32. 0 where no surface is.
    #[pyo3(get)]
    material: Py<PyArray2<u32>>,
    /// Share of the samples of a pixel that show a surface, float32. None with one sample of a pixel.
    #[pyo3(get)]
    coverage: Option<Py<PyArray2<f32>>>,
    /// Reflected part of the radiance [W m-2 sr-1], float32. None where the scene does not ask for it.
    #[pyo3(get)]
    reflected: Option<Py<PyArray2<f32>>>,
    /// One standard deviation of the temperature's error [K], float32. None where the scene does not ask for it (output.error).
    #[pyo3(get)]
    error: Option<Py<PyArray2<f32>>>,
    /// One standard deviation of the temperature by the ranges of parameters [K], float32. None before Simulation.find_sigma.
    #[pyo3(get, name = "T_sigma")]
    sigma: Option<Py<PyArray2<f32>>>,
    /// Index in causes of the parameter that adds most to T_sigma plus 1, uint32. 0 where none does.
    #[pyo3(get)]
    cause: Option<Py<PyArray2<u32>>>,
    /// Names of these parameters.
    #[pyo3(get)]
    causes: Vec<String>,
    /// Gain of the surface by each cause [W/m2]: float32 arrays by the names of the channels, Q_sun to Q_emitted. None where the scene does not ask for it (output.budget).
    #[pyo3(get)]
    budget: Option<Py<PyDict>>,
    /// Digital numbers of the sensor, uint16. None without a sensor.
    #[pyo3(get)]
    dn: Option<Py<PyArray2<u16>>>,
    /// Counts of the sensor's radiometric output, uint16. None where it has none.
    #[pyo3(get)]
    counts: Option<Py<PyArray2<u16>>>,
    /// Radiance of each band by its name [W m-2 sr-1]: float32 arrays. Empty where the scene has no [[band]].
    #[pyo3(get)]
    bands: Py<PyDict>,
    /// Digital numbers of each band with a sensor, by its name: uint16 arrays.
    #[pyo3(get)]
    bands_dn: Py<PyDict>,
    /// Temperature from the ratio of two bands, and one standard deviation of its error [K]: two float32 arrays. None where the scene does not ask for it (output.ratio).
    #[pyo3(get)]
    ratio: Option<(Plane, Plane)>,
}

/// A shared array.
type Plane = Py<PyArray2<f32>>;

/// An array that takes over a list.
fn plane<T: Element>(py: Python<'_>, values: Vec<T>, [height, width]: [usize; 2]) -> PyResult<Py<PyArray2<T>>> {
    Ok(PyArray1::from_vec(py, values).reshape([height, width])?.unbind())
}

/// The gains of the pixels by the names of their causes.
fn budget(py: Python<'_>, pixels: &[[f32; CAUSES]], shape: [usize; 2]) -> PyResult<Option<Py<PyDict>>> {
    if pixels.is_empty() {
        return Ok(None);
    }
    let budget = PyDict::new(py);
    for (cause, name) in CHANNELS.iter().enumerate() {
        budget.set_item(name, plane(py, pixels.iter().map(|pixel| pixel[cause]).collect(), shape)?)?;
    }
    Ok(Some(budget.unbind()))
}

impl Frame {
    /// The arrays of an image, whose bands have these names.
    pub fn new(py: Python<'_>, scene: &str, names: &[String], image: Image) -> PyResult<Self> {
        let shape = [image.camera.height as usize, image.camera.width as usize];
        let optional = |values: Vec<f32>| if values.is_empty() { Ok(None) } else { plane(py, values, shape).map(Some) };
        let numbers = |values: Option<Vec<u16>>| values.map(|values| plane(py, values, shape)).transpose();
        let (bands, bands_dn) = (PyDict::new(py), PyDict::new(py));
        for (name, band) in names.iter().zip(image.bands.images) {
            bands.set_item(name, plane(py, band.radiance, shape)?)?;
            if let Some(dn) = band.digital_numbers {
                bands_dn.set_item(name, plane(py, dn, shape)?)?;
            }
        }
        let ratio = image.bands.ratio;
        let (sigma, cause) = (image.sigma.temperature, image.sigma.cause);
        let ratio =
            ratio.map(|ratio| Ok::<_, PyErr>((plane(py, ratio.temperature, shape)?, plane(py, ratio.error, shape)?)));
        Ok(Self {
            scene: scene.to_owned(),
            camera_from_body: image.camera_from_body,
            time: image.time,
            camera: Camera(image.camera),
            radiance: plane(py, image.radiance, shape)?,
            temperature: plane(py, image.temperature, shape)?,
            depth: plane(py, image.depth, shape)?,
            part: plane(py, image.part, shape)?,
            material: plane(py, image.material, shape)?,
            coverage: optional(image.coverage)?,
            reflected: optional(image.reflected)?,
            error: optional(image.error)?,
            sigma: optional(sigma)?,
            cause: if cause.is_empty() { None } else { Some(plane(py, cause, shape)?) },
            causes: image.sigma.causes.to_vec(),
            budget: budget(py, &image.budget, shape)?,
            dn: numbers(image.digital_numbers)?,
            counts: numbers(image.counts)?,
            bands: bands.unbind(),
            bands_dn: bands_dn.unbind(),
            ratio: ratio.transpose()?,
        })
    }
}

#[pymethods]
impl Frame {
    /// The frame of what ``__reduce__`` gave, for ``pickle``.
    #[staticmethod]
    fn _restored(state: &Bound<'_, PyDict>) -> PyResult<Self> {
        let item = |name: &str| state.get_item(name)?.ok_or_else(|| PyKeyError::new_err(name.to_owned()));
        let place: Vec<f64> = item("camera_from_body")?.extract()?;
        let place: [f64; 12] = place.try_into().map_err(|_| PyValueError::new_err("camera_from_body"))?;
        Ok(Self {
            scene: item("scene")?.extract()?,
            camera_from_body: DAffine3::from_cols_array(&place),
            time: item("time")?.extract()?,
            camera: item("camera")?.extract()?,
            radiance: item("radiance")?.extract()?,
            temperature: item("temperature")?.extract()?,
            depth: item("depth")?.extract()?,
            part: item("part")?.extract()?,
            material: item("material")?.extract()?,
            coverage: item("coverage")?.extract()?,
            reflected: item("reflected")?.extract()?,
            error: item("error")?.extract()?,
            sigma: item("T_sigma")?.extract()?,
            cause: item("cause")?.extract()?,
            causes: item("causes")?.extract()?,
            budget: item("budget")?.extract()?,
            dn: item("dn")?.extract()?,
            counts: item("counts")?.extract()?,
            bands: item("bands")?.extract()?,
            bands_dn: item("bands_dn")?.extract()?,
            ratio: item("ratio")?.extract()?,
        })
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyDict>,))> {
        let state = PyDict::new(py);
        state.set_item("scene", &self.scene)?;
        state.set_item("camera_from_body", self.camera_from_body.to_cols_array().to_vec())?;
        state.set_item("time", self.time)?;
        state.set_item("camera", self.camera.clone())?;
        for (name, plane) in [("radiance", &self.radiance), ("temperature", &self.temperature), ("depth", &self.depth)]
        {
            state.set_item(name, plane)?;
        }
        state.set_item("part", &self.part)?;
        state.set_item("material", &self.material)?;
        for (name, plane) in [
            ("coverage", &self.coverage),
            ("reflected", &self.reflected),
            ("error", &self.error),
            ("T_sigma", &self.sigma),
        ] {
            state.set_item(name, plane.as_ref())?;
        }
        state.set_item("cause", self.cause.as_ref())?;
        state.set_item("causes", &self.causes)?;
        state.set_item("budget", self.budget.as_ref())?;
        state.set_item("dn", self.dn.as_ref())?;
        state.set_item("counts", self.counts.as_ref())?;
        state.set_item("bands", &self.bands)?;
        state.set_item("bands_dn", &self.bands_dn)?;
        state.set_item("ratio", self.ratio.as_ref())?;
        Ok((py.import("isotherm._pickle")?.getattr("frame")?, (state,)))
    }

    /// Takes body positions [m] into camera axes (OpenCV), shape (4, 4).
    #[getter]
    fn camera_from_body<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        pose(py, self.camera_from_body)
    }

    /// Temperatures in false colour, for notebooks.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let values = |array: &Py<PyArray2<f32>>| array.bind(py).to_owned_array().into_iter().collect::<Vec<f32>>();
        let labels = |array: &Py<PyArray2<u32>>| array.bind(py).to_owned_array().into_iter().collect::<Vec<u32>>();
        let mut frame = Image::blank(self.camera.0.clone(), self.camera_from_body, self.time);
        [frame.radiance, frame.temperature, frame.depth] = [&self.radiance, &self.temperature, &self.depth].map(values);
        [frame.part, frame.material] = [&self.part, &self.material].map(labels);
        let scale = ColourScale::covering(frame.range());
        let details = format!("t = {:.3} s, surface temperature", self.time);
        let png = py.detach(|| picture(&frame, &scale, &self.scene, &details).and_then(|canvas| canvas.png()));
        png.map(|png| PyBytes::new(py, &png)).map_err(|error| PyRuntimeError::new_err(error.to_string()))
    }

    fn __repr__(&self) -> String {
        format!("Frame(time={}, {} x {} pixels)", self.time, self.camera.0.width, self.camera.0.height)
    }
}
