//! Thermal networks on the device, integrated in f32: the GPU side of [`Stepper`].
//!
//! A temperature is the sum of a base, a multiple of 1/256 K, and a rest of at most 1/512 K. Small changes are thus not
//! lost to rounding.
//!
//! Each stage is a dispatch over all nodes (`wide`). Newton's method for an arithmetic node starts at most at the
//! temperature that each term of the balance alone would allow. From above it can not overshoot, but from below it can
//! reach millions of kelvin.

mod bytes;
pub mod frame;
mod rows;
mod sliced;
mod solve_frame;
pub mod uses;
mod weights;
mod wide;

use std::sync::Arc;

use sliced::GROUP;
use wide::Wide;

pub use bytes::NetworkBytes;
pub use wide::NODES_AT_MOST;

use super::context::Context;
use super::error::GpuError;
use super::memory::Buffer;
use crate::saved::Saved;
use crate::thermal::network::stepper::{Attempt, StepMethod, Stepper, WorkCounts};
use crate::thermal::network::{Network, NodeKind};

/// Highest temperature that base and rest hold [K]. The last exact base is 2^24 / 256 K.
pub const HOTTEST: f64 = 64_000.0;

/// Most heat of a node [W]. Its fourth root and products stay within f32.
const HEAT_AT_MOST: f64 = 1e25;

/// Range of magnitudes that leaves room for sums and products in f32 (1.2e-38 to 3.4e38).
const LEAST: f64 = 1e-30;
const MOST: f64 = 1e30;

/// Error estimates of a sub-step below this are rounding [K]. The shaders already subtract the rounding that the size
/// of their terms explains. With 1e-7 K a slow sensor switched 0.1 s late after 4e5 s; with 1e-8 K it is 0.02 s.
pub const ESTIMATE_FLOOR: f64 = 1e-8;

/// A thermal network with its state on the device.
pub struct NetworkStepper {
    wide: Wide,
}

impl NetworkStepper {
    /// Uploads a network. Every attempt reports the temperatures of the nodes `sensors`.
    ///
    /// # Errors
    /// The device or single precision can not hold the network, or a Vulkan call fails.
    pub fn new(context: &Arc<Context>, network: &Network, sensors: &[u32]) -> Result<Self, GpuError> {
        Self::beside(context, network, sensors, Vec::new())
    }

    /// Uploads a network beside a scene. Stepping or settling the network may overwrite the buffers `spare` (see
    /// [`Self::wrote_spare`]), and nothing else may use them meanwhile.
    pub fn beside(
        context: &Arc<Context>,
        network: &Network,
        sensors: &[u32],
        spare: Vec<Arc<Buffer>>,
    ) -> Result<Self, GpuError> {
        check(network, sensors)?;
        let mut stepper = Self { wide: Wide::new(context, network, sensors, spare)? };
        stepper.set_temperatures(&network.temperatures)?;
        Ok(stepper)
    }

    /// Device time of all submissions so far [ms]; `None` without timestamps.
    pub fn device_ms(&self) -> Option<f64> {
        self.wide.device_ms()
    }

    /// Whether the spare buffers were written since the last call.
    pub fn wrote_spare(&mut self) -> bool {
        self.wide.wrote_spare()
    }

    /// Allocated device memory in bytes, without spare buffers and host-visible buffers.
    pub fn device_bytes(&self) -> u64 {
        self.wide.device_bytes()
    }

    /// The state that a run needs to go on later, bit for bit, without the work counts.
    pub fn save(&self) -> Saved {
        let mut saved = Saved::default();
        saved.put("state", &self.wide.state().collect::<Vec<_>>());
        saved.put_all("wide", self.wide.save());
        saved
    }

    /// Takes what `save` gave, and the work counts of that time.
    ///
    /// # Errors
    /// A state of another network, or a call that fails.
    pub fn restore(&mut self, saved: &Saved, counts: WorkCounts) -> Result<(), GpuError> {
        let state: Vec<[f32; 2]> = saved.list_of("state", self.wide.state().count())?;
        self.wide.set_state(&state)?;
        Ok(self.wide.restore(&saved.part("wide"), counts)?)
    }
}

/// First node of a group with more conductor ends than one invocation handles. Nodes with rows this long keep their
/// order of the file.
fn crowded_group(network: &Network) -> Option<usize> {
    let linear = network.linear.iter().map(|one| one.nodes);
    let mut ends = vec![0u32; network.len().div_ceil(GROUP)];
    for node in linear.chain(network.radiative.iter().map(|one| one.nodes)).filter(|[a, b]| a != b).flatten() {
        ends[node as usize / GROUP] += u32::from(network.kinds[node as usize] != NodeKind::Boundary);
    }
    ends.iter().position(|ends| *ends as usize > wide::LINKS_AT_MOST).map(|group| GROUP * group)
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
    if network.len() > NODES_AT_MOST {
        return Err(unsupported(format!("it has more than {NODES_AT_MOST} nodes")));
    }
    // One invocation handles the conductors of a whole group.
    if let Some(first) = crowded_group(network) {
        return Err(unsupported(format!(
            "nodes {first} to {} of the file's order have more than {} ends of conductors in total; move one of them to \
             another place in the file, or use --device cpu",
            (first + GROUP).min(network.len()) - 1,
            wide::LINKS_AT_MOST
        )));
    }
    // 1 / C and the sums must be finite in f32, and small values must not become zero.
    let linear = network.linear.iter().map(|one| (one.nodes, "GL", one.conductance, "W/K"));
    let radiative = network.radiative.iter().map(|one| (one.nodes, "GR", one.exchange_area, "m2"));
    if let Some(([a, b], what, value, unit)) = linear.chain(radiative).find(|one| !representable(one.2)) {
        return Err(beyond(&format!("nodes {a} and {b} of the file's order have a {what}"), value, unit));
    }
    if let Some(node) = network.emissive_areas.iter().position(|area| !representable(*area)) {
        return Err(beyond(
            &format!("node {node} of the file's order has an emissive area"),
            network.emissive_areas[node],
            "m2",
        ));
    }
    if !(0.0..=HOTTEST).contains(&network.space_temperature) {
        let space = network.space_temperature;
        return Err(unsupported(format!("space is at {space} K; the device takes 0 to {HOTTEST} K")));
    }
    for (node, capacitance) in network.capacitances.iter().enumerate() {
        if network.kinds[node] == NodeKind::Diffusive && !representable(*capacitance) {
            return Err(beyond(&format!("node {node} of the file's order has a capacitance"), *capacitance, "J/K"));
        }
    }
    check_temperatures(&network.temperatures)
}

/// Whether f32 holds the value with room for sums and products.
fn representable(value: f64) -> bool {
    value == 0.0 || (LEAST..MOST).contains(&value.abs())
}

/// The error for a value that is not [`representable`].
fn beyond(what: &str, value: f64, unit: &str) -> GpuError {
    unsupported(format!(
        "{what} of {value:e} {unit}; it takes 0, or {LEAST:e} to below {MOST:e} {unit}. Sums and products of other numbers \
         leave the range of single precision"
    ))
}

fn check_temperatures(temperatures: &[f64]) -> Result<(), GpuError> {
    match temperatures.iter().position(|temperature| !(0.0..=HOTTEST).contains(temperature)) {
        Some(node) => {
            Err(unsupported(format!("node {node} is at {} K; the device takes 0 to {HOTTEST} K", temperatures[node])))
        }
        None => Ok(()),
    }
}

/// Splits a temperature into base and rest [K].
pub(super) fn split(temperature: f64) -> [f32; 2] {
    let base = (temperature * 256.0).round() / 256.0;
    [base as f32, (temperature - base) as f32]
}

impl Stepper for NetworkStepper {
    type Error = GpuError;

    fn set_heat(&mut self, power: &[f64], slope: &[f64]) -> Result<(), GpuError> {
        if let Some(node) = power.iter().position(|power| power.abs() > HEAT_AT_MOST) {
            return Err(unsupported(format!(
                "node {node} of the file's order takes {:e} W; it takes {HEAT_AT_MOST:e} W at most, so that single \
                 precision holds its balance temperature",
                power[node]
            )));
        }
        let heat: Vec<[f32; 2]> =
            power.iter().zip(slope).map(|(power, slope)| [*power as f32, *slope as f32]).collect();
        self.wide.set_heat(&heat)
    }

    fn balance(&mut self, t: f64) -> Result<bool, GpuError> {
        self.wide.balance(t)
    }

    fn attempt(&mut self, method: StepMethod, t: f64, step: f64, count: u32) -> Result<Attempt, GpuError> {
        self.wide.attempt(method, t, step, count)
    }

    fn keep(&mut self) -> Result<(), GpuError> {
        self.wide.keep()
    }

    fn temperatures(&mut self) -> Result<Vec<f64>, GpuError> {
        Ok(self.wide.state().map(|[base, rest]| f64::from(base) + f64::from(rest)).collect())
    }

    fn set_temperatures(&mut self, temperatures: &[f64]) -> Result<(), GpuError> {
        check_temperatures(temperatures)?;
        let state: Vec<[f32; 2]> = temperatures.iter().map(|temperature| split(*temperature)).collect();
        self.wide.set_state(&state)
    }

    fn steady(&mut self, t: f64) -> Result<bool, GpuError> {
        self.wide.steady(t)
    }

    fn hottest(&self) -> f64 {
        HOTTEST
    }

    fn counts(&self) -> WorkCounts {
        self.wide.counts()
    }
}
