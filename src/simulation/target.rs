//! The place of computation: a Vulkan device, or the f64 reference on the processor.

use std::sync::Arc;

use super::bands::BandsEngine;
use super::device_engine::DeviceEngine;
use super::engine::Engine;
use super::prepare::Prepared;
use super::reference_engine::ReferenceEngine;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::response::{ResponseRun, respond};
use crate::host::{OverBudget, Reservation, reserve_memory};
use crate::scene::Camera;
use crate::thermal::material::Transition;
use crate::thermal::transition::{TransitionState, transition_step};

/// Memory of an image that the host holds, and of a second one while it is drawn or written [bytes a pixel].
const IMAGE: u64 = 64;
/// Memory with which a device draws an image, where it is memory of the host too [bytes a pixel]: 73 on lavapipe.
const DEVICE_IMAGE: u64 = 80;
/// Memory with which the reference draws an image [bytes a pixel].
const REFERENCE_IMAGE: u64 = 96;

/// A place of computation.
#[derive(Clone)]
pub enum Target {
    /// A Vulkan device, in f32.
    Device(Arc<Context>),
    /// The processor, in f64.
    Reference,
}

impl Target {
    /// Opens the Vulkan device whose name contains `name`, or the best one. `cpu` is the f64 reference. With `ISOTHERM_VALIDATION=1` in the environment the
    /// validation layer checks every call.
    ///
    /// # Errors
    /// There is no such device, or it lacks a feature that isotherm needs.
    pub fn open(name: Option<&str>) -> Result<Self, GpuError> {
        if name.is_some_and(|name| name.eq_ignore_ascii_case("cpu")) {
            return Ok(Self::Reference);
        }
        let validate = std::env::var_os("ISOTHERM_VALIDATION").is_some_and(|value| value == "1");
        Ok(Self::Device(Context::open(name, validate)?))
    }

    /// A place of the same kind for another thread. A device that is a processor has one queue, behind which threads would wait for each other, so it is
    /// opened again. Under the validation layer it is shared, because the messages of this place alone are read.
    ///
    /// # Errors
    /// A device that can not be opened again.
    pub(crate) fn for_another_thread(&self) -> Result<Self, GpuError> {
        match self {
            Self::Device(context) if context.info.kind == "cpu" && !context.is_validated() => {
                Self::open(Some(&context.info.name))
            }
            _ => Ok(self.clone()),
        }
    }

    /// Name for users.
    pub fn name(&self) -> String {
        self.device().map_or("cpu (f64 reference)".to_owned(), |context| context.info.name.clone())
    }

    /// The device. `None` for the processor.
    pub fn device(&self) -> Option<&Arc<Context>> {
        match self {
            Self::Device(context) => Some(context),
            Self::Reference => None,
        }
    }

    /// Keeps memory of the host for an image of a camera while it is drawn.
    ///
    /// # Errors
    /// It does not suffice.
    pub(crate) fn reserve_image(&self, camera: &Camera) -> Result<Reservation, OverBudget> {
        let (width, height) = (camera.width, camera.height);
        let bytes = u64::from(width) * u64::from(height) * self.image_bytes(1);
        reserve_memory(bytes, || format!("an image of {width} x {height} pixels"))
    }

    /// Memory of the host that an image of several scenes takes [bytes a pixel]. A device keeps what each of them is drawn with.
    pub(crate) fn image_bytes(&self, scenes: u64) -> u64 {
        match self {
            Self::Device(_) => IMAGE + scenes * DEVICE_IMAGE,
            Self::Reference => IMAGE + REFERENCE_IMAGE,
        }
    }

    /// An engine for a scene. The engine draws where `camera` is given.
    ///
    /// # Errors
    /// An error of the device, or an image beyond the memory of the host.
    pub fn engine(&self, prepared: &Prepared, camera: Option<&Camera>) -> Result<Box<dyn Engine>, GpuError> {
        // The room is kept for each image as it is drawn. Kept here, it would count twice where the memory of a device is that of the host.
        drop(camera.map(|camera| self.reserve_image(camera)).transpose()?);
        let craft = self.engine_of_one_band(prepared, camera)?;
        if camera.is_none() || prepared.scene.bands.is_empty() {
            return Ok(craft);
        }
        let mut others = Vec::new();
        for band in 1..prepared.scene.bands.len() {
            let prepared = prepared.in_band(band);
            let engine = self.engine_of_one_band(&prepared, camera)?;
            others.push((prepared, engine));
        }
        Ok(Box::new(BandsEngine::new(craft, &prepared.scene, camera, others)))
    }

    /// An engine that draws the first band of a scene.
    fn engine_of_one_band(&self, prepared: &Prepared, camera: Option<&Camera>) -> Result<Box<dyn Engine>, GpuError> {
        Ok(match self {
            Self::Device(context) => Box::new(DeviceEngine::new(context, prepared, camera)?),
            Self::Reference => Box::new(ReferenceEngine::new(prepared, camera)),
        })
    }

    /// Temperatures [K] after every step of a node that starts at rest and receives one target in each step.
    ///
    /// # Errors
    /// An error of the device.
    pub(crate) fn respond(&self, transition: &Transition, initial: f64, targets: &[f64]) -> Result<Vec<f64>, GpuError> {
        let Self::Device(context) = self else { return Ok(respond_f64(transition, initial, targets)) };
        let run =
            ResponseRun { initial: initial as f32, targets: targets.iter().map(|target| *target as f32).collect() };
        Ok(respond(context, transition, &[run])?.into_iter().flatten().map(f64::from).collect())
    }
}

/// [`Target::respond`] in f64.
pub fn respond_f64(transition: &Transition, initial: f64, targets: &[f64]) -> Vec<f64> {
    let mut state = TransitionState::settled(initial, transition);
    let step = |target: &f64| {
        let (next, temperature) = transition_step(state, *target, 1.0, transition);
        state = next;
        temperature
    };
    targets.iter().map(step).collect()
}
