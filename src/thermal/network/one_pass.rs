//! The network in one pass a step, in f64: the twin of `glsl/one_pass.comp`.
//!
//! A step splits the exchange of heat in three (docs/numerics.md 3):
//! - Weak conductors act on M = T + half of the last change, explicitly. Heat that leaves a node enters its neighbour, so heat is conserved.
//! - Each node then takes its loads, its weak conduction and the conduction inside its block of the last step as constant power, and radiates. This change
//!   is exact (`thermal::local_step`).
//! - Each block conducts exactly, with the heat that its nodes received in the step as a constant source: a small one by matrices (`exponential`), a
//!   large one by a polynomial (`series`).

mod balance;
mod blocks;
mod conduction;
mod exponential;
mod halving;
mod lag;
mod large;
mod order;
mod plan;
mod rows;
mod sample;
mod saved;
mod series;
mod switching;
mod told;

use std::sync::Arc;

pub(crate) use blocks::Unfit;
pub(crate) use conduction::Conduction;
pub(crate) use halving::{HALVINGS_AT_MOST, Halving, HalvingCourse, Halvings};
pub(crate) use large::Large;
pub(crate) use plan::{OnePassPlan, Plans};
pub(crate) use rows::ExchangeLink;
pub(crate) use sample::{EstimatePart, estimates, since};
pub(crate) use saved::OnePassState;
pub(crate) use series::SeriesStage;
pub(crate) use switching::SWITCHES_AT_MOST;
pub(crate) use told::{Estimate, Told};

use self::balance::{Balance, balancing_change};
use self::sample::left_in_the_mean;
use self::switching::{Sensed, ThermostatState};
use super::control::Switch;
use super::schedule::Thermostat;
use super::{radiated, radiative_slope};
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::local_step as local;

/// A heater of a network in one pass.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OnePassHeater {
    /// Heated nodes with their shares of its power.
    pub(crate) shares: Vec<(u32, f64)>,
    /// Without a thermostat the heater is always on.
    pub(crate) thermostat: Option<Thermostat>,
}

impl OnePassHeater {
    /// Change of the sensor in a step of a plan by the heater [K].
    pub(crate) fn gain(&self, plan: &OnePassPlan) -> f64 {
        let gain = |one: &Thermostat| one.power * plan.response(one.sensor as usize, &self.shares);
        self.thermostat.as_ref().map_or(0.0, gain)
    }
}

/// A network that is stepped in one pass.
#[derive(Debug, Clone)]
pub(crate) struct OnePassNetwork {
    plans: Plans,
    plan: Arc<OnePassPlan>,
    /// Temperatures [K].
    temperatures: Vec<f64>,
    /// Change of each node in the last step [K].
    last: Vec<f64>,
    /// Change of each node by conduction inside its block in the last step [K].
    coupling: Vec<f64>,
    /// Estimate of the error of each node [K].
    error: Vec<f64>,
    /// Heat by weak conductors that was noted [W].
    weak: Vec<f64>,
    /// Change of this heat in a step at the last estimate [W].
    trend: Vec<f64>,
    /// Coupling at the last estimate [K].
    coupled: Vec<f64>,
    /// Steps of this length so far. `last` and `coupling` belong to such a step only after the first one.
    age: u32,
    halvings: Halvings,
    /// The estimate before the last decision, and since.
    told: [Told; 2],
    heaters: Vec<OnePassHeater>,
    states: Vec<ThermostatState>,
    /// Change of each heater's sensor in a step by the heater [K].
    gains: Vec<f64>,
}

impl OnePassNetwork {
    /// A network at its temperatures, with heaters. The step is halved where its estimated error exceeds `tolerance` [K].
    pub(crate) fn new(plan: &Arc<OnePassPlan>, heaters: Vec<OnePassHeater>, tolerance: f64) -> Self {
        let nothing = vec![0.0; plan.network().len()];
        let gains = heaters.iter().map(|one| one.gain(plan)).collect();
        Self {
            gains,
            temperatures: plan.network().temperatures.clone(),
            last: nothing.clone(),
            coupling: nothing.clone(),
            error: nothing.clone(),
            weak: nothing.clone(),
            trend: nothing.clone(),
            coupled: nothing,
            age: 0,
            halvings: Halvings::new(tolerance, plan.halvings()),
            plans: Plans::new(plan),
            plan: Arc::clone(plan),
            told: Default::default(),
            states: heaters.iter().map(|one| ThermostatState::new(one.thermostat.as_ref())).collect(),
            heaters,
        }
    }

    pub(crate) fn temperatures(&self) -> &[f64] {
        &self.temperatures
    }

    pub(crate) fn set_temperatures(&mut self, temperatures: &[f64]) {
        self.temperatures.copy_from_slice(temperatures);
        for values in [&mut self.last, &mut self.coupling, &mut self.error] {
            values.fill(0.0);
        }
        self.age = 0;
    }

    pub(crate) fn set_on(&mut self, on: &[bool]) {
        let switched = self.states.iter_mut().zip(&self.heaters).filter(|(_, heater)| heater.thermostat.is_some());
        for ((state, _), on) in switched.zip(on) {
            *state = ThermostatState { on: *on, ..ThermostatState::default() };
        }
    }

    /// Whether the heater of each thermostat is on.
    pub(crate) fn on(&self) -> Vec<bool> {
        let switched = self.states.iter().zip(&self.heaters).filter(|(_, heater)| heater.thermostat.is_some());
        switched.map(|(state, _)| state.on).collect()
    }

    /// Advances from `start` [s] by `length` [s] under a constant heat of every node and a constant power of every heater [W], in equal steps that are
    /// not longer than the plan's. Returns the switches of thermostats.
    pub(crate) fn advance(&mut self, heat: &[f64], powers: &[f64], start: f64, length: f64) -> Vec<Switch> {
        if self.halvings.is_due() {
            let recent = std::mem::take(&mut self.told[1]);
            self.halvings.now.take(recent.estimate());
            self.told[0] = self.told[0].and(recent);
        }
        let (plan, count) = self.plans.over(length, self.halvings.begin());
        if !Arc::ptr_eq(&plan, &self.plan) {
            self.gains = self.heaters.iter().map(|one| one.gain(&plan)).collect();
            (self.plan, self.age) = (Arc::clone(&plan), 0);
        }
        let mut switches = Vec::new();
        for number in 0..count {
            let start = start + f64::from(number) * self.plan.step();
            if self.age == 0 {
                // No last change is known yet for this length of step. The step is therefore taken twice.
                let before = self.temperatures.clone();
                let heat = self.with_heaters(heat, powers, start, true, &mut switches);
                self.step(&heat, true);
                for (node, before) in before.into_iter().enumerate().filter(|(node, _)| !plan.is_massless(*node)) {
                    self.temperatures[node] = before;
                }
            }
            let heat = self.with_heaters(heat, powers, start, false, &mut switches);
            self.step(&heat, false);
            if estimates(self.age, 1) > 0 {
                self.tell();
            }
            self.age = self.age.saturating_add(1);
        }
        switches
    }

    /// Heat of every node, heaters included [W], in a step from `start` [s].
    fn with_heaters(
        &mut self,
        heat: &[f64],
        powers: &[f64],
        start: f64,
        trial: bool,
        switches: &mut Vec<Switch>,
    ) -> Vec<f64> {
        let mut heat = heat.to_vec();
        let mut thermostats = 0;
        for (number, (OnePassHeater { shares, thermostat }, power)) in self.heaters.iter().zip(powers).enumerate() {
            let mut duty = 1.0;
            if let Some(thermostat) = thermostat {
                let sensor = thermostat.sensor as usize;
                let last = (!trial).then_some(self.last[sensor]);
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

    pub(crate) fn estimate(&self) -> Estimate {
        self.told[0].and(self.told[1]).estimate()
    }

    pub(crate) fn halving(&self) -> &Halving {
        &self.halvings.now
    }

    /// Takes another course of halvings from the next step on. Returns the course so far.
    pub(crate) fn take_course(&mut self, course: HalvingCourse) -> HalvingCourse {
        self.halvings.take_course(course)
    }

    fn tell(&mut self) {
        let mut told = Told { count: self.error.len() as u64, ..Told::default() };
        for (node, error) in self.error.iter().enumerate() {
            told.squares += error * error;
            if error.abs() > told.most {
                (told.most, told.node) = (error.abs(), node);
            }
        }
        self.told[1] = self.told[1].and(told);
    }

    /// A step under the heat of every node [W]. A trial only learns the changes.
    fn step(&mut self, heat: &[f64], trial: bool) {
        let plan = Arc::clone(&self.plan);
        let (network, step) = (plan.network(), plan.step());
        let space = network.space_temperature.powi(4);
        // Nodes without capacity balance with the mean temperatures of their neighbours.
        for node in (0..network.len()).filter(|node| plan.is_massless(*node)) {
            let here = self.temperatures[node];
            let lost = network.emissive_areas[node] * radiated(network.space_temperature, here);
            let links = plan.weak_of(node);
            let areas: f64 = links.iter().map(|link| link.exchange_area).sum();
            let balance = Balance {
                into: heat[node] + lost + self.weak_heat(&plan, node),
                conductance: links.iter().map(|link| link.conductance).sum(),
                emission: STEFAN_BOLTZMANN * (network.emissive_areas[node] + areas),
            };
            self.temperatures[node] += balancing_change(balance, here);
        }
        // Pass 1: the weak conductors and the local step.
        let weak: Vec<f64> = (0..network.len()).map(|node| self.weak_heat(&plan, node)).collect();
        let mut drive = vec![0.0; self.temperatures.len()];
        for (node, drive) in drive.iter_mut().enumerate().filter(|(node, _)| !plan.is_massless(*node)) {
            let (here, coupling) = (self.temperatures[node], self.coupling[node]);
            let into = heat[node] + weak[node];
            let share = step / network.capacitances[node];
            let emission = STEFAN_BOLTZMANN * network.emissive_areas[node];
            let start = share * (into + emission * (space - here.powi(4))) + coupling;
            let change = if plan.is_fast(node) {
                local::fast_change(here, start, share * emission, plan.local_steps())
            } else {
                local::local_change(here, start, share * emission, local::SLOW_STEPS)
            };
            *drive = change - coupling;
        }
        // Pass 2: the blocks.
        let mut change = drive.clone();
        let mut coupling = vec![0.0; drive.len()];
        plan.conduct(&drive, &self.temperatures, &mut coupling);
        change.iter_mut().zip(&coupling).for_each(|(change, coupling)| *change += coupling);
        match EstimatePart::of(self.age) {
            EstimatePart::Note if !trial => self.weak = weak,
            EstimatePart::Estimate if !trial => self.estimate_steps(&plan, &weak),
            _ => {}
        }
        self.temperatures.iter_mut().zip(&change).for_each(|(temperature, change)| *temperature += change);
        (self.last, self.coupling) = (change, coupling);
    }

    /// Heat into a node by weak exchange at the mean temperatures of the step [W].
    fn weak_heat(&self, plan: &OnePassPlan, node: usize) -> f64 {
        let mean = |node: usize| self.temperatures[node] + 0.5 * self.last[node];
        let here = mean(node);
        let heat = |link: &ExchangeLink| {
            let there = mean(link.neighbour as usize);
            link.conductance * (there - here) + link.exchange_area * radiated(there, here)
        };
        plan.weak_of(node).iter().map(heat).sum()
    }

    /// Adds the error of the steps since the last estimate to the error of each node, which radiation forgets. Weak conduction took the last change for the
    /// present one, which shows in how its heat `weak` [W] bends. Radiation took the last conduction inside a block for the present one. Twin: `estimate` of
    /// `glsl/one_pass.comp`.
    fn estimate_steps(&mut self, plan: &OnePassPlan, weak: &[f64]) {
        let (network, step, steps) = (plan.network(), plan.step(), since(self.age));
        let mut new = vec![0.0; weak.len()];
        for (node, new) in new.iter_mut().enumerate().filter(|(node, _)| !plan.is_massless(*node)) {
            let share = step / network.capacitances[node];
            let fading = share * network.emissive_areas[node] * radiative_slope(self.temperatures[node]);
            let trend = weak[node] - self.weak[node];
            if steps > 0 {
                let coupled = (1.0 - (-fading).exp()) * (self.coupling[node] - self.coupled[node]);
                let sum = 0.5 * (share * (trend - self.trend[node]) - coupled);
                *new = left_in_the_mean(fading, steps) * sum;
            }
            self.trend[node] = trend;
            self.error[node] *= (-f64::from(steps) * fading).exp();
        }
        let mut spread = vec![0.0; new.len()];
        plan.conduct(&new, &self.error, &mut spread);
        for ((error, new), spread) in self.error.iter_mut().zip(&new).zip(&spread) {
            *error += new + spread;
        }
        self.coupled.copy_from_slice(&self.coupling);
    }
}

#[cfg(test)]
mod tests;
