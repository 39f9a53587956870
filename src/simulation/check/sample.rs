//! The sample of a check in f64, step by step.

use super::exchange::ExchangeCheck;
use super::halves::Halves;
use super::network::NetworkCheck;
use crate::environment::StepLoad;
use crate::environment::shadow::LitAreas;
use crate::simulation::exchange_poses::RowsBetween;
use crate::thermal::incident::IncidentFunction;
use crate::thermal::reference::Reference;
use crate::trace::span;

/// The nodes of a sample, with all that they exchange heat with.
pub(super) struct Sample {
    pub(super) slots: Vec<usize>,
    /// Nodes of the device.
    pub(super) nodes: usize,
    pub(super) reference: Reference<IncidentFunction>,
    /// The light on the sample.
    pub(super) light: Option<LitAreas>,
    /// Place of each node of the sample among the structures below plates. `None` without one.
    pub(super) structures: Vec<Option<usize>>,
    /// The whole network of the scene in f64. `None` where it is too large.
    pub(super) network: Option<NetworkCheck>,
    /// Whether any node of the sample belongs to no network. The reference of all others is the network alone.
    pub(super) has_alone: bool,
    /// Radiation between surfaces. `None` without.
    pub(super) exchange: Option<ExchangeCheck>,
    /// The sample at half the step.
    pub(super) halves: Halves,
}

impl Sample {
    /// Settles at a load, at a time [s].
    pub(super) fn settle(&mut self, load: &StepLoad, time: f64) {
        self.reference.find_light(&mut self.light, load);
        self.reference.settle(load);
        if let Some(network) = self.network.as_mut().filter(|network| !network.waits) {
            let heat = network.heat(load);
            let done = network.run.settle(heat, time);
            network.after(done);
        }
    }

    /// Settles at a temperature [K].
    pub(super) fn settle_at(&mut self, temperature: f64) {
        self.reference.settle_at(temperature);
        if let Some(network) = self.network.as_mut().filter(|network| !network.waits) {
            network.run.settle_at(temperature);
            network.take_temperatures();
        }
    }

    /// Whether light from the craft is found. A network that failed, or that waits, has no temperatures to send by.
    fn receives(&self) -> bool {
        self.network.as_ref().is_none_or(|network| network.failed.is_none() && !network.waits)
    }

    /// Whether a step changes nothing: all nodes belong to a network that waits for its start.
    pub(super) fn is_idle(&self) -> bool {
        !self.has_alone && !self.receives() && !self.halves.has_begun()
    }

    /// Finds the light that nodes receive from the craft in a step.
    fn receive(&mut self, load: &StepLoad, steps: f64, turned: bool) {
        let receives = self.receives();
        let Some(exchange) = self.exchange.as_mut().filter(|_| receives) else { return };
        let _receives = span("light of other surfaces in f64");
        let mut temperatures = vec![0.0; self.nodes];
        for (slot, temperature) in self.slots.iter().zip(self.reference.temperatures()) {
            temperatures[*slot] = *temperature;
        }
        let mut lit = self.reference.lit().of_slots(self.slots.iter().copied(), self.nodes);
        if let Some(network) = &mut self.network {
            network.loads.find_light(&mut network.light, load);
            for slot in &network.slots {
                temperatures[*slot] = network.temperatures[*slot].unwrap_or(0.0);
            }
            lit.take(network.slots.iter().copied(), network.loads.lit(), self.nodes);
        }
        let received = exchange.received(load, steps, turned, &temperatures, &lit);
        self.reference.receive(self.slots.iter().map(|slot| received[*slot]).collect());
        if let Some(network) = &mut self.network {
            network.loads.receive(network.slots.iter().map(|slot| received[*slot]).collect());
        }
    }

    /// Takes the rows between the poses that the engine uses in the step that comes. Returns whether others held before.
    pub(super) fn follow(&mut self, rows: Option<&RowsBetween>) -> bool {
        let receives = self.receives();
        self.exchange.as_mut().zip(rows.filter(|_| receives)).is_some_and(|(exchange, rows)| exchange.turn(rows))
    }

    /// Advances by `steps` steps, from `start` [s] for `length` [s]. `turned` tells whether other rows hold than before.
    pub(super) fn step(&mut self, load: &StepLoad, steps: f64, [start, length]: [f64; 2], turned: bool) {
        let _checks = span("checking in f64");
        if self.has_alone {
            self.reference.find_light(&mut self.light, load);
        }
        self.receive(load, steps, turned);
        if self.has_alone {
            self.reference.step(load, steps);
        }
        if let Some(network) = self.network.as_mut().filter(|network| network.failed.is_none() && !network.waits) {
            network.step(load, start, length);
        }
        if self.halves.has_begun() {
            let network = self.network.as_ref().map(|network| &network.loads);
            let _halves = span("in steps of half the length");
            self.halves.step(load, &self.reference, network, steps, [start, length]);
            let whole = self.temperatures();
            self.halves.compare(&whole, steps, start + length);
        }
    }

    /// Adds values [K] to the temperatures of the network's nodes.
    pub(super) fn move_network(&mut self, by: &[f64]) {
        if let Some(network) = self.network.as_mut().filter(|network| !network.waits) {
            let moved: Vec<f64> = network.run.temperatures().iter().zip(by).map(|(now, by)| now + by).collect();
            network.run.set_temperatures(&moved);
            network.take_temperatures();
        }
    }

    /// Adds values [K] to the temperatures of the structures below plates.
    pub(super) fn move_structures(&mut self, by: &[f64]) {
        let present: Vec<Option<f64>> = self.reference.structures().collect();
        for (node, (place, present)) in self.structures.iter().zip(present).enumerate() {
            if let (Some(place), Some(present)) = (place, present) {
                self.reference.set_structure(node, present + by[*place]);
            }
        }
    }

    /// Starts a network that is too large for the warm-up from the engine's temperatures [K] and thermostats at time 0. Returns whether the sample has one.
    pub(super) fn start_network(&mut self, temperatures: &[f64], on: &[bool]) -> bool {
        let Some(network) = self.network.as_mut().filter(|network| network.waits) else { return false };
        network.waits = false;
        network.run.start_from(temperatures, on);
        network.take_temperatures();
        true
    }

    /// Present temperatures [K].
    pub(super) fn temperatures(&self) -> Vec<f64> {
        let known = |slot: &usize| self.network.as_ref().and_then(|network| network.temperatures[*slot]);
        let nodes = self.slots.iter().zip(self.reference.temperatures());
        nodes.map(|(slot, temperature)| known(slot).unwrap_or(*temperature)).collect()
    }
}
