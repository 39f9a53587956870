//! The intrinsics of a camera.

use glam::{DMat3, DQuat, DVec3};
use isotherm::package::check_camera;
use isotherm::{CameraFrame, Distortion, Lens, MotionBlur, package};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::error::{raised, wrong_arguments};
use crate::numbers::{count, matrix};

/// Size, lens and samples of a camera. It has no pose.
#[pyclass(frozen, eq, from_py_object, module = "isotherm")]
#[derive(Clone)]
pub struct Camera(pub package::Camera);

/// A scene's camera holds its pose too, which does not count.
impl PartialEq for Camera {
    fn eq(&self, other: &Self) -> bool {
        self.posed_as(&other.0) == other.0
    }
}

impl Camera {
    /// The arguments of which Python makes it.
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        let lens = &self.0.lens;
        all.set_item("width", self.0.width)?;
        all.set_item("height", self.0.height)?;
        all.set_item("fx", lens.focal[0])?;
        all.set_item("fy", lens.focal[1])?;
        all.set_item("cx", lens.centre[0])?;
        all.set_item("cy", lens.centre[1])?;
        all.set_item("skew", lens.skew)?;
        all.set_item("distortion", self.distortion())?;
        all.set_item("distortion_model", self.distortion_model())?;
        all.set_item("samples", self.0.samples)?;
        all.set_item("near", self.0.near)?;
        all.set_item("line_time", self.0.line_time)?;
        if self.0.exposure.time > 0.0 {
            all.set_item("exposure_time", self.0.exposure.time)?;
            all.set_item("sub_frames", self.0.exposure.sub_frames)?;
        }
        Ok(all)
    }

    /// The camera with the pose or path of another.
    pub fn posed_as(&self, other: &package::Camera) -> package::Camera {
        let package::Camera { motion, frame, position, frame_from_camera, .. } = other.clone();
        package::Camera { motion, frame, position, frame_from_camera, ..self.0.clone() }
    }
}

const BROWN_CONRADY: &str = "brown_conrady";
const FISHEYE: &str = "fisheye";

/// Distortion of a model, in OpenCV's order of numbers.
fn distortion(model: &str, numbers: &[f64]) -> PyResult<Distortion> {
    match *numbers {
        _ if ![BROWN_CONRADY, FISHEYE].contains(&model) => {
            Err(wrong_arguments(&format!("distortion_model must be '{BROWN_CONRADY}' or '{FISHEYE}', not '{model}'")))
        }
        [] => Ok(Distortion::None),
        [a, b, c, d] if model == FISHEYE => Ok(Distortion::Fisheye([a, b, c, d])),
        _ if model == BROWN_CONRADY && [4, 5, 8, 12].contains(&numbers.len()) => {
            let mut all = [0.0; 12];
            all[..numbers.len()].copy_from_slice(numbers);
            Ok(if all == [0.0; 12] { Distortion::None } else { Distortion::BrownConrady(all) })
        }
        _ => Err(wrong_arguments("distortion must have 4, 5, 8 or 12 numbers, or 4 of a fisheye")),
    }
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (width, height, *, fx, fy=None, cx=None, cy=None, skew=0.0, distortion=Vec::new(), distortion_model=BROWN_CONRADY, samples=None, near=0.1, line_time=0.0, exposure_time=0.0, sub_frames=None))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
    fn new(
        py: Python<'_>,
        width: &Bound<'_, PyAny>,
        height: &Bound<'_, PyAny>,
        fx: f64,
        fy: Option<f64>,
        cx: Option<f64>,
        cy: Option<f64>,
        skew: f64,
        distortion: Vec<f64>,
        distortion_model: &str,
        samples: Option<&Bound<'_, PyAny>>,
        near: f64,
        line_time: f64,
        exposure_time: f64,
        sub_frames: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let [width, height] = [count(width, "width")?, count(height, "height")?];
        let samples = samples.map_or(Ok(4), |samples| count(samples, "samples"))?;
        let sub_frames = sub_frames.map(|sub_frames| count(sub_frames, "sub_frames")).transpose()?;
        let centre = [cx.unwrap_or(f64::from(width) / 2.0), cy.unwrap_or(f64::from(height) / 2.0)];
        let distortion = self::distortion(distortion_model, &distortion)?;
        let exposure = match sub_frames {
            None if exposure_time == 0.0 => MotionBlur::default(),
            Some(sub_frames) if exposure_time != 0.0 => MotionBlur { time: exposure_time, sub_frames },
            _ => return Err(wrong_arguments("exposure_time and sub_frames go together: state both or none")),
        };
        let camera = package::Camera {
            width,
            height,
            lens: Lens { focal: [fx, fy.unwrap_or(fx)], centre, skew, distortion },
            samples,
            line_time,
            exposure,
            motion: isotherm::Motion::Still,
            frame: CameraFrame::Body,
            position: DVec3::ZERO,
            frame_from_camera: DQuat::IDENTITY,
            near,
        };
        check_camera(&camera).map_err(|error| raised(py, &error.into()))?;
        Ok(Self(camera))
    }

    /// Equal cameras have equal hashes.
    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        let Lens { focal: [fx, fy], centre: [cx, cy], skew, .. } = self.0.lens;
        let size = (self.0.width, self.0.height, self.0.samples);
        (size, fx, fy, cx, cy, skew, PyTuple::new(py, self.distortion())?).into_pyobject(py)?.hash()
    }

    /// Width in pixels.
    #[getter]
    fn width(&self) -> u32 {
        self.0.width
    }

    /// Height in pixels.
    #[getter]
    fn height(&self) -> u32 {
        self.0.height
    }

    /// Focal length along the rows [px].
    #[getter]
    fn fx(&self) -> f64 {
        self.0.lens.focal[0]
    }

    /// Focal length along the columns [px].
    #[getter]
    fn fy(&self) -> f64 {
        self.0.lens.focal[1]
    }

    /// Column of the principal point [px]. The centre of the first pixel is at 0.5.
    #[getter]
    fn cx(&self) -> f64 {
        self.0.lens.centre[0]
    }

    /// Row of the principal point [px].
    #[getter]
    fn cy(&self) -> f64 {
        self.0.lens.centre[1]
    }

    /// Skew [px].
    #[getter]
    fn skew(&self) -> f64 {
        self.0.lens.skew
    }

    /// Distortion in OpenCV's order of numbers: 12 of Brown and Conrady, 4 of a fisheye, or none.
    #[getter]
    fn distortion(&self) -> Vec<f64> {
        match self.0.lens.distortion {
            Distortion::None => Vec::new(),
            Distortion::Fisheye(numbers) => numbers.to_vec(),
            Distortion::BrownConrady(numbers) => numbers.to_vec(),
        }
    }

    /// Model of the distortion: "brown_conrady" or "fisheye".
    #[getter]
    fn distortion_model(&self) -> &'static str {
        match self.0.lens.distortion {
            Distortion::Fisheye(_) => FISHEYE,
            Distortion::None | Distortion::BrownConrady(_) => BROWN_CONRADY,
        }
    }

    /// Model of the lens: "pinhole", "brown_conrady" or "fisheye".
    #[getter]
    fn model(&self) -> &'static str {
        match self.0.lens.distortion {
            Distortion::None => "pinhole",
            _ => self.distortion_model(),
        }
    }

    /// Samples of a pixel: 1, 4, 8 or 16.
    #[getter]
    fn samples(&self) -> u32 {
        self.0.samples
    }

    /// Distance of the near plane [m].
    #[getter]
    fn near(&self) -> f64 {
        self.0.near
    }

    /// Time from a row to the next one below [s].
    #[getter]
    fn line_time(&self) -> f64 {
        self.0.line_time
    }

    /// How long a pixel collects light [s]; 0 for an instant.
    #[getter]
    fn exposure_time(&self) -> f64 {
        self.0.exposure.time
    }

    /// Images whose mean stands for an exposure; 1 for an instant.
    #[getter]
    fn sub_frames(&self) -> u32 {
        self.0.exposure.sub_frames
    }

    /// OpenCV's camera matrix, shape (3, 3). Its pixel centres are whole numbers, so it differs from cx and cy by half a pixel.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let Lens { focal: [fx, fy], centre: [cx, cy], skew, .. } = self.0.lens;
        matrix(py, DMat3::from_cols_array(&[fx, 0.0, 0.0, skew, fy, 0.0, cx - 0.5, cy - 0.5, 1.0]))
    }

    /// The same camera with other values. The principal point does not move with the size.
    #[pyo3(signature = (**changes))]
    fn replace<'py>(&self, py: Python<'py>, changes: Option<&Bound<'py, PyDict>>) -> PyResult<Bound<'py, PyAny>> {
        let all = self.values(py)?;
        if let Some(changes) = changes {
            all.update(changes.as_mapping())?;
        }
        py.get_type::<Self>().call(PyTuple::empty(py), Some(&all))
    }

    /// What `pickle` makes it of.
    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        Ok((PyTuple::empty(py), self.values(py)?))
    }

    fn __repr__(&self) -> String {
        let Lens { focal: [fx, fy], centre: [cx, cy], .. } = self.0.lens;
        format!("Camera({}, {}, fx={fx}, fy={fy}, cx={cx}, cy={cy}, ...)", self.0.width, self.0.height)
    }
}
