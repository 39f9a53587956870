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

use std::sync::Arc;

pub use blocks::{BLOCK_AT_MOST, Unfit};
pub use plan::{Block, Conduction, Plan, Plans, Weak};

use super::{radiated, radiative_slope};
use crate::thermal::STEFAN_BOLTZMANN;

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
    /// A network at its temperatures.
    pub fn new(plan: &Arc<Plan>) -> Self {
        let nothing = vec![0.0; plan.network().len()];
        Self {
            temperatures: plan.network().temperatures.clone(),
            last: nothing.clone(),
            coupling: nothing.clone(),
            error: nothing,
            plans: Plans::new(plan),
            plan: Arc::clone(plan),
            started: false,
            told: Default::default(),
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

    /// Advances by `length` [s] under a constant heat of every node [W], in equal steps that are not longer than the plan's.
    pub fn advance(&mut self, heat: &[f64], length: f64) {
        let (plan, count) = self.plans.over(length);
        self.started &= Arc::ptr_eq(&plan, &self.plan);
        self.plan = plan;
        for _ in 0..count {
            if !self.started {
                // What the last change would have been is not known. The step is therefore taken twice.
                let (before, error) = (self.temperatures.clone(), self.error.clone());
                self.step(heat);
                (self.temperatures, self.error) = (before, error);
                self.started = true;
            }
            self.step(heat);
            self.tell();
        }
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
