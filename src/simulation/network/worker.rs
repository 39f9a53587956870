//! Who integrates a scene's network: a device, or the f64 twin.

use std::convert::Infallible;

use crate::gpu::error::GpuError;
use crate::gpu::network::NetworkStepper;
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::stepper::{Attempt, Method, Stepper, WorkCounts};

/// Who integrates.
pub(super) enum Worker {
    /// In f32.
    Device(Box<NetworkStepper>),
    /// In f64.
    Host(Box<ReferenceStepper>),
}

/// What cannot fail.
pub(super) fn sure<T>(result: Result<T, Infallible>) -> T {
    match result {
        Ok(value) => value,
        Err(never) => match never {},
    }
}

impl Stepper for Worker {
    type Error = GpuError;

    fn set_heat(&mut self, power: &[f64], slope: &[f64]) -> Result<(), GpuError> {
        match self {
            Self::Device(stepper) => stepper.set_heat(power, slope),
            Self::Host(stepper) => {
                sure(stepper.set_heat(power, slope));
                Ok(())
            }
        }
    }

    fn balance(&mut self, t: f64) -> Result<bool, GpuError> {
        match self {
            Self::Device(stepper) => stepper.balance(t),
            Self::Host(stepper) => Ok(sure(stepper.balance(t))),
        }
    }

    fn attempt(&mut self, method: Method, t: f64, step: f64, count: u32) -> Result<Attempt, GpuError> {
        match self {
            Self::Device(stepper) => stepper.attempt(method, t, step, count),
            Self::Host(stepper) => Ok(sure(stepper.attempt(method, t, step, count))),
        }
    }

    fn hottest(&self) -> f64 {
        match self {
            Self::Device(stepper) => stepper.hottest(),
            Self::Host(stepper) => stepper.hottest(),
        }
    }

    fn keep(&mut self) -> Result<(), GpuError> {
        match self {
            Self::Device(stepper) => stepper.keep(),
            Self::Host(stepper) => {
                sure(stepper.keep());
                Ok(())
            }
        }
    }

    fn temperatures(&mut self) -> Result<Vec<f64>, GpuError> {
        match self {
            Self::Device(stepper) => stepper.temperatures(),
            Self::Host(stepper) => Ok(sure(stepper.temperatures())),
        }
    }

    fn set_temperatures(&mut self, temperatures: &[f64]) -> Result<(), GpuError> {
        match self {
            Self::Device(stepper) => stepper.set_temperatures(temperatures),
            Self::Host(stepper) => {
                sure(stepper.set_temperatures(temperatures));
                Ok(())
            }
        }
    }

    fn steady(&mut self, t: f64) -> Result<bool, GpuError> {
        match self {
            Self::Device(stepper) => stepper.steady(t),
            Self::Host(stepper) => Ok(sure(stepper.steady(t))),
        }
    }

    fn counts(&self) -> WorkCounts {
        match self {
            Self::Device(stepper) => stepper.counts(),
            Self::Host(stepper) => stepper.counts(),
        }
    }
}

impl Worker {
    /// Time of all submissions so far on the device's own clock [ms]; `None` without a device or a clock.
    pub(super) fn device_ms(&self) -> Option<f64> {
        match self {
            Self::Device(stepper) => stepper.device_ms(),
            Self::Host(_) => None,
        }
    }

    /// Whether anything was written to what the scene had to spare since this was last asked.
    pub(super) fn wrote_spare(&mut self) -> bool {
        match self {
            Self::Device(stepper) => stepper.wrote_spare(),
            Self::Host(_) => false,
        }
    }

    /// Bytes on the device as they were allocated; `None` without one, and of a small network.
    pub(super) fn device_bytes(&self) -> Option<u64> {
        match self {
            Self::Device(stepper) => stepper.device_bytes(),
            Self::Host(_) => None,
        }
    }
}
