//! Comparison of the device with the f64 reference: a sample of nodes is stepped beside the run.
//!
//! A network is stepped whole in f64, at a tenth of its tolerance. Up to 20,000 drawn nodes this includes the warm-up. Up to 100,000 drawn nodes it starts
//! at time 0 from the state of the device.
//!
//! A thread of its own does a step that takes long, while the engine goes on (`beside.rs`). Results do not depend on that.
//!
//! The sample also takes every step of the run in two halves, which gives the error of the step length. Where a comparison is not possible, because surfaces
//! of a large craft radiate to each other, that error is all that a check finds.

mod beside;
mod differences;
mod exchange;
mod halves;
mod lone;
mod network;
mod sample;

pub use self::halves::StepLengthError;

use std::sync::mpsc::{Receiver, channel};

use self::beside::Beside;
use self::differences::Differences;
use self::exchange::{ExchangeCheck, ExchangeCheckState};
use self::halves::{Halves, HalvesState};
use self::network::{NetworkCheck, NetworkCheckState, joints};
use self::sample::Sample;
use super::engine::{Engine, EngineError, Order};
use super::exchange_poses::RowsBetween;
use super::prepare::Prepared;
use crate::environment::StepLoad;
use crate::environment::shadow::LightAndPoses;
use crate::model::nodes::GROUP;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::incident::{IncidentFunction, incident};
use crate::thermal::misfit::part;
use crate::thermal::reference::{Reference, ReferenceState};

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

/// Temperatures of the sample at the end of a step [K], once that step is done.
pub(crate) type SampleEnd = Receiver<Vec<f64>>;

/// The reference of a sample of nodes, and the differences so far.
pub struct Check {
    /// Nodes of the sample.
    slots: Vec<usize>,
    /// Area of each node of the sample [m2].
    areas: Vec<f64>,
    /// The sample in f64.
    sample: Beside<Sample>,
    /// Whether a step takes long enough for a thread of its own.
    takes_long: bool,
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
        let exchange = prepared.exchange.as_ref().filter(|_| compares);
        Self {
            areas: slots.iter().map(|slot| nodes.areas[*slot]).collect(),
            takes_long: network.is_some() || exchange.is_some(),
            sample: Beside::new(Sample {
                light: prepared.lit_areas(slots.iter().copied()),
                halves: Halves::new(prepared, &reference, &slots, network.is_some(), (sample, !compares)),
                nodes: nodes.vertex_of_node.len(),
                structures: slots.iter().map(|slot| structures.binary_search(slot).ok()).collect(),
                reference,
                exchange: exchange.map(|craft| ExchangeCheck::new(craft, &prepared.loads.joints_at(0.0).1)),
                slots: slots.clone(),
                has_alone: slots.iter().any(|slot| prepared.network.as_ref().is_none_or(|scene| !scene.has(*slot))),
                network,
            }),
            slots,
            left_out,
            notes: Vec::new(),
            tally: Tally::default(),
        }
    }

    /// Settles the sample at a load, at a time [s].
    pub(crate) fn settle(&mut self, load: &StepLoad, time: f64) {
        self.sample.here().settle(load, time);
    }

    /// Settles the sample at a temperature [K].
    pub(crate) fn settle_at(&mut self, temperature: f64) {
        self.sample.here().settle_at(temperature);
    }

    /// Advances the sample by `steps` steps, from `start` [s] for `length` [s]. Where surfaces radiate to each other the engine tells the poses of the joints between
    /// which its rows lie. A step that takes long is done while the engine goes on.
    pub(crate) fn step(
        &mut self,
        load: &StepLoad,
        steps: f64,
        start: f64,
        length: f64,
        rows: Option<&RowsBetween>,
    ) -> SampleEnd {
        if self.sample.here().is_idle() {
            return self.present();
        }
        let (end, ended) = channel();
        // The rows of the engine are shared while it uses them.
        let turned = self.sample.here().follow(rows);
        let step = move |sample: &mut Sample, load: &StepLoad| {
            sample.step(load, steps, [start, length], turned);
            // A warm-up compares nothing, so nobody may be there to take them.
            drop(end.send(sample.temperatures()));
        };
        if self.takes_long {
            let load = load.clone();
            self.sample.work(move |sample| step(sample, &load));
        } else {
            step(&mut self.sample.here(), load);
        }
        ended
    }

    /// The present temperatures of the sample, for a comparison without a step.
    pub(crate) fn present(&mut self) -> SampleEnd {
        let (end, ended) = channel();
        drop(end.send(self.sample.here().temperatures()));
        ended
    }

    /// Begins the steps in halves, from the present state of the engine.
    ///
    /// # Errors
    /// A call that fails.
    pub(super) fn begin_halves(&mut self, engine: &mut dyn Engine) -> Result<(), EngineError> {
        let mut sample = self.sample.here();
        let mut temperatures = Vec::new();
        if sample.halves.has_lone() {
            engine.submit(None, Order { temperatures: true, ..Order::default() })?;
            temperatures = engine.deliver()?.temperatures.unwrap_or_default();
        }
        let Sample { halves, reference, network, .. } = &mut *sample;
        halves.begin(reference, network.as_ref(), &temperatures);
        Ok(())
    }

    /// Adds values [K] to the temperatures of the network's nodes.
    pub(super) fn move_network(&mut self, by: &[f64]) {
        self.sample.here().move_network(by);
    }

    /// Adds values [K] to the temperatures of the structures below plates.
    pub(super) fn move_structures(&mut self, by: &[f64]) {
        self.sample.here().move_structures(by);
    }

    /// Starts a network that is too large for the warm-up from the engine's temperatures [K] and thermostats at time 0.
    pub(super) fn start_network(&mut self, temperatures: &[f64], on: &[bool]) {
        if self.sample.here().start_network(temperatures, on) {
            self.notes.push(format!(
                "The thermal network has more than {LARGEST_IN_WARM_UP} drawn nodes: its reference starts from the \
                 temperatures of the device at time 0. These figures do not have the error of the warm-up."
            ));
        }
    }

    /// Compares delivered temperatures with the temperatures of the reference at the `end` of that step.
    pub(crate) fn compare(&mut self, step: u32, time: f64, end: &SampleEnd, device: &[f32]) {
        // Where there are none, the thread ended in a panic, which the next call passes on.
        let Ok(reference) = end.recv() else { return };
        self.tally.steps += 1;
        for ((slot, area), expected) in self.slots.iter().zip(&self.areas).zip(&reference) {
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
        let mut sample = self.sample.here();
        Ok(CheckState {
            nodes: sample.reference.save(),
            light: sample.light.as_ref().and_then(|light| light.redraw.found_for.clone()),
            network: sample.network.as_mut().map(NetworkCheck::save).transpose()?,
            exchange: sample.exchange.as_ref().map(ExchangeCheck::save),
            halves: sample.halves.save()?,
            notes: self.notes.clone(),
            tally: self.tally,
        })
    }

    /// Restores a saved state.
    ///
    /// # Errors
    /// A state of another scene or sample.
    pub(crate) fn restore(&mut self, saved: &CheckState) -> Result<(), EngineError> {
        let mut sample = self.sample.here();
        sample.reference.restore(&saved.nodes)?;
        if let Some(light) = &mut sample.light {
            light.redraw.found_for.clone_from(&saved.light);
        }
        if let Some(network) = &mut sample.network {
            network.restore(part("the network beside the run", &saved.network)?)?;
        }
        if let Some(exchange) = &mut sample.exchange {
            exchange.restore(part("radiation between surfaces beside the run", &saved.exchange)?)?;
        }
        sample.halves.restore(&saved.halves)?;
        self.notes.clone_from(&saved.notes);
        self.tally = saved.tally;
        Ok(())
    }

    /// The result.
    pub fn accuracy(&mut self, prepared: &Prepared) -> Accuracy {
        let sample = self.sample.here();
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
        if sample.network.is_some() {
            notes.push("The reference of the thermal network runs at a tenth of its tolerance.".to_owned());
        }
        notes.extend(self.notes.iter().cloned());
        if self.left_out {
            notes.push(format!(
                "The thermal network has more than {LARGEST_NETWORK} drawn nodes and was not compared: its nodes are \
                 not in these figures."
            ));
        }
        if let Some(reason) = sample.network.as_ref().and_then(|network| network.failed.as_ref()) {
            notes.push(format!("The f64 network could not be stepped along: {reason}"));
        }
        notes.extend(sample.exchange.as_ref().and_then(ExchangeCheck::remark));
        notes.extend(sample.halves.remark());
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
            step_length: sample.halves.error(named),
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
