//! What the host does for a step before its frame: it steps a network, takes the temperatures of a file, and follows joints that have moved.

use super::DeviceEngine;
use crate::environment::StepLoad;
use crate::gpu::error::GpuError;
use crate::gpu::renderer::Renderer;
use crate::simulation::energy::absorbed_heat;
use crate::simulation::engine::{EngineError, EngineStep, Order};
use crate::simulation::given::GivenTemperatures;
use crate::simulation::network::NetworkRun;
use crate::thermal::planet_map::Equirectangular;

impl DeviceEngine {
    /// Steps the network under the load of a step, and before it keeps the temperatures where the order says so. The host integrates between the loads and
    /// the temperatures, so frames under way must end first.
    pub(super) fn step_network(
        &mut self,
        step: &EngineStep<'_>,
        order: &Order<'_>,
    ) -> Result<Option<Vec<f64>>, EngineError> {
        self.end_frames()?;
        if order.keep && self.network.is_some() {
            self.renderer.keep_temperatures()?;
        }
        let Some(network) = &mut self.network else { return Ok(None) };
        network.step_begins();
        let mut values = self.renderer.absorbed(step.load, Some(step.steps))?;
        network.step(network.scene().heat(|slot| f64::from(values[slot])), step.start, step.length)?;
        let tables = self.frames.tables.as_ref().filter(|_| order.absorbed);
        let heat = tables.map(|tables| absorbed_heat(tables, |slot| f64::from(values[slot])));
        put(&mut self.renderer, network, &mut values)?;
        network.step_ends();
        Ok(heat)
    }

    /// Finds the steady state of the network under a load at a time [s].
    pub(super) fn settle_network(&mut self, load: &StepLoad, time: f64) -> Result<(), EngineError> {
        let Some(network) = &mut self.network else { return Ok(()) };
        let mut values = self.renderer.absorbed(load, None)?;
        network.settle(network.scene().heat(|slot| f64::from(values[slot])), time)?;
        put(&mut self.renderer, network, &mut values)?;
        Ok(self.renderer.set_network(&network.temperatures(), network.on())?)
    }

    /// Writes the temperatures of a file at a time [s], and before them keeps those before the step where the order says so.
    pub(super) fn take_given(&mut self, given: &GivenTemperatures, time: f64, keep: bool) -> Result<(), EngineError> {
        self.end_frames()?;
        if keep {
            self.renderer.keep_temperatures()?;
        }
        let temperatures: Vec<f32> = given.at(time).iter().map(|kelvin| *kelvin as f32).collect();
        Ok(self.renderer.set_temperatures(&temperatures)?)
    }

    /// Writes temperatures of all nodes, for images alone.
    pub(super) fn take_shown(&mut self, temperatures: &[f32]) -> Result<(), EngineError> {
        self.end_frames()?;
        Ok(self.renderer.set_temperatures(temperatures)?)
    }

    /// Writes another map of the planet, after the images that show the last one.
    pub(super) fn take_planet_map(&mut self, map: &Equirectangular) -> Result<(), EngineError> {
        self.end_frames()?;
        Ok(self.renderer.set_planet_map(&map.values)?)
    }

    /// Leaves the network to sub-steps if its frames do not keep the tolerance, before a step from `start` [s].
    pub(super) fn change_over(&mut self, start: f64) -> Result<(), EngineError> {
        let (Some(network), Some(halving)) = (&self.network, self.renderer.halving()) else { return Ok(()) };
        if !network.gives_up(halving) {
            return Ok(());
        }
        self.end_frames()?;
        self.take_switches()?;
        let estimate = self.renderer.network_estimate()?.map(|(estimate, _)| estimate).unwrap_or_default();
        let temperatures = self.renderer.network_temperatures()?.unwrap_or_default();
        self.renderer.end_network();
        if let Some(network) = &mut self.network {
            network.change_over(&temperatures, estimate, start);
        }
        Ok(())
    }

    /// Lets the rows of patches follow the joints.
    pub(super) fn follow_joints(&mut self, step: &EngineStep<'_>) -> Result<(), EngineError> {
        let fourth = self.fourth();
        let Some(exchange) = &mut self.exchange else { return Ok(()) };
        if let Some(new) = exchange.turn(&step.load.joints) {
            if new.contains(&true) {
                self.frames.end(&mut self.renderer, fourth)?;
            }
            self.renderer.set_exchange(exchange.tables(), new)?;
        }
        Ok(())
    }

    /// Waits for all frames under way.
    fn end_frames(&mut self) -> Result<(), GpuError> {
        let fourth = self.fourth();
        self.frames.end(&mut self.renderer, fourth)
    }

    /// Takes the switches of thermostats in frames that step the network.
    pub(super) fn take_switches(&mut self) -> Result<(), EngineError> {
        let switches = self.renderer.take_switches();
        self.network.as_mut().map_or(Ok(()), |network| network.take_switches(&switches))
    }
}

/// Writes a network's temperatures over the fluxes in `values`, from which the device draws.
fn put(renderer: &mut Renderer, network: &NetworkRun, values: &mut [f32]) -> Result<(), EngineError> {
    network.scene().scatter(&network.temperatures(), |slot, temperature| values[slot] = temperature as f32);
    Ok(renderer.set_temperatures(values)?)
}
