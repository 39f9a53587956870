//! Thermal networks on the device, integrated in f32: the GPU side of [`Stepper`].
//!
//! A temperature is the sum of a base, a multiple of 1/256 K, and a rest of at most 1/512 K. Small changes are thus not
//! lost to rounding.
//!
//! A small network runs in one workgroup (`fused`), where a dispatch takes many sub-steps. A larger network takes a
//! dispatch for each stage (`wide`). So does a small one whose elimination needs too many products. Newton's method for
//! an arithmetic node starts at most at the temperature that each term of the balance alone would allow. From above it
//! can not overshoot, but from below it can reach millions of kelvin.

mod bytes;
pub mod frame;
mod fused;
mod rows;
mod schedule;
mod sliced;
pub mod small_frame;
mod solve_frame;
mod tables;
pub mod uses;
mod weights;
mod wide;

use std::sync::Arc;

use fused::Fused;
use sliced::GROUP;
use wide::Wide;

pub use bytes::NetworkBytes;
pub use wide::NODES_AT_MOST;

use super::context::Context;
use super::error::GpuError;
use super::memory::Buffer;
use crate::saved::Saved;
use crate::thermal::network::stepper::{Attempt, Method, Stepper, WorkCounts};
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
    path: Path,
    /// The network, kept to build the wide path if the fused one can not go on; empty otherwise.
    network: Network,
    sensors: Vec<u32>,
    heat: Vec<[f32; 2]>,
    spare: Vec<Arc<Buffer>>,
    context: Arc<Context>,
}

/// Method of execution.
enum Path {
    /// One workgroup.
    Fused(Box<Fused>),
    /// A dispatch for each stage.
    Wide(Box<Wide>),
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
        let path = match Fused::new(context, network, sensors)? {
            Some(fused) => Path::Fused(Box::new(fused)),
            None => Path::Wide(Box::new(wide_path(context, network, sensors, spare.clone())?)),
        };
        Self::of(context, path, network, sensors, spare)
    }

    /// Uploads a network of any size for a dispatch for each stage.
    pub fn wide(context: &Arc<Context>, network: &Network, sensors: &[u32]) -> Result<Self, GpuError> {
        check(network, sensors)?;
        let wide = wide_path(context, network, sensors, Vec::new())?;
        Self::of(context, Path::Wide(Box::new(wide)), network, sensors, Vec::new())
    }

    fn of(
        context: &Arc<Context>,
        path: Path,
        network: &Network,
        sensors: &[u32],
        spare: Vec<Arc<Buffer>>,
    ) -> Result<Self, GpuError> {
        let kept = if matches!(path, Path::Fused(_)) { network.clone() } else { Network::default() };
        let heat = vec![[0.0; 2]; kept.len()];
        let (sensors, context) = (sensors.to_vec(), Arc::clone(context));
        let mut stepper = Self { path, network: kept, sensors, heat, spare, context };
        stepper.set_temperatures(&network.temperatures)?;
        Ok(stepper)
    }

    /// Changes to a dispatch for each stage, when the work is too much for a fused dispatch.
    fn widen(&mut self) -> Result<(), GpuError> {
        let mut wide = wide_path(&self.context, &self.network, &self.sensors, self.spare.clone())?;
        wide.set_state(&self.state())?;
        wide.set_heat(&self.heat)?;
        self.path = Path::Wide(Box::new(wide));
        Ok(())
    }

    /// Whether one workgroup takes all sub-steps of an attempt.
    pub fn is_fused(&self) -> bool {
        matches!(self.path, Path::Fused(_))
    }

    /// Device time of all submissions so far [ms]; `None` without timestamps.
    pub fn device_ms(&self) -> Option<f64> {
        match &self.path {
            Path::Fused(fused) => fused.device_ms(),
            Path::Wide(wide) => wide.device_ms(),
        }
    }

    /// Whether the spare buffers were written since the last call.
    pub fn wrote_spare(&mut self) -> bool {
        match &mut self.path {
            Path::Fused(_) => false,
            Path::Wide(wide) => wide.wrote_spare(),
        }
    }

    /// Allocated device memory in bytes, without spare buffers and host-visible buffers; `None` for a small network.
    pub fn device_bytes(&self) -> Option<u64> {
        match &self.path {
            Path::Fused(_) => None,
            Path::Wide(wide) => Some(wide.device_bytes()),
        }
    }

    /// The state that a run needs to go on later, bit for bit, without the work counts.
    pub fn save(&self) -> Saved {
        let mut saved = Saved::default();
        saved.put("state", &self.state());
        if let Path::Wide(wide) = &self.path {
            saved.put_all("wide", wide.save());
        }
        saved
    }

    /// Takes what `save` gave, and the work counts of that time.
    ///
    /// # Errors
    /// A state of another network, or a call that fails.
    pub fn restore(&mut self, saved: &Saved, counts: WorkCounts) -> Result<(), GpuError> {
        let wide = saved.has("wide.budgets");
        if wide && self.is_fused() {
            self.widen()?;
        }
        let state: Vec<[f32; 2]> = saved.list_of("state", self.state().len())?;
        match &mut self.path {
            Path::Fused(fused) => {
                fused.set_state(&state)?;
                fused.set_counts(counts);
                Ok(())
            }
            Path::Wide(wide) => {
                wide.set_state(&state)?;
                Ok(wide.restore(&saved.part("wide"), counts)?)
            }
        }
    }

    fn state(&self) -> Vec<[f32; 2]> {
        match &self.path {
            Path::Fused(fused) => fused.state().to_vec(),
            Path::Wide(wide) => wide.state().collect(),
        }
    }
}

fn wide_path(
    context: &Arc<Context>,
    network: &Network,
    sensors: &[u32],
    spare: Vec<Arc<Buffer>>,
) -> Result<Wide, GpuError> {
    if network.len() > wide::NODES_AT_MOST {
        return Err(unsupported(format!("it has more than {} nodes", wide::NODES_AT_MOST)));
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
    Wide::new(context, network, sensors, spare)
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
        match &mut self.path {
            Path::Fused(fused) => {
                fused.set_heat(&heat)?;
                self.heat = heat;
                Ok(())
            }
            Path::Wide(wide) => wide.set_heat(&heat),
        }
    }

    fn balance(&mut self, t: f64) -> Result<bool, GpuError> {
        match &mut self.path {
            Path::Fused(fused) => fused.balance(t),
            Path::Wide(wide) => wide.balance(t),
        }
    }

    fn attempt(&mut self, method: Method, t: f64, step: f64, count: u32) -> Result<Attempt, GpuError> {
        loop {
            match &mut self.path {
                Path::Wide(wide) => return wide.attempt(method, t, step, count),
                Path::Fused(fused) => match fused.attempt(method, t, step, count)? {
                    Some(attempt) => return Ok(attempt),
                    None => self.widen()?,
                },
            }
        }
    }

    fn keep(&mut self) -> Result<(), GpuError> {
        match &mut self.path {
            Path::Fused(fused) => {
                fused.keep();
                Ok(())
            }
            Path::Wide(wide) => wide.keep(),
        }
    }

    fn temperatures(&mut self) -> Result<Vec<f64>, GpuError> {
        Ok(self.state().iter().map(|[base, rest]| f64::from(*base) + f64::from(*rest)).collect())
    }

    fn set_temperatures(&mut self, temperatures: &[f64]) -> Result<(), GpuError> {
        check_temperatures(temperatures)?;
        let state: Vec<[f32; 2]> = temperatures.iter().map(|temperature| split(*temperature)).collect();
        match &mut self.path {
            Path::Fused(fused) => fused.set_state(&state),
            Path::Wide(wide) => wide.set_state(&state),
        }
    }

    fn steady(&mut self, t: f64) -> Result<bool, GpuError> {
        loop {
            match &mut self.path {
                Path::Wide(wide) => return wide.steady(t),
                Path::Fused(fused) => match fused.steady(t)? {
                    Some(found) => return Ok(found),
                    None => self.widen()?,
                },
            }
        }
    }

    fn hottest(&self) -> f64 {
        HOTTEST
    }

    fn counts(&self) -> WorkCounts {
        match &self.path {
            Path::Fused(fused) => fused.counts(),
            Path::Wide(wide) => wide.counts(),
        }
    }
}
