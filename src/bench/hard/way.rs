//! Integrates a network of a hard case in f64 on the processor.

use crate::thermal::network::Network;
use crate::thermal::network::control::{ControlError, IntegrationSettings, Integrator, Series, integrate};
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::schedule::Schedule;

/// Integrates a network through its schedule.
pub(crate) fn integrated(
    network: &Network,
    schedule: &Schedule,
    integrator: Integrator,
) -> Result<Series, ControlError> {
    let mut stepper = ReferenceStepper::new(network.clone(), &schedule.sensors());
    integrate(&mut stepper, network, schedule, &IntegrationSettings::of(integrator), |_| true)
}
