//! Thermal networks on the device: the f32 side of [`Stepper`].
//!
//! A temperature is a base, a multiple of 1/256 K, and a rest of at most 1/512 K: what a step adds is not lost however small.
//!
//! A small network is one workgroup's (`fused`): all sub-steps of a try take a few dispatches. Any other takes a dispatch a stage (`wide`), and so does a
//! small one whose elimination takes too many products. The balances of arithmetic nodes start no warmer than each term of the balance alone
//! would allow: from there Newton's method can not overshoot, while from below it would go millions of kelvin high.

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
use crate::thermal::network::stepper::{Attempt, Method, Stepper, WorkCounts};
use crate::thermal::network::{Network, NodeKind};

/// The hottest temperature [K] that base and rest hold: 2^24 / 256 K is the last whole base.
pub const HOTTEST: f64 = 64_000.0;

/// The most heat of a node [W]: its fourth root and its products stay within f32.
const HEAT_AT_MOST: f64 = 1e25;

/// Magnitudes that single precision holds with room for sums and products (it ends at 1.2e-38 and 3.4e38).
const LEAST: f64 = 1e-30;
const MOST: f64 = 1e30;

/// Estimates of the error of a sub-step below this are rounding [K]: the shaders already take off what the size of their
/// terms explains. At 1e-7 K a slow sensor switched 0.1 s late after 4e5 s, where 1e-8 K leaves 0.02 s.
pub const ESTIMATE_FLOOR: f64 = 1e-8;

/// A network with its state on the device.
pub struct NetworkStepper {
    path: Path,
    /// What the wide path is made of where the fused one cannot go on; empty where there is no need.
    network: Network,
    sensors: Vec<u32>,
    heat: Vec<[f32; 2]>,
    spare: Vec<Arc<Buffer>>,
    context: Arc<Context>,
}

/// How the network is integrated.
enum Path {
    /// One workgroup does all.
    Fused(Box<Fused>),
    /// A dispatch for every stage.
    Wide(Box<Wide>),
}

impl NetworkStepper {
    /// Uploads a network; `sensors` are the nodes whose temperatures every attempt tells.
    ///
    /// # Errors
    /// A network that single precision or the device does not hold, or a call that fails.
    pub fn new(context: &Arc<Context>, network: &Network, sensors: &[u32]) -> Result<Self, GpuError> {
        Self::beside(context, network, sensors, Vec::new())
    }

    /// The same beside a scene: while the network is stepped or settled, what is in `spare` may be overwritten (see
    /// [`Self::wrote_spare`]), and nothing else uses it.
    ///
    /// # Errors
    /// As for `new`.
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

    /// Uploads a network of any size to be integrated by a dispatch for every stage.
    ///
    /// # Errors
    /// As for `new`.
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

    /// Goes on with a dispatch for every stage: what is asked for takes more than one workgroup can do in a dispatch.
    fn widen(&mut self) -> Result<(), GpuError> {
        let mut wide = wide_path(&self.context, &self.network, &self.sensors, self.spare.clone())?;
        wide.set_state(&self.state())?;
        wide.set_heat(&self.heat)?;
        self.path = Path::Wide(Box::new(wide));
        Ok(())
    }

    /// Whether one workgroup takes all sub-steps of an attempt, in place of a dispatch for every stage.
    pub fn is_fused(&self) -> bool {
        matches!(self.path, Path::Fused(_))
    }

    /// Time of all submissions so far by the device's own clock [ms], where it has one.
    pub fn device_ms(&self) -> Option<f64> {
        match &self.path {
            Path::Fused(fused) => fused.device_ms(),
            Path::Wide(wide) => wide.device_ms(),
        }
    }

    /// Whether anything was written to the spare buffers since this was last asked.
    pub fn wrote_spare(&mut self) -> bool {
        match &mut self.path {
            Path::Fused(_) => false,
            Path::Wide(wide) => wide.wrote_spare(),
        }
    }

    /// Bytes on the device as they were allocated, spare buffers and what the host reads and writes not counted; `None`
    /// of a small network.
    pub fn device_bytes(&self) -> Option<u64> {
        match &self.path {
            Path::Fused(_) => None,
            Path::Wide(wide) => Some(wide.device_bytes()),
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
    // One invocation takes the conductors of a group of nodes one after the other.
    if let Some(first) = crowded_group(network) {
        return Err(unsupported(format!(
            "nodes {first} to {} of the file's order have more than {} ends of conductors in all: move one of them to another \
             place, or use --device cpu",
            (first + GROUP).min(network.len()) - 1,
            wide::LINKS_AT_MOST
        )));
    }
    Wide::new(context, network, sensors, spare)
}

/// The first node of a group with more ends of conductors than one invocation takes; nodes of so long rows stand in the order
/// of the file.
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
    // 1 / C and the sums must be numbers in f32, and what is small must not become none.
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

/// Whether a value is one of f32, with room for sums and products.
fn representable(value: f64) -> bool {
    value == 0.0 || (LEAST..MOST).contains(&value.abs())
}

/// The error of a value that is not [`representable`].
fn beyond(what: &str, value: f64, unit: &str) -> GpuError {
    unsupported(format!(
        "{what} of {value:e} {unit}; it takes 0, or {LEAST:e} to below {MOST:e} {unit}, whose sums and products single \
         precision holds"
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

/// Base and rest of a temperature [K].
fn split(temperature: f64) -> [f32; 2] {
    let base = (temperature * 256.0).round() / 256.0;
    [base as f32, (temperature - base) as f32]
}

impl Stepper for NetworkStepper {
    type Error = GpuError;

    fn set_heat(&mut self, power: &[f64], slope: &[f64]) -> Result<(), GpuError> {
        if let Some(node) = power.iter().position(|power| power.abs() > HEAT_AT_MOST) {
            return Err(unsupported(format!(
                "node {node} of the file's order takes {:e} W; it takes {HEAT_AT_MOST:e} W at most, whose balance single \
                 precision holds",
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
