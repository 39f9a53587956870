//! The steady state of a network, with its thermostats in states that agree with what they sense.

use super::Network;
use super::schedule::Schedule;
use super::stepper::Stepper;

/// A steady state.
#[derive(Debug, Clone, PartialEq)]
pub struct Steady {
    /// Temperatures [K].
    pub temperatures: Vec<f64>,
    /// States of the thermostats.
    pub on: Vec<bool>,
}

/// Why there is none.
#[derive(Debug, Clone, PartialEq)]
pub enum SteadyError<E> {
    /// The stepper failed.
    Stepper(E),
    /// The heat of a node has no path to a boundary or to space.
    Closed {
        /// The node.
        node: usize,
    },
    /// No temperatures were found at which every node balances.
    NotFound {
        /// The node whose balance is furthest from closing at the last temperatures.
        node: usize,
    },
    /// A thermostat's sensor is warm enough to switch it off with it on, and cold enough to switch it on with it off.
    Cycles {
        /// Number of the thermostat.
        thermostat: usize,
    },
}

impl<E> From<E> for SteadyError<E> {
    fn from(error: E) -> Self {
        Self::Stepper(error)
    }
}

/// The steady state under the heat just after time 0. Thermostats begin as they stand at time 0; one whose sensor ends
/// past the threshold that would switch it is switched, the furthest first, until none is.
///
/// # Errors
/// See [`SteadyError`].
pub fn steady<S: Stepper>(
    stepper: &mut S,
    network: &Network,
    schedule: &Schedule,
) -> Result<Steady, SteadyError<S::Error>> {
    if let Some(node) = network.unsteady_node() {
        return Err(SteadyError::Closed { node });
    }
    let thermostats = &schedule.thermostats;
    let mut on: Vec<bool> = thermostats.iter().map(|thermostat| thermostat.initially_on).collect();
    let mut seen = Vec::new();
    loop {
        let (power, slope) = schedule.heat_after(network.len(), 0.0, &on);
        stepper.set_heat(&power, &slope)?;
        let found = stepper.steady(0.0)?;
        let temperatures = stepper.temperatures()?;
        if !found {
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
        if seen.contains(&on) {
            return Err(SteadyError::Cycles { thermostat });
        }
        seen.push(on.clone());
        on[thermostat] = !on[thermostat];
    }
}
