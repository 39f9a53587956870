//! Steady state of a network, with thermostat states that agree with their sensors.

use super::Network;
use super::reference::ReferenceStepper;
use super::schedule::Schedule;

/// A steady state.
#[derive(Debug, Clone, PartialEq)]
pub struct Steady {
    /// Temperatures [K].
    pub temperatures: Vec<f64>,
    /// States of the thermostats.
    pub on: Vec<bool>,
}

/// An error of the search for a steady state.
#[derive(Debug, Clone, PartialEq)]
pub enum SteadyError {
    /// A node without a path to a boundary or to space.
    Closed {
        /// The node.
        node: usize,
    },
    /// Temperatures that do not converge.
    NotFound {
        /// The node with the largest residual at the last temperatures.
        node: usize,
    },
    /// A thermostat whose sensor is above its upper threshold when it is on, and below its lower threshold when it is off.
    Cycles {
        /// Number of the thermostat.
        thermostat: usize,
    },
}

/// The steady state under the heat just after time 0. Thermostats start in their states of time 0. While a sensor is beyond the threshold that switches its
/// thermostat, the one furthest beyond is switched.
///
/// # Errors
/// See [`SteadyError`].
pub fn steady(stepper: &mut ReferenceStepper, network: &Network, schedule: &Schedule) -> Result<Steady, SteadyError> {
    if let Some(node) = network.unsteady_node() {
        return Err(SteadyError::Closed { node });
    }
    let thermostats = &schedule.thermostats;
    let mut on: Vec<bool> = thermostats.iter().map(|thermostat| thermostat.initially_on).collect();
    let mut tried = Vec::new();
    loop {
        let (power, slope) = schedule.heat_after(network.len(), 0.0, &on);
        stepper.set_heat(&power, &slope);
        let is_steady = stepper.steady(0.0);
        let temperatures = stepper.temperatures();
        if !is_steady {
            let mut heat = vec![0.0; temperatures.len()];
            network.exchanged_heat(&temperatures, &mut heat);
            let open = |node: &usize| (heat[*node] + power[*node]).abs();
            let sought = (0..heat.len()).filter(|node| network.kinds[*node] != super::NodeKind::Boundary);
            let node = sought.max_by(|a, b| open(a).total_cmp(&open(b))).unwrap_or(0);
            return Err(SteadyError::NotFound { node });
        }
        let past = |at: usize| thermostats[at].past(on[at], temperatures[thermostats[at].sensor as usize]);
        let furthest = (0..on.len()).filter(|at| past(*at) > 0.0).max_by(|a, b| past(*a).total_cmp(&past(*b)));
        let Some(thermostat) = furthest else {
            return Ok(Steady { temperatures, on });
        };
        if tried.contains(&on) {
            return Err(SteadyError::Cycles { thermostat });
        }
        tried.push(on.clone());
        on[thermostat] = !on[thermostat];
    }
}
