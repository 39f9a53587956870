//! Heat flows and the push of light of a simulation that is driven from outside, and the powers of its heaters.

use glam::DVec3;

use super::Simulation;
use crate::simulation::budget::{node_budgets, part_heat};
use crate::simulation::facade_error::SimulationError;
use crate::simulation::light_force::{LightForce, light_force};
use crate::simulation::prepare_steps::nearest_node;
use crate::thermal::budget::Budget;

/// Largest power of a heater [W].
const MOST_WATTS: f64 = 1e12;

impl Simulation {
    /// Heat of each part by each cause [W], in the order of the parts and of [`crate::thermal::budget::CHANNELS`].
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn part_heat(&mut self) -> Result<Vec<Budget>, SimulationError> {
        self.begin()?;
        let budgets = node_budgets(&self.prepared, &mut *self.engine, self.last, self.time)?;
        Ok(part_heat(&self.prepared, &budgets).into_iter().map(|(heat, _)| heat).collect())
    }

    /// Force and torque of light about a point of the body frame [m].
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn light_force(&mut self, about: DVec3) -> Result<LightForce, SimulationError> {
        self.begin()?;
        Ok(light_force(&self.prepared, &mut *self.engine, self.last, self.time, about)?)
    }

    /// Place of the node nearest to a position in the file's pose [m] in the list of all nodes on the device. `None` where the part has no node.
    pub(crate) fn nearest_slot(&self, position: DVec3, part: Option<u32>) -> Option<usize> {
        nearest_node(&self.prepared.nodes, position, part)
    }

    /// Name and present power [W] of each heater: the names of its parts, and from the second heater of these parts on a number. A thermostat may hold its heater off.
    pub(crate) fn heaters(&self) -> Vec<(String, f64)> {
        let Some(network) = &self.prepared.network else { return Vec::new() };
        let mut named: Vec<(String, f64)> = Vec::new();
        for (heater, power) in self.prepared.scene.heaters.iter().zip(network.powers_at(self.time)) {
            let parts = heater.parts.join(", ");
            let name = (2..).map(|number| format!("{parts} #{number}"));
            let mut names = std::iter::once(parts.clone()).chain(name);
            let name = names.find(|name| named.iter().all(|(known, _)| known != name)).unwrap_or(parts);
            named.push((name, power));
        }
        named
    }

    /// The number of a heater that is to have a power [W].
    ///
    /// # Errors
    /// There is no such heater, a thermostat switches it, or the power is too large.
    pub(crate) fn check_heater(&self, name: &str, power: f64) -> Result<usize, SimulationError> {
        let heaters = self.heaters();
        let Some(number) = heaters.iter().position(|(known, _)| known == name) else {
            let known: Vec<String> = heaters.into_iter().map(|(name, _)| name).collect();
            return Err(SimulationError::NoHeater { name: name.to_owned(), known });
        };
        let refused = |reason| Err(SimulationError::HeaterPower { name: name.to_owned(), power, reason });
        if self.prepared.scene.heaters[number].thermostat.is_some() {
            return refused("a thermostat switches it");
        }
        if power.is_nan() || power.abs() > MOST_WATTS {
            return refused("powers are finite, and at most 1e12 W");
        }
        Ok(number)
    }

    /// Gives a heater a constant power [W] from the present time on, in place of the power of the scene. A saved state does not keep it.
    ///
    /// # Errors
    /// As for [`Simulation::check_heater`].
    pub(crate) fn set_heater(&mut self, name: &str, power: f64) -> Result<(), SimulationError> {
        let number = self.check_heater(name, power)?;
        self.prepared.network.iter().for_each(|network| network.set_power(number, power));
        Ok(())
    }
}
