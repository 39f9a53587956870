//! The steady state from which a scene's network begins.

use std::sync::Arc;

use super::NetworkRun;
use super::failure::{failure, unsteady};
use crate::gpu::error::GpuError;
use crate::gpu::network::NetworkStepper;
use crate::simulation::engine_error::EngineError;
use crate::simulation::stepper::{AnyStepper, is_small};
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::steady::{SteadyError, steady};
use crate::thermal::network::stepper::Stepper;

impl NetworkRun {
    /// The steady state under the heat of every node [W] at a time [s].
    ///
    /// # Errors
    /// A call that fails, or no steady state.
    pub(crate) fn settle(&mut self, heat: Vec<f64>, time: f64) -> Result<(), EngineError> {
        let lender = self.lender.as_ref().filter(|_| !is_small(self.scene.network().len()));
        let Some((context, spare)) = lender else { return self.find_steady(heat, time) };
        // The device holds a stepper only for this search.
        let scene = Arc::clone(&self.scene);
        match NetworkStepper::beside(context, scene.network(), &scene.sensors(), spare.clone()) {
            Ok(stepper) => self.worker = AnyStepper::Device(Box::new(stepper)),
            Err(GpuError::UnsupportedNetwork { .. }) => {}
            Err(error) => return Err(error.into()),
        }
        let found = self.find_steady(heat, time).and_then(|()| self.temperatures());
        self.wrote_spare = self.wrote_spare();
        self.worker = AnyStepper::reference(scene.network(), &scene.sensors());
        self.set_temperatures(&found?)
    }

    fn find_steady(&mut self, heat: Vec<f64>, time: f64) -> Result<(), EngineError> {
        // The search begins at the balance of each node alone.
        let network = self.scene.network();
        let space = network.space_temperature.powi(4);
        let guess = |(heat, area): (&f64, &f64)| (heat.max(0.0) / (STEFAN_BOLTZMANN * area) + space).sqrt().sqrt();
        let emitted: f64 = network.emissive_areas.iter().sum();
        let common = guess((&heat.iter().sum::<f64>(), &emitted)).clamp(3.0, 2000.0);
        self.settle_at(common)?;
        let schedule = self.scene.schedule(heat, &self.on, time, 0.0);
        let network = self.scene.network();
        let found = match steady(&mut self.worker, network, &schedule) {
            // The device steps a network but does not solve it as a whole.
            Err(SteadyError::Stepper(GpuError::UnsupportedNetwork { .. })) => {
                let mut stepper = ReferenceStepper::new(network.clone(), &self.scene.sensors());
                let Ok(()) = stepper.set_temperatures(&vec![common; network.len()]);
                steady(&mut stepper, network, &schedule).map_err(|error| failure(time, &unsteady(&error)))?
            }
            Err(SteadyError::Stepper(error)) => return Err(error.into()),
            found => found.map_err(|error| failure(time, &unsteady(&error)))?,
        };
        self.on = found.on;
        self.set_temperatures(&found.temperatures)
    }
}
