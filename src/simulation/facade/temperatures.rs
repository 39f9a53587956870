//! Temperatures of a simulation that is driven from outside: by node and by part.

use super::super::engine::{Delivered, Order};
use super::super::facade_error::SimulationError;
use super::Simulation;
use crate::model::nodes::GROUP;

/// Temperatures of a part [K].
#[derive(Debug, Clone, PartialEq)]
pub struct PartTemperature {
    /// Name of the part.
    pub part: String,
    /// Mean over its area.
    pub mean: f64,
    /// Lowest of its nodes.
    pub least: f64,
    /// Highest of its nodes.
    pub greatest: f64,
}

impl Simulation {
    /// Present temperature of each node [K]. Node `i` is vertex `i` of the model with the scene's node density.
    ///
    /// # Errors
    /// A call that fails.
    pub fn node_temperatures(&mut self) -> Result<Vec<f32>, SimulationError> {
        let of_slots = self.slot_temperatures()?;
        let of_node = |slot: &u32| of_slots[*slot as usize];
        Ok(self.prepared.nodes.node_of_vertex.iter().map(of_node).collect())
    }

    /// Position of each node in the body frame, in the file's pose [m].
    pub fn node_positions(&self) -> Vec<[f32; 3]> {
        let nodes = &self.prepared.nodes;
        nodes.node_of_vertex.iter().map(|slot| nodes.positions[*slot as usize].to_array()).collect()
    }

    /// Index of each node's part in the parts of [`Simulation::prepared`].
    pub fn node_parts(&self) -> Vec<u32> {
        let nodes = &self.prepared.nodes;
        nodes.node_of_vertex.iter().map(|slot| nodes.group_part[*slot as usize / GROUP]).collect()
    }

    /// Present temperatures of each part [K], in the order of the parts.
    ///
    /// # Errors
    /// A call that fails.
    pub fn part_temperatures(&mut self) -> Result<Vec<PartTemperature>, SimulationError> {
        let of_slots = self.slot_temperatures()?;
        let nodes = &self.prepared.nodes;
        let mut sums = vec![([f64::INFINITY, f64::NEG_INFINITY], 0.0, 0.0); self.prepared.parts.len()];
        for slot in &nodes.node_of_vertex {
            let slot = *slot as usize;
            let (temperature, area) = (f64::from(of_slots[slot]), nodes.areas[slot]);
            let (range, heat, whole) = &mut sums[nodes.group_part[slot / GROUP] as usize];
            *range = [range[0].min(temperature), range[1].max(temperature)];
            *heat += area * temperature;
            *whole += area;
        }
        let named = self.prepared.parts.iter().zip(sums);
        let part = |(name, ([least, greatest], heat, area)): (&String, ([f64; 2], f64, f64))| PartTemperature {
            part: name.clone(),
            mean: heat / area,
            least,
            greatest,
        };
        Ok(named.map(part).collect())
    }

    /// Temperatures in the order of the device [K], padding included.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn slot_temperatures(&mut self) -> Result<Vec<f32>, SimulationError> {
        self.begin()?;
        self.read_temperatures()
    }

    /// The same without a beginning.
    pub(super) fn read_temperatures(&mut self) -> Result<Vec<f32>, SimulationError> {
        let order = Order { temperatures: true, time: self.time, ..Order::default() };
        self.engine.submit(None, order)?;
        let Delivered { temperatures, .. } = self.engine.deliver()?;
        Ok(temperatures.unwrap_or_default())
    }
}
