//! The network in one pass a step, in f64: the twin of `glsl/one_pass.comp`.
//!
//! A step splits the exchange of heat in three (docs/numerics.md 3):
//! - Weak conductors act on M = T + half of the last change, explicitly. What leaves a node enters its neighbour, so heat is conserved.
//! - Each node then takes its loads, its weak conduction and the conduction inside its block of the last step as constant power, and radiates. This change
//!   is exact (`local`).
//! - Each block conducts exactly, with what its nodes received in the step as a constant source (`exponential`).

mod blocks;
mod exponential;
mod local;
mod plan;
mod switching;

use std::sync::Arc;

pub use blocks::{BLOCK_AT_MOST, Unfit};
pub use plan::{Block, Conduction, Plan, Plans, Weak};
pub use switching::SWITCHES_AT_MOST;

use self::switching::{Sensed, State};
use super::control::Switch;
use super::schedule::Thermostat;
use super::{radiated, radiative_slope};
use crate::thermal::STEFAN_BOLTZMANN;

/// A heater of a network in one pass.
#[derive(Debug, Clone, PartialEq)]
pub struct Heater {
    /// Heated nodes with their shares of its power.
    pub shares: Vec<(u32, f64)>,
    /// What switches it. Without a thermostat it is always on.
    pub thermostat: Option<Thermostat>,
}

impl Heater {
    /// Change of the sensor in a step of a plan by the heater [K].
    pub fn gain(&self, plan: &Plan) -> f64 {
        let gain = |one: &Thermostat| one.power * plan.response(one.sensor as usize, &self.shares);
        self.thermostat.as_ref().map_or(0.0, gain)
    }
}

/// A network that is stepped in one pass.
#[derive(Debug, Clone)]
pub struct OnePass {
    plans: Plans,
    plan: Arc<Plan>,
    /// Temperatures [K].
    temperatures: Vec<f64>,
    /// Change of each node in the last step [K].
    last: Vec<f64>,
    /// Change of each node by conduction inside its block in the last step [K].
    coupling: Vec<f64>,
    /// Estimate of the error of each node [K].
    error: Vec<f64>,
    /// Whether `last` and `coupling` are those of a step of this length.
    started: bool,
    /// Sum of the squares of all estimates, their number, the largest one and its node.
    told: (f64, u64, f64, usize),
    heaters: Vec<Heater>,
    /// State of the thermostat of each heater.
    states: Vec<State>,
    /// Change of each heater's sensor in a step by the heater [K].
    gains: Vec<f64>,
}

/// The estimated error of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Estimate {
    /// Root mean square over all nodes and steps [K].
    pub rms: f64,
    /// Largest [K].
    pub most: f64,
    /// The node with the largest.
    pub node: usize,
}

impl OnePass {
    /// A network at its temperatures, with heaters.
    pub fn new(plan: &Arc<Plan>, heaters: Vec<Heater>) -> Self {
        let nothing = vec![0.0; plan.network().len()];
        let gains = heaters.iter().map(|one| one.gain(plan)).collect();
        Self {
            gains,
            temperatures: plan.network().temperatures.clone(),
            last: nothing.clone(),
            coupling: nothing.clone(),
            error: nothing,
            plans: Plans::new(plan),
            plan: Arc::clone(plan),
            started: false,
            told: Default::default(),
            states: heaters.iter().map(|one| State::new(one.thermostat.as_ref())).collect(),
            heaters,
        }
    }

    /// Temperatures [K].
    pub fn temperatures(&self) -> &[f64] {
        &self.temperatures
    }

    /// Replaces the temperatures [K].
    pub fn set_temperatures(&mut self, temperatures: &[f64]) {
        self.temperatures.copy_from_slice(temperatures);
        for values in [&mut self.last, &mut self.coupling, &mut self.error] {
            values.fill(0.0);
        }
        self.started = false;
    }

    /// Replaces the states of the thermostats.
    pub fn set_on(&mut self, on: &[bool]) {
        let switched = self.states.iter_mut().zip(&self.heaters).filter(|(_, heater)| heater.thermostat.is_some());
        for ((state, _), on) in switched.zip(on) {
            *state = State { on: *on, ..State::default() };
        }
    }

    /// Whether the heater of each thermostat is on.
    pub fn on(&self) -> Vec<bool> {
        let switched = self.states.iter().zip(&self.heaters).filter(|(_, heater)| heater.thermostat.is_some());
        switched.map(|(state, _)| state.on).collect()
    }

    /// Advances from `start` [s] by `length` [s] under a constant heat of every node and a constant power of every heater [W], in equal steps that are
    /// not longer than the plan's. Returns the switches of thermostats.
    pub fn advance(&mut self, heat: &[f64], powers: &[f64], start: f64, length: f64) -> Vec<Switch> {
        let (plan, count) = self.plans.over(length);
        if !Arc::ptr_eq(&plan, &self.plan) {
            self.gains = self.heaters.iter().map(|one| one.gain(&plan)).collect();
            (self.plan, self.started) = (plan, false);
        }
        let mut switches = Vec::new();
        for number in 0..count {
            let start = start + f64::from(number) * self.plan.step();
            if !self.started {
                // What the last change would have been is not known. The step is therefore taken twice.
                let (before, error) = (self.temperatures.clone(), self.error.clone());
                let heat = self.with_heaters(heat, powers, start, &mut switches);
                self.step(&heat);
                (self.temperatures, self.error) = (before, error);
                self.started = true;
            }
            let heat = self.with_heaters(heat, powers, start, &mut switches);
            self.step(&heat);
            self.tell();
        }
        switches
    }

    /// Heat of every node with that of the heaters [W], in a step from `start` [s].
    fn with_heaters(&mut self, heat: &[f64], powers: &[f64], start: f64, switches: &mut Vec<Switch>) -> Vec<f64> {
        let mut heat = heat.to_vec();
        let mut thermostats = 0;
        for (number, (Heater { shares, thermostat }, power)) in self.heaters.iter().zip(powers).enumerate() {
            let mut duty = 1.0;
            if let Some(thermostat) = thermostat {
                let sensor = thermostat.sensor as usize;
                let last = self.started.then_some(self.last[sensor]);
                let sensed = Sensed { here: self.temperatures[sensor], last, gain: self.gains[number] };
                let mut on = self.states[number].on;
                duty = self.states[number].duty(thermostat, sensed, |place| {
                    on = !on;
                    switches.push(Switch { time: start + place * self.plan.step(), thermostat: thermostats, on });
                });
                thermostats += 1;
            }
            shares.iter().for_each(|(node, share)| heat[*node as usize] += duty * share * power);
        }
        heat
    }

    /// Estimated error of all steps so far.
    pub fn estimate(&self) -> Estimate {
        let (squares, count, most, node) = self.told;
        Estimate { rms: (squares / count.max(1) as f64).sqrt(), most, node }
    }

    fn tell(&mut self) {
        for (node, error) in self.error.iter().enumerate() {
            self.told.0 += error * error;
            if error.abs() > self.told.2 {
                (self.told.2, self.told.3) = (error.abs(), node);
            }
        }
        self.told.1 += self.error.len() as u64;
    }

    fn step(&mut self, heat: &[f64]) {
        let plan = Arc::clone(&self.plan);
        let (network, step) = (plan.network(), plan.step());
        let space = network.space_temperature.powi(4);
        // Pass 1: the weak conductors and the local step.
        let mut drive = vec![0.0; self.temperatures.len()];
        for (node, drive) in drive.iter_mut().enumerate() {
            let (here, coupling) = (self.temperatures[node], self.coupling[node]);
            let mean = here + 0.5 * self.last[node];
            let weak = plan.weak_of(node).iter().map(|link| {
                let there = self.temperatures[link.neighbour as usize] + 0.5 * self.last[link.neighbour as usize];
                link.conductance * (there - mean) + link.exchange_area * radiated(there, mean)
            });
            let into = heat[node] + weak.sum::<f64>();
            let share = step / network.capacitances[node];
            let emission = STEFAN_BOLTZMANN * network.emissive_areas[node];
            let start = share * (into + emission * (space - here.powi(4))) + coupling;
            *drive = local::local_change(here, start, share * emission, plan.local_steps()) - coupling;
        }
        // Pass 2: the blocks.
        let mut change = drive.clone();
        let mut coupling = vec![0.0; drive.len()];
        plan.conduct(
            |node, other| [drive[other] - drive[node], self.temperatures[other] - self.temperatures[node]],
            &mut coupling,
        );
        change.iter_mut().zip(&coupling).for_each(|(change, coupling)| *change += coupling);
        self.estimate_step(&plan, &change, &coupling);
        self.temperatures.iter_mut().zip(&change).for_each(|(temperature, change)| *temperature += change);
        (self.last, self.coupling) = (change, coupling);
    }

    /// Adds the error of a step to the error of each node, which radiation forgets. Weak conduction took the last change for the present one, and
    /// radiation took the last conduction inside a block.
    fn estimate_step(&mut self, plan: &Plan, change: &[f64], coupling: &[f64]) {
        let (network, step) = (plan.network(), plan.step());
        let half: Vec<f64> = change.iter().zip(&self.last).map(|(change, last)| 0.5 * (change - last)).collect();
        let mut new = vec![0.0; change.len()];
        for (node, new) in new.iter_mut().enumerate() {
            let here = self.temperatures[node];
            let share = step / network.capacitances[node];
            let weak = plan.weak_of(node).iter().map(|link| {
                let slope = link.conductance + link.exchange_area * radiative_slope(here);
                slope * (half[link.neighbour as usize] - half[node])
            });
            let fading = share * network.emissive_areas[node] * radiative_slope(here);
            let lost = -(-fading).exp_m1();
            *new = share * weak.sum::<f64>() - 0.5 * lost * (coupling[node] - self.coupling[node]);
            self.error[node] *= 1.0 - lost;
        }
        let mut spread = vec![0.0; new.len()];
        plan.conduct(|node, other| [new[other] - new[node], self.error[other] - self.error[node]], &mut spread);
        for ((error, new), spread) in self.error.iter_mut().zip(&new).zip(&spread) {
            *error += new + spread;
        }
    }
}

#[cfg(test)]
mod tests;
