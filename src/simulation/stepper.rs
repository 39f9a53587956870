//! Stepper of a thermal network: a device in f32, or the f64 twin.

use std::convert::Infallible;

use crate::gpu::error::GpuError;
use crate::gpu::network::{ESTIMATE_FLOOR, NetworkStepper};
use crate::saved::Saved;
use crate::thermal::network::Network;
use crate::thermal::network::control::FLOOR;
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::stepper::{Attempt, StepMethod, Stepper, WorkCounts};

/// Most nodes of a network that the processor integrates in f64 although there is a device. On lavapipe, where each stage is a dispatch too, the processor
/// was 2 to 8000 times as fast at 16 to 1,058 nodes, and 0.7 to 12 times at 4,096 (docs/benchmarks.md, small networks).
pub(crate) const ON_PROCESSOR_AT_MOST: usize = 1024;

/// Whether the processor integrates a network of `nodes` although there is a device.
pub(crate) fn is_small(nodes: usize) -> bool {
    nodes <= ON_PROCESSOR_AT_MOST
}

/// Why the processor integrates a small network of `nodes`, in words.
pub(crate) fn why_on_processor(nodes: usize) -> String {
    format!("{nodes} nodes are at most {ON_PROCESSOR_AT_MOST}, which a device would integrate more slowly")
}

/// A stepper of a thermal network.
pub enum AnyStepper {
    /// The device, in f32.
    Device(Box<NetworkStepper>),
    /// The processor, in f64.
    Reference(Box<ReferenceStepper>),
}

impl AnyStepper {
    /// A stepper in f64 on the processor.
    pub(crate) fn reference(network: &Network, sensors: &[u32]) -> Self {
        Self::Reference(Box::new(ReferenceStepper::new(network.clone(), sensors)))
    }

    /// Estimates of an error below this are rounding [K].
    pub(crate) fn floor(&self) -> f64 {
        match self {
            Self::Device(_) => ESTIMATE_FLOOR,
            Self::Reference(_) => FLOOR,
        }
    }

    pub(crate) fn device(&self) -> Option<&NetworkStepper> {
        match self {
            Self::Device(stepper) => Some(stepper),
            Self::Reference(_) => None,
        }
    }

    /// Device time of all submissions so far [ms]. `None` without a device or a clock.
    pub(crate) fn device_ms(&self) -> Option<f64> {
        self.device()?.device_ms()
    }

    /// The state that a run needs to go on later, bit for bit.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn save(&mut self) -> Result<Saved, GpuError> {
        let WorkCounts { dispatches, stages, sub_steps, iterations } = self.counts();
        let mut saved = match self {
            Self::Device(stepper) => stepper.save(),
            Self::Reference(_) => {
                let mut saved = Saved::default();
                saved.put("temperatures", &self.temperatures()?);
                saved
            }
        };
        saved.put("counts", &[dispatches, stages, sub_steps, iterations]);
        Ok(saved)
    }

    /// Restores the state of `save`.
    ///
    /// # Errors
    /// A state of another network, or a call that fails.
    pub(crate) fn restore(&mut self, saved: &Saved) -> Result<(), GpuError> {
        let [dispatches, stages, sub_steps, iterations] = saved.array("counts")?;
        let counts = WorkCounts { dispatches, stages, sub_steps, iterations };
        match self {
            Self::Device(stepper) => stepper.restore(saved, counts),
            Self::Reference(stepper) => {
                let Ok(now) = stepper.temperatures();
                let Ok(()) = stepper.set_temperatures(&saved.list_of("temperatures", now.len())?);
                stepper.set_counts(counts);
                Ok(())
            }
        }
    }

    fn each<T>(
        &mut self,
        device: impl FnOnce(&mut NetworkStepper) -> Result<T, GpuError>,
        reference: impl FnOnce(&mut ReferenceStepper) -> Result<T, Infallible>,
    ) -> Result<T, GpuError> {
        match self {
            Self::Device(stepper) => device(stepper),
            Self::Reference(stepper) => reference(stepper).map_err(|never| match never {}),
        }
    }
}

impl Stepper for AnyStepper {
    type Error = GpuError;

    fn set_heat(&mut self, power: &[f64], slope: &[f64]) -> Result<(), GpuError> {
        self.each(|device| device.set_heat(power, slope), |reference| reference.set_heat(power, slope))
    }

    fn balance(&mut self, t: f64) -> Result<bool, GpuError> {
        self.each(|device| device.balance(t), |reference| reference.balance(t))
    }

    fn attempt(&mut self, method: StepMethod, t: f64, step: f64, count: u32) -> Result<Attempt, GpuError> {
        self.each(|device| device.attempt(method, t, step, count), |twin| twin.attempt(method, t, step, count))
    }

    fn keep(&mut self) -> Result<(), GpuError> {
        self.each(Stepper::keep, Stepper::keep)
    }

    fn temperatures(&mut self) -> Result<Vec<f64>, GpuError> {
        self.each(Stepper::temperatures, Stepper::temperatures)
    }

    fn set_temperatures(&mut self, temperatures: &[f64]) -> Result<(), GpuError> {
        self.each(|device| device.set_temperatures(temperatures), |reference| reference.set_temperatures(temperatures))
    }

    fn steady(&mut self, t: f64) -> Result<bool, GpuError> {
        self.each(|device| device.steady(t), |reference| reference.steady(t))
    }

    fn hottest(&self) -> f64 {
        match self {
            Self::Device(stepper) => stepper.hottest(),
            Self::Reference(stepper) => stepper.hottest(),
        }
    }

    fn counts(&self) -> WorkCounts {
        match self {
            Self::Device(stepper) => stepper.counts(),
            Self::Reference(stepper) => stepper.counts(),
        }
    }
}
