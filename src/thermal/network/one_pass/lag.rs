//! Steps that thermostats need. In a step the sensor of a thermostat is expected on a straight line ([`super::switching`]). A sensor away from its heater lags behind it, so this line bends when
//! the heater is switched. Steps are therefore halved until the bend is a small part of the band.

use std::sync::Arc;

use super::blocks::Unfit;
use super::halving::HALVINGS_AT_MOST;
use super::plan::OnePassPlan;
use super::{OnePassHeater, OnePassNetwork};
use crate::thermal::network::Network;

/// Part of the band of a thermostat that the way of its sensor may bend in a step.
const OF_BAND: f64 = 0.05;
/// Bend that does no harm in a band of any width [K].
const HARMLESS: f64 = 0.1;

impl OnePassPlan {
    /// A plan of the longest steps, among `step` [s], its half, its quarter and its eighth, that one pass can take and in which the sensors of these heaters move on straight lines.
    ///
    /// # Errors
    /// The reason why one pass can not take the network in steps of `step`.
    pub(crate) fn fitting_heaters(
        network: &Network,
        step: f64,
        hottest: &[f64],
        heaters: &[OnePassHeater],
    ) -> Result<Arc<Self>, Unfit> {
        let plan = Self::fitting(network, step, hottest)?;
        if heaters.iter().all(|heater| heater.thermostat.is_none()) {
            return Ok(plan);
        }
        let finest = Self::halved(network, step, hottest, HALVINGS_AT_MOST)?;
        let unheated = vec![0.0; network.len()];
        let mut halvings = plan.halvings();
        for heater in heaters {
            let Some(thermostat) = &heater.thermostat else { continue };
            let mut heat = unheated.clone();
            heater.shares.iter().for_each(|(node, share)| heat[*node as usize] += share * thermostat.power);
            let sensor = thermostat.sensor as usize;
            let [cold, hot] = [&unheated, &heat].map(|heat| sensed(&finest, sensor, heat));
            let rises: Vec<f64> = hot.iter().zip(&cold).map(|(hot, cold)| hot - cold).collect();
            let allowed = HARMLESS.max(OF_BAND * (thermostat.off_above - thermostat.on_below));
            let is_straight = |halvings: u32| {
                let part = 1 << (HALVINGS_AT_MOST - halvings);
                (rises[2 * part] - 2.0 * rises[part]).abs() <= allowed
            };
            halvings = (halvings..=HALVINGS_AT_MOST)
                .find(|halvings| is_straight(*halvings))
                .ok_or(Unfit::Lagging { node: sensor })?;
        }
        if halvings == plan.halvings() { Ok(plan) } else { Self::halved(network, step, hottest, halvings) }
    }
}

/// Temperatures of a node [K] at the start and after each of the shortest steps in two whole ones, under this heat of all nodes [W].
fn sensed(plan: &Arc<OnePassPlan>, node: usize, heat: &[f64]) -> Vec<f64> {
    let mut network = OnePassNetwork::new(plan, Vec::new(), f64::INFINITY);
    let mut found = vec![network.temperatures()[node]];
    for _ in 0..2u32 << HALVINGS_AT_MOST {
        network.advance(heat, &[], 0.0, plan.step());
        found.push(network.temperatures()[node]);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::network::schedule::Thermostat;
    use crate::thermal::network::{LinearConductor, NodeKind};

    /// Two plates of aluminium of 0.04 m2, 4 and 2 mm thick, with a contact of 2 W/K. The first is heated by 60 W, the second is sensed.
    fn plates() -> (Network, OnePassHeater) {
        let network = Network {
            space_temperature: 0.0,
            kinds: vec![NodeKind::Diffusive; 2],
            capacitances: vec![388.8, 194.4],
            emissive_areas: vec![0.9 * 0.04, 0.6 * 0.04],
            temperatures: vec![280.0; 2],
            linear: vec![LinearConductor { nodes: [0, 1], conductance: 2.0 }],
            radiative: Vec::new(),
        };
        let thermostat =
            Thermostat { node: 0, sensor: 1, power: 60.0, on_below: 290.0, off_above: 293.0, initially_on: true };
        (network, OnePassHeater { shares: vec![(0, 1.0)], thermostat: Some(thermostat) })
    }

    /// Mean period of the thermostat in 70 cycles [s].
    fn period(plan: &Arc<OnePassPlan>, heater: &OnePassHeater, step: f64) -> f64 {
        let mut network = OnePassNetwork::new(plan, vec![heater.clone()], f64::INFINITY);
        let mut ends = Vec::new();
        for number in 0..(30_000.0 / step) as u32 {
            let switches = network.advance(&[0.0; 2], &[60.0], f64::from(number) * step, step);
            ends.extend(switches.iter().filter(|switch| !switch.on).map(|switch| switch.time));
        }
        (ends[75] - ends[5]) / 70.0
    }

    /// The period is 340.24 s (scipy's `solve_ivp` with events, RK45, rtol 1e-10).
    #[test]
    fn steps_are_short_enough_for_a_sensor_that_lags() {
        let (network, heater) = plates();
        let fitting =
            |step: f64| OnePassPlan::fitting_heaters(&network, step, &[330.0; 2], std::slice::from_ref(&heater));
        for step in [10.0, 20.0, 60.0] {
            let plan = fitting(step).expect("a plan");
            let found = period(&plan, &heater, step);
            println!("steps of {step} s in {} halvings: {found:.2} s", plan.halvings());
            assert!((found / 340.24 - 1.0).abs() < 2e-3, "{found}");
        }
        let whole = OnePassPlan::new(&network, 60.0, &[330.0; 2]).expect("a plan");
        let found = period(&whole, &heater, 60.0);
        assert!((found / 340.24 - 1.0).abs() > 0.02, "whole steps see nothing of the lag: {found}");
        assert_eq!(fitting(600.0).err(), Some(Unfit::Lagging { node: 1 }));
    }

    /// A sensor at its heater moves on a straight line.
    #[test]
    fn a_sensor_at_its_heater_needs_no_shorter_steps() {
        let (network, heater) = plates();
        let thermostat = heater.thermostat.map(|thermostat| Thermostat {
            sensor: 0,
            on_below: 280.0,
            off_above: 300.0,
            ..thermostat
        });
        let heaters = [OnePassHeater { thermostat, ..heater }];
        let plan = OnePassPlan::fitting_heaters(&network, 10.0, &[330.0; 2], &heaters).expect("a plan");
        assert_eq!(plan.halvings(), 0);
    }
}
