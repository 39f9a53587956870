//! Comparison of the device with the f64 reference: a sample of nodes is stepped beside the run.
//!
//! A network is stepped whole in f64, at a tenth of its tolerance. Up to 20,000 drawn nodes this includes the warm-up. Up to 100,000 drawn nodes it starts
//! at time 0 from the state of the device.
//!
//! The sample also takes every step of the run in two halves, which gives the error of the step length. Where a comparison is not possible, because surfaces
//! of a large craft radiate to each other, that error is all that a check finds.

mod differences;
mod exchange;
mod halves;
mod lone;
mod network;

pub use self::halves::StepLengthError;

use self::differences::Differences;
use self::exchange::{ExchangeCheck, ExchangeCheckState};
use self::halves::{Halves, HalvesState};
use self::network::{NetworkCheck, NetworkCheckState, joints};
use super::engine::{Engine, EngineError, Order};
use super::exchange_poses::RowsBetween;
use super::prepare::Prepared;
use crate::environment::StepLoad;
use crate::environment::shadow::{LightAndPoses, LitAreas};
use crate::model::nodes::GROUP;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::incident::{IncidentFunction, incident};
use crate::thermal::misfit::part;
use crate::thermal::reference::{Reference, ReferenceState};
use crate::trace::span;

/// Nodes in the sample where the user gives no number.
pub(crate) const SAMPLE: usize = 256;

/// Most drawn nodes of a network that is stepped through the warm-up.
const LARGEST_IN_WARM_UP: usize = 20_000;

/// Most drawn nodes of a network that is stepped from time 0. A step in f64 takes about as long as on the device.
const LARGEST_NETWORK: usize = 100_000;

/// Largest difference [K] that needs no warning.
const EXPECTED: f64 = 0.1;
/// The same for a network in one pass, whose single nodes may be off by more than its mean tolerance (docs/numerics.md 3).
const EXPECTED_IN_ONE_PASS: f64 = 1.0;

/// Below this temperature [K] absorbed fluxes are compared instead of temperatures, because the balance temperature is ill-conditioned. At 85 K a black
/// surface moves by 2e-3 K for 7e-5 W/m2, which is half a unit in the last place of the sunlight in f32.
const COLD: f64 = 85.0;

/// Remark on a comparison.
const SAME_LOADS: &str = "The reference has the same loads as the device, so these figures leave out the error of the loads. That is at most \
     0.05 W/m2 of sunlight, on a plate where the Sun rises or sets during a step of 17 s, and 1e-4 of the albedo's flux.";

/// Remark where no node was compared.
const NOT_COMPARED: &str = "No node was compared with the f64 reference, because the scene is too large for it.";

/// Differences between the device and the f64 reference over a sample of nodes and the steps of the run.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Accuracy {
    /// Nodes in the sample. 0 where nothing could be compared.
    pub(crate) nodes: u64,
    /// Nodes in the scene.
    pub(crate) of_nodes: u64,
    /// Steps compared.
    pub(crate) steps: u64,
    /// Largest difference [K].
    pub max_k: f64,
    /// Root mean square difference, by area [K].
    pub(crate) rms_k: f64,
    /// Node of the largest difference: its number, part and material in words.
    pub(crate) worst_node: String,
    /// Step of the largest difference.
    pub(crate) worst_step: u64,
    /// Time of that step [s].
    pub(crate) worst_time_s: f64,
    /// Error of the step length. `None` where no node of the sample stores heat.
    pub step_length: Option<StepLengthError>,
    /// Remark for the user: nodes whose absorbed flux was compared.
    pub(crate) notes: Vec<String>,
}

impl Accuracy {
    /// A warning for the user if the device is far from the reference.
    pub(crate) fn warning(&self, prepared: &Prepared) -> Option<String> {
        let in_one_pass = prepared.network.as_ref().is_some_and(|network| network.plan().is_some());
        self.warning_beyond(if in_one_pass { EXPECTED_IN_ONE_PASS } else { EXPECTED })
    }

    fn warning_beyond(&self, expected: f64) -> Option<String> {
        // NaN is far too.
        let near = self.max_k <= expected;
        (!near).then(|| {
            format!(
                "The device is up to {:.1e} K off the f64 reference, more than {expected} K: {}, at step {} ({} s).",
                self.max_k, self.worst_node, self.worst_step, self.worst_time_s
            )
        })
    }
}

/// The reference of a sample of nodes, and the differences so far.
pub struct Check {
    slots: Vec<usize>,
    /// Area of each node of the sample [m2].
    areas: Vec<f64>,
    /// Nodes of the device.
    nodes: usize,
    reference: Reference<IncidentFunction>,
    /// The light on the sample.
    light: Option<LitAreas>,
    /// Place of each node of the sample among the structures below plates. `None` without one.
    structures: Vec<Option<usize>>,
    /// The whole network of the scene in f64. `None` where it is too large.
    network: Option<NetworkCheck>,
    /// Radiation between surfaces. `None` without.
    exchange: Option<ExchangeCheck>,
    /// The sample at half the step.
    halves: Halves,
    /// Nodes of a network that is too large for the reference.
    left_out: bool,
    notes: Vec<String>,
    tally: Tally,
}

/// Differences of a run so far.
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
struct Tally {
    differences: Differences,
    /// Comparisons of cold nodes, and the largest difference of their fluxes [W/m2].
    cold: u64,
    largest_cold_flux: f64,
    /// Steps that were compared.
    steps: u64,
}

/// The saved state of a check.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct CheckState {
    nodes: ReferenceState,
    light: Option<LightAndPoses>,
    network: Option<NetworkCheckState>,
    exchange: Option<ExchangeCheckState>,
    halves: HalvesState,
    notes: Vec<String>,
    tally: Tally,
}

impl CheckState {
    /// Forgets what belongs to one run only: differences, and the costs of steps.
    pub(crate) fn forget_run(&mut self) {
        self.tally = Tally::default();
        self.halves.forget_run();
        self.network.iter_mut().for_each(|network| network.run.forget_run());
    }
}

impl Check {
    /// Whether a scene can be compared with the reference. Where surfaces radiate to each other every node must be known.
    fn is_possible(prepared: &Prepared) -> bool {
        let drawn = || prepared.nodes.real().map(|(slot, _)| slot);
        let of_network = prepared.network.as_ref().map_or(0, |scene| drawn().filter(|slot| scene.has(*slot)).count());
        let all = drawn().count();
        prepared.exchange.is_none() || all <= LARGEST_IN_WARM_UP || (all == of_network && all <= LARGEST_NETWORK)
    }

    /// A sample of nodes, evenly spread.
    pub fn new(prepared: &Prepared, sample: usize) -> Self {
        let nodes = &prepared.nodes;
        let mut real: Vec<usize> = nodes.real().map(|(slot, _)| slot).collect();
        let mut network = None;
        let mut left_out = false;
        let compares = Self::is_possible(prepared);
        if !compares {
            real.clear();
        } else if let Some(scene) = &prepared.network {
            let slots: Vec<usize> = real.iter().copied().filter(|slot| scene.has(*slot)).collect();
            left_out = slots.len() > LARGEST_NETWORK;
            if left_out {
                real.retain(|slot| !scene.has(*slot));
            } else {
                let waits = slots.len() > LARGEST_IN_WARM_UP;
                network = Some(NetworkCheck { waits, ..NetworkCheck::new(prepared, scene, slots) });
            }
        }
        let slots = sampled(prepared, &real, sample);
        let own = slots.iter().map(|slot| nodes.reference_node(*slot)).collect();
        let structures = prepared.structures();
        let reference = Reference::new(own, prepared.materials.clone(), incident as IncidentFunction)
            .with_joints(joints(prepared, &slots));
        Self {
            light: prepared.lit_areas(slots.iter().copied()),
            halves: Halves::new(prepared, &reference, &slots, network.is_some(), (sample, !compares)),
            areas: slots.iter().map(|slot| nodes.areas[*slot]).collect(),
            nodes: nodes.vertex_of_node.len(),
            structures: slots.iter().map(|slot| structures.binary_search(slot).ok()).collect(),
            reference,
            exchange: prepared
                .exchange
                .as_ref()
                .filter(|_| compares)
                .map(|craft| ExchangeCheck::new(craft, &prepared.loads.joints_at(0.0).1)),
            slots,
            network,
            left_out,
            notes: Vec::new(),
            tally: Tally::default(),
        }
    }

    /// Settles the sample at a load, at a time [s].
    pub(crate) fn settle(&mut self, load: &StepLoad, time: f64) {
        self.reference.find_light(&mut self.light, load);
        self.reference.settle(load);
        if let Some(network) = self.network.as_mut().filter(|network| !network.waits) {
            let heat = network.heat(load);
            let done = network.run.settle(heat, time);
            network.after(done);
        }
    }

    /// Settles the sample at a temperature [K].
    pub(crate) fn settle_at(&mut self, temperature: f64) {
        self.reference.settle_at(temperature);
        if let Some(network) = self.network.as_mut().filter(|network| !network.waits) {
            network.run.settle_at(temperature);
            network.take_temperatures();
        }
    }

    /// Finds the light that nodes receive from the craft in a step, with rays for the poses between which the `rows` of the engine lie.
    fn receive(&mut self, load: &StepLoad, steps: f64, rows: Option<&RowsBetween>) {
        let Some(exchange) = &mut self.exchange else { return };
        if self.network.as_ref().is_some_and(|network| network.failed.is_some() || network.waits) {
            return;
        }
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
        let received = exchange.received(load, steps, rows, &temperatures, &lit);
        self.reference.receive(self.slots.iter().map(|slot| received[*slot]).collect());
        if let Some(network) = &mut self.network {
            network.loads.receive(network.slots.iter().map(|slot| received[*slot]).collect());
        }
    }

    /// Advances the sample by `steps` steps, from `start` [s] for `length` [s]. Where surfaces radiate to each other the engine tells the poses of the joints between
    /// which its rows lie.
    pub(crate) fn step(&mut self, load: &StepLoad, steps: f64, start: f64, length: f64, rows: Option<&RowsBetween>) {
        let _checks = span("checking in f64");
        self.reference.find_light(&mut self.light, load);
        self.receive(load, steps, rows);
        self.reference.step(load, steps);
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

    /// Begins the steps in halves, from the present state of the engine.
    ///
    /// # Errors
    /// A call that fails.
    pub(super) fn begin_halves(&mut self, engine: &mut dyn Engine) -> Result<(), EngineError> {
        let mut temperatures = Vec::new();
        if self.halves.has_lone() {
            engine.submit(None, Order { temperatures: true, ..Order::default() })?;
            temperatures = engine.deliver()?.temperatures.unwrap_or_default();
        }
        self.halves.begin(&self.reference, self.network.as_ref(), &temperatures);
        Ok(())
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

    /// Starts a network that is too large for the warm-up from the engine's temperatures [K] and thermostats at time 0.
    pub(super) fn start_network(&mut self, temperatures: &[f64], on: &[bool]) {
        if let Some(network) = self.network.as_mut().filter(|network| network.waits) {
            network.waits = false;
            network.run.start_from(temperatures, on);
            network.take_temperatures();
            self.notes.push(format!(
                "The thermal network has more than {LARGEST_IN_WARM_UP} drawn nodes: its reference starts from the \
                 temperatures of the device at time 0. These figures do not have the error of the warm-up."
            ));
        }
    }

    /// Present temperatures of the sample [K]. The comparison follows when the device delivers the same step.
    pub(crate) fn temperatures(&self) -> Vec<f64> {
        let known = |slot: &usize| self.network.as_ref().and_then(|network| network.temperatures[*slot]);
        let nodes = self.slots.iter().zip(self.reference.temperatures());
        nodes.map(|(slot, temperature)| known(slot).unwrap_or(*temperature)).collect()
    }

    /// Compares delivered temperatures with the temperatures of the reference at that step.
    pub(crate) fn compare(&mut self, step: u32, time: f64, reference: &[f64], device: &[f32]) {
        self.tally.steps += 1;
        for ((slot, area), expected) in self.slots.iter().zip(&self.areas).zip(reference) {
            let found = f64::from(device[*slot]);
            if *expected < COLD {
                self.tally.cold += 1;
                let flux = STEFAN_BOLTZMANN * (found.powi(4) - expected.powi(4));
                self.tally.largest_cold_flux = self.tally.largest_cold_flux.max(flux.abs());
                continue;
            }
            self.tally.differences.add((found - expected).abs(), *area, (*slot, step, time));
        }
    }

    /// The state and the differences so far.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn save(&mut self) -> Result<CheckState, EngineError> {
        Ok(CheckState {
            nodes: self.reference.save(),
            light: self.light.as_ref().and_then(|light| light.redraw.found_for.clone()),
            network: self.network.as_mut().map(NetworkCheck::save).transpose()?,
            exchange: self.exchange.as_ref().map(ExchangeCheck::save),
            halves: self.halves.save()?,
            notes: self.notes.clone(),
            tally: self.tally,
        })
    }

    /// Restores a saved state.
    ///
    /// # Errors
    /// A state of another scene or sample.
    pub(crate) fn restore(&mut self, saved: &CheckState) -> Result<(), EngineError> {
        self.reference.restore(&saved.nodes)?;
        if let Some(light) = &mut self.light {
            light.redraw.found_for.clone_from(&saved.light);
        }
        if let Some(network) = &mut self.network {
            network.restore(part("the network beside the run", &saved.network)?)?;
        }
        if let Some(exchange) = &mut self.exchange {
            exchange.restore(part("radiation between surfaces beside the run", &saved.exchange)?)?;
        }
        self.halves.restore(&saved.halves)?;
        self.notes.clone_from(&saved.notes);
        self.tally = saved.tally;
        Ok(())
    }

    /// The result.
    pub fn accuracy(&self, prepared: &Prepared) -> Accuracy {
        let Tally { differences, cold, largest_cold_flux, steps } = self.tally;
        let (slot, step, time) = differences.worst;
        let nodes = &prepared.nodes;
        let named = |slot: usize| {
            let group = slot / GROUP;
            let part = nodes.group_part.get(group).map_or("", |part| &prepared.parts[*part as usize]);
            let material =
                nodes.group_material.get(group).map_or("", |index| &prepared.materials[*index as usize].name);
            format!("node {slot}, part {part}, material {material}")
        };
        let compared = if self.slots.is_empty() { NOT_COMPARED } else { SAME_LOADS };
        let mut notes = vec![compared.to_owned()];
        if self.network.is_some() {
            notes.push("The reference of the thermal network runs at a tenth of its tolerance.".to_owned());
        }
        notes.extend(self.notes.iter().cloned());
        if self.left_out {
            notes.push(format!(
                "The thermal network has more than {LARGEST_NETWORK} drawn nodes and was not compared: its nodes are \
                 not in these figures."
            ));
        }
        if let Some(reason) = self.network.as_ref().and_then(|network| network.failed.as_ref()) {
            notes.push(format!("The f64 network could not be stepped along: {reason}"));
        }
        notes.extend(self.exchange.as_ref().and_then(ExchangeCheck::remark));
        notes.extend(self.halves.remark());
        if cold > 0 {
            notes.push(format!(
                "{cold} comparisons of nodes below {COLD} K, where the balance is ill-conditioned, were made in radiated \
                 flux (sigma T^4): largest difference {largest_cold_flux:.1e} W/m2"
            ));
        }
        Accuracy {
            nodes: self.slots.len() as u64,
            of_nodes: nodes.count as u64,
            steps,
            max_k: differences.largest,
            rms_k: differences.rms(),
            worst_node: named(slot),
            worst_step: u64::from(step),
            worst_time_s: time,
            step_length: self.halves.error(named),
            notes,
        }
    }
}

/// The nodes to compare: `sample` of the drawn nodes, evenly spread. Where surfaces radiate to each other all that are not in the network are needed.
fn sampled(prepared: &Prepared, real: &[usize], sample: usize) -> Vec<usize> {
    let spread = |of: &[usize]| -> Vec<usize> {
        let count = of.len().min(sample);
        (0..count).map(|i| of[i * of.len() / count]).collect()
    };
    if prepared.exchange.is_none() {
        return spread(real);
    }
    let in_network = |slot: &usize| prepared.network.as_ref().is_some_and(|scene| scene.has(*slot));
    let (of_network, mut all): (Vec<usize>, Vec<usize>) = real.iter().partition(|slot| in_network(slot));
    all.extend(spread(&of_network));
    all.sort_unstable();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_that_is_off_by_more_than_0_1_k_warns() {
        let of = |max_k| {
            let accuracy = Accuracy { max_k, worst_node: "node 7, part body".to_owned(), ..Accuracy::default() };
            accuracy.warning_beyond(EXPECTED)
        };
        assert_eq!((of(0.0), of(0.099)), (None, None));
        for far in [0.11, 88.0, f64::NAN] {
            assert!(of(far).is_some_and(|text| text.contains("node 7, part body")), "{far}");
        }
    }
}
