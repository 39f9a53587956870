//! Integrates a network of a hard case in f64 on the processor.

use crate::thermal::network::Network;
use crate::thermal::network::control::{ControlError, Integrator, Series, Settings, integrate};
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::schedule::Schedule;

/// Integrates a network through its schedule.
pub fn integrated(network: &Network, schedule: &Schedule, integrator: Integrator) -> Result<Series, ControlError> {
    let mut stepper = ReferenceStepper::new(network.clone(), &schedule.sensors());
    integrate(&mut stepper, network, schedule, &Settings::of(integrator), |_| true)
}
