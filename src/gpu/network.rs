//! Thermal networks on the device: the f32 side of [`Stepper`].
//!
//! A temperature is a base, a multiple of 1/1024 K, and a rest of at most 1/2048 K: what a step adds is not lost however small.

mod fused;
mod schedule;
mod stages;
mod tables;

use std::sync::Arc;

use fused::Fused;

use super::context::Context;
use super::error::GpuError;
use crate::thermal::network::stepper::{Attempt, Method, Stepper, WorkCounts};
use crate::thermal::network::{Network, NodeKind};

/// The hottest temperature [K] that base and rest hold.
pub const HOTTEST: f64 = 8000.0;

/// A network with its state on the device.
pub struct NetworkStepper {
    fused: Fused,
}

impl NetworkStepper {
    /// Uploads a network; `sensors` are the nodes whose temperatures every attempt tells.
    ///
    /// # Errors
    /// A network that single precision or the device does not hold, or a call that fails.
    pub fn new(context: &Arc<Context>, network: &Network, sensors: &[u32]) -> Result<Self, GpuError> {
        check(network, sensors)?;
        let fused = Fused::new(context, network, sensors)?
            .ok_or_else(|| unsupported(format!("{} nodes are more than one workgroup takes", network.len())))?;
        let mut stepper = Self { fused };
        stepper.set_temperatures(&network.temperatures)?;
        Ok(stepper)
    }
}

fn unsupported(reason: String) -> GpuError {
    GpuError::UnsupportedNetwork { reason }
}

fn check(network: &Network, sensors: &[u32]) -> Result<(), GpuError> {
    if network.is_empty() {
        return Err(unsupported("there are no nodes".to_owned()));
    }
    let nodes = network.len() as u32;
    let ends = network.linear.iter().map(|conductor| conductor.nodes);
    let ends = ends.chain(network.radiative.iter().map(|conductor| conductor.nodes)).flatten();
    if let Some(node) = ends.chain(sensors.iter().copied()).find(|node| *node >= nodes) {
        return Err(unsupported(format!("a conductor or a sensor names node {node} of {nodes}")));
    }
    // 1 / C and the sums must be numbers in f32.
    let representable = |value: f64| value == 0.0 || (1e-30..1e30).contains(&value.abs());
    for (node, capacitance) in network.capacitances.iter().enumerate() {
        if network.kinds[node] == NodeKind::Diffusive && !representable(*capacitance) {
            return Err(unsupported(format!("node {node} has a capacitance of {capacitance} J/K")));
        }
    }
    check_temperatures(&network.temperatures)
}

fn check_temperatures(temperatures: &[f64]) -> Result<(), GpuError> {
    match temperatures.iter().position(|temperature| !(0.0..=HOTTEST).contains(temperature)) {
        Some(node) => Err(unsupported(format!(
            "node {node} is at {} K; the device takes 0 to {HOTTEST} K",
            temperatures[node]
        ))),
        None => Ok(()),
    }
}

/// Base and rest of a temperature [K].
fn split(temperature: f64) -> [f32; 2] {
    let base = (temperature * 1024.0).round() / 1024.0;
    [base as f32, (temperature - base) as f32]
}

impl Stepper for NetworkStepper {
    type Error = GpuError;

    fn set_heat(&mut self, power: &[f64], slope: &[f64]) -> Result<(), GpuError> {
        let heat: Vec<[f32; 2]> =
            power.iter().zip(slope).map(|(power, slope)| [*power as f32, *slope as f32]).collect();
        self.fused.set_heat(&heat);
        Ok(())
    }

    fn balance(&mut self, t: f64) -> Result<bool, GpuError> {
        self.fused.balance(t)
    }

    fn attempt(&mut self, method: Method, t: f64, step: f64, count: u32) -> Result<Attempt, GpuError> {
        self.fused
            .attempt(method, t, step, count)?
            .ok_or_else(|| unsupported(format!("{method} takes more than a dispatch can do")))
    }

    fn keep(&mut self) -> Result<(), GpuError> {
        self.fused.keep();
        Ok(())
    }

    fn temperatures(&mut self) -> Result<Vec<f64>, GpuError> {
        Ok(self.fused.state().iter().map(|[base, rest]| f64::from(*base) + f64::from(*rest)).collect())
    }

    fn set_temperatures(&mut self, temperatures: &[f64]) -> Result<(), GpuError> {
        check_temperatures(temperatures)?;
        let state: Vec<[f32; 2]> = temperatures.iter().map(|temperature| split(*temperature)).collect();
        self.fused.set_state(&state);
        Ok(())
    }

    fn steady(&mut self, t: f64) -> Result<bool, GpuError> {
        self.fused.steady(t)?.ok_or_else(|| unsupported("its nodes are too much coupled to be eliminated".to_owned()))
    }

    fn counts(&self) -> WorkCounts {
        self.fused.counts()
    }
}
