//! Steady state of a network, with thermostat states that agree with their sensors.

use super::Network;
use super::reference::ReferenceStepper;
use super::schedule::{Schedule, Thermostat};

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

/// Halvings of the share of power of a thermostat: to 1e-3 of it.
const HALVINGS: u32 = 10;
/// Rounds in which the shares of thermostats that act on each other are found.
const ROUNDS: u32 = 3;

/// The same where thermostats cycle: each of these heats at the share of its power that holds its sensor in the middle between its thresholds. A run that begins
/// there soon cycles about it.
///
/// # Errors
/// See [`SteadyError`].
pub(crate) fn steady_or_mean(
    stepper: &mut ReferenceStepper,
    network: &Network,
    schedule: &Schedule,
) -> Result<Steady, SteadyError> {
    let mut schedule = schedule.clone();
    let mut cycling: Vec<(usize, Thermostat)> = Vec::new();
    loop {
        match steady(stepper, network, &schedule) {
            Err(SteadyError::Cycles { thermostat }) => {
                cycling.push((thermostat, schedule.thermostats[thermostat].clone()));
                schedule.thermostats[thermostat] = at_share(&schedule.thermostats[thermostat], 0.5);
                let rounds = if cycling.len() > 1 { ROUNDS } else { 1 };
                for (number, stated) in (0..rounds).flat_map(|_| &cycling) {
                    find_share(stepper, network, &mut schedule, *number, stated);
                }
            }
            found => {
                let mut found = found?;
                for (number, stated) in cycling {
                    found.on[number] = found.temperatures[stated.sensor as usize] < middle(&stated);
                }
                return Ok(found);
            }
        }
    }
}

fn middle(thermostat: &Thermostat) -> f64 {
    0.5 * (thermostat.on_below + thermostat.off_above)
}

/// A thermostat that always heats with a share of its power.
fn at_share(stated: &Thermostat, share: f64) -> Thermostat {
    let (on_below, off_above) = (f64::NEG_INFINITY, f64::INFINITY);
    Thermostat { power: share * stated.power, on_below, off_above, initially_on: true, ..stated.clone() }
}

/// Halves the range of the share of a thermostat by the temperature of its sensor. It stays as it is where another one cycles, which is found next.
fn find_share(
    stepper: &mut ReferenceStepper,
    network: &Network,
    schedule: &mut Schedule,
    number: usize,
    stated: &Thermostat,
) {
    let mut range = [0.0, 1.0];
    for _ in 0..HALVINGS {
        let share = 0.5 * (range[0] + range[1]);
        schedule.thermostats[number] = at_share(stated, share);
        let Ok(found) = steady(stepper, network, schedule) else { return };
        range[usize::from(found.temperatures[stated.sensor as usize] > middle(stated))] = share;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::network::{LinearConductor, NodeKind};

    /// Two nodes to a boundary of 250 K by 0.1 W/K each, and to each other by 0.05 W/K, with a thermostat each that heats by 3 W and 2 W.
    #[test]
    fn thermostats_that_cycle_begin_with_their_mean() {
        let [a, b, sink] = [0, 1, 2];
        let joined = |(nodes, conductance): ([u32; 2], f64)| LinearConductor { nodes, conductance };
        let network = Network {
            kinds: vec![NodeKind::Diffusive, NodeKind::Diffusive, NodeKind::Boundary],
            capacitances: vec![100.0, 100.0, 0.0],
            emissive_areas: vec![0.0; 3],
            temperatures: vec![250.0; 3],
            linear: [([a, sink], 0.1), ([b, sink], 0.1), ([a, b], 0.05)].map(joined).to_vec(),
            ..Network::default()
        };
        let thermostat = |node: u32, power: f64, on_below: f64| Thermostat {
            node,
            sensor: node,
            power,
            on_below,
            off_above: on_below + 4.0,
            initially_on: false,
        };
        let schedule =
            Schedule { thermostats: vec![thermostat(a, 3.0, 260.0), thermostat(b, 2.0, 255.0)], ..Schedule::default() };
        let mut stepper = ReferenceStepper::new(network.clone(), &schedule.sensors());
        let cycles = steady(&mut stepper, &network, &schedule);
        assert!(matches!(cycles, Err(SteadyError::Cycles { .. })), "{cycles:?}");
        let found = steady_or_mean(&mut stepper, &network, &schedule).unwrap();
        // By hand: 1.2 + 0.05 5 = 1.45 W hold 262 K, and 0.7 - 0.25 = 0.45 W hold 257 K.
        println!("{:?}", found.temperatures);
        assert!((found.temperatures[0] - 262.0).abs() < 0.05 && (found.temperatures[1] - 257.0).abs() < 0.05);
    }
}
