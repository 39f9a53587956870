//! The steady state from which a scene's network begins.

use super::NetworkRun;
use super::failure::{failure, unsteady};
use crate::simulation::engine_error::EngineError;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::steady::steady_or_mean;
use crate::trace::span;

impl NetworkRun {
    /// The steady state under the heat of every node [W] at a time [s]. Thermostats that cycle have their mean.
    ///
    /// # Errors
    /// No steady state.
    pub(crate) fn settle(&mut self, heat: Vec<f64>, time: f64) -> Result<(), EngineError> {
        let _settles = span("settling the network");
        // The search begins at the balance of each node alone.
        let network = self.scene.network();
        let space = network.space_temperature.powi(4);
        let guess = |(heat, area): (&f64, &f64)| (heat.max(0.0) / (STEFAN_BOLTZMANN * area) + space).sqrt().sqrt();
        let emitted: f64 = network.emissive_areas.iter().sum();
        let common = guess((&heat.iter().sum::<f64>(), &emitted)).clamp(3.0, 2000.0);
        self.set_temperatures(&vec![common; network.len()]);
        let schedule = self.scene.schedule(heat, &self.course.on, time, 0.0);
        let balanced = steady_or_mean(&mut self.worker, self.scene.network(), &schedule);
        let balanced = balanced.map_err(|error| failure(time, &unsteady(&error)))?;
        self.course.on = balanced.on;
        self.set_temperatures(&balanced.temperatures);
        Ok(())
    }
}
