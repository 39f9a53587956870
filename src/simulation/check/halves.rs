//! The sample of the check in steps of half the length, which gives the error of the step length.
//!
//! Both runs begin in the same state at time 0 and are in f64. Both have the light of whole steps, which follows the Sun by an angle of their own. Nodes whose
//! network or whose exchange is too large for that are taken by themselves (`lone.rs`).

use super::differences::{Differences, ERROR_OF_DIFFERENCE};
use super::lone::{LoneNodes, LoneNodesState};
use super::network::{NetworkCheck, NetworkCheckState};
use crate::environment::StepLoad;
use crate::environment::step::StepLoads;
use crate::simulation::engine::EngineError;
use crate::simulation::prepare::Prepared;
use crate::thermal::incident::IncidentFunction;
use crate::thermal::misfit::part;
use crate::thermal::reference::{Reference, ReferenceState};
use crate::trace::timed;

/// Most drawn nodes of a network that is stepped in halves. In f64 two halves take twice as long as a whole step.
const LARGEST_NETWORK: usize = 5_000;

/// Error of the step length: the error of the mean load over a step, after the response to it. The estimate is twice the difference in f64 between
/// steps and steps of half the length, from the same state at time 0. For an error in proportion to the step the estimate is the error, and for an
/// error in proportion to the step's square it is 3/2 of the error. Where the Sun comes or goes inside a step the estimate is 1 to 2 times the error,
/// and up to 2.4 times was seen on a transition. Nodes that follow their load at once are not in these figures, because their temperature follows the
/// mean load by definition. Nodes weigh by their areas.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct StepLengthError {
    /// Nodes of the sample that store heat.
    pub(crate) nodes: u64,
    /// Largest error [K].
    pub max_k: f64,
    /// Root mean square error [K].
    pub rms_k: f64,
    /// Node of the largest error: its number, part and material in words.
    pub worst_node: String,
    /// Time of the largest error [s].
    pub worst_time_s: f64,
    /// How the error was found, in words.
    pub measure: String,
}

/// The sample at half the step, and its differences so far.
pub(super) struct Halves {
    loads: StepLoads,
    reference: Reference<IncidentFunction>,
    network: Option<NetworkCheck>,
    /// Device node of each node of the sample that stores heat. `None` where its temperature follows the load at once.
    stores: Vec<Option<usize>>,
    /// Area of each node of the sample [m2].
    areas: Vec<f64>,
    /// Nodes of a network that is too large, and nodes that the check leaves out.
    lone: LoneNodes,
    begun: bool,
    errors: Differences,
}

/// The saved state of a sample at half the step.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct HalvesState {
    nodes: ReferenceState,
    network: Option<NetworkCheckState>,
    lone: LoneNodesState,
    begun: bool,
    errors: Differences,
}

impl HalvesState {
    /// Forgets the errors and the costs of the steps.
    pub(crate) fn forget_run(&mut self) {
        (self.errors, self.lone.errors) = Default::default();
        self.network.iter_mut().for_each(|network| network.run.forget_run());
    }
}

impl Halves {
    /// A sample at half the step, not yet begun. `slots` are the device nodes of `reference`. `network` tells whether the check steps a network. At most `sample`
    /// nodes are taken by themselves: all others where `rest` says so, else the others of a network.
    pub(crate) fn new(
        prepared: &Prepared,
        reference: &Reference<IncidentFunction>,
        slots: &[usize],
        network: bool,
        (sample, rest): (usize, bool),
    ) -> Self {
        let scene = prepared.network.as_ref().filter(|_| network);
        let drawn = scene.map_or_else(Vec::new, |scene| {
            (0..prepared.nodes.vertex_of_node.len()).filter(|slot| scene.has(*slot)).collect()
        });
        let network = scene.filter(|_| drawn.len() <= LARGEST_NETWORK).map(|scene| NetworkCheck {
            // The shares of the Sun come from the whole steps.
            light: None,
            ..NetworkCheck::new(prepared, scene, drawn)
        });
        let stores = |(slot, node): (&usize, &crate::thermal::reference::ReferenceNode)| {
            let own = match &prepared.network {
                Some(scene) if scene.has(*slot) => network.is_some() && scene.stores_heat(*slot),
                _ => prepared.materials[node.material as usize].response.has_memory(),
            };
            own.then_some(*slot)
        };
        let of_network = |slot: usize| prepared.network.as_ref().is_some_and(|scene| scene.has(slot));
        let alone = |slot: usize| (rest || of_network(slot)) && network.is_none();
        Self {
            lone: LoneNodes::new(prepared, sample, alone),
            areas: slots.iter().map(|slot| prepared.nodes.areas[*slot]).collect(),
            loads: prepared.loads.clone(),
            stores: slots.iter().zip(reference.nodes()).map(stores).collect(),
            reference: reference.clone(),
            network,
            begun: false,
            errors: Differences::default(),
        }
    }

    /// Whether the steps have begun, and any node stores heat.
    pub(crate) fn has_begun(&self) -> bool {
        self.begun && (self.stores.iter().any(Option::is_some) || self.has_lone())
    }

    /// Whether nodes are taken by themselves.
    pub(crate) fn has_lone(&self) -> bool {
        self.lone.len() > 0
    }

    /// Begins in the state of the whole steps. Nodes by themselves begin at the temperatures of all nodes [K].
    pub(crate) fn begin(
        &mut self,
        reference: &Reference<IncidentFunction>,
        network: Option<&NetworkCheck>,
        temperatures: &[f32],
    ) {
        self.begun = true;
        self.lone.begin(temperatures);
        self.reference = reference.clone();
        if let (Some(own), Some(network)) = (&mut self.network, network) {
            own.run.start_from(&network.run.temperatures(), network.run.on());
            own.take_temperatures();
        }
    }

    /// Advances by `steps` steps from `start` [s] for `length` [s], in two halves of the `load`. `whole` and `network` have the shares of the Sun.
    pub(crate) fn step(
        &mut self,
        load: &StepLoad,
        whole: &Reference<IncidentFunction>,
        network: Option<&Reference<IncidentFunction>>,
        steps: f64,
        [start, length]: [f64; 2],
    ) {
        self.lone.step(load, steps, [start, length]);
        if self.stores.iter().all(Option::is_none) {
            return;
        }
        self.reference.light(whole.lit().clone());
        self.reference.receive(whole.received().to_vec());
        if let (Some(own), Some(network)) = (&mut self.network, network) {
            own.loads.light(network.lit().clone());
            own.loads.receive(network.received().to_vec());
        }
        let half = 0.5 * length;
        for from in [start, start + half] {
            let load = timed("finding the loads", || self.loads.step_load(from, from + half));
            self.reference.step(&load, 0.5 * steps);
            if let Some(network) = self.network.as_mut().filter(|network| network.failed.is_none()) {
                network.step(&load, from, half);
            }
        }
    }

    /// Compares with the temperatures of the sample after `steps` steps [K], which ended at `time` [s].
    pub(crate) fn compare(&mut self, whole: &[f64], steps: f64, time: f64) {
        let known = |slot: &usize| self.network.as_ref().and_then(|network| network.temperatures[*slot]);
        let nodes = self.stores.iter().zip(&self.areas).zip(whole.iter().zip(self.reference.temperatures()));
        for ((slot, area), (whole, own)) in
            nodes.filter_map(|((slot, area), both)| Some(((slot.as_ref()?, area), both)))
        {
            let error = ERROR_OF_DIFFERENCE * (whole - known(slot).unwrap_or(*own)).abs();
            self.errors.add(error, steps * area, (*slot, 0, time));
        }
    }

    /// The error so far. `named` names a device node.
    pub(crate) fn error(&self, named: impl Fn(usize) -> String) -> Option<StepLengthError> {
        let errors = self.errors.and(self.lone.errors);
        let by_themselves = match self.lone.len() {
            0 => String::new(),
            lone => format!("; {lone} of the nodes by themselves, without conduction and the light of other surfaces"),
        };
        (errors.count > 0).then(|| StepLengthError {
            nodes: (self.stores.iter().flatten().count() + self.lone.len()) as u64,
            max_k: errors.largest,
            rms_k: errors.rms(),
            worst_node: named(errors.worst.0),
            worst_time_s: errors.worst.2,
            measure: format!("twice the difference in f64 to steps of half the length{by_themselves}"),
        })
    }

    /// Why a network is not in the error of the step length.
    pub(crate) fn remark(&self) -> Option<String> {
        let reason = self.network.as_ref()?.failed.as_ref()?;
        Some(format!(
            "The f64 network could not be stepped at half the step, so the error of the step length is incomplete: {reason}"
        ))
    }

    /// The state and the errors so far.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn save(&mut self) -> Result<HalvesState, EngineError> {
        Ok(HalvesState {
            nodes: self.reference.save(),
            network: self.network.as_mut().map(NetworkCheck::save).transpose()?,
            lone: self.lone.save(),
            begun: self.begun,
            errors: self.errors,
        })
    }

    /// Restores a saved state.
    ///
    /// # Errors
    /// A state of another scene or sample.
    pub(crate) fn restore(&mut self, saved: &HalvesState) -> Result<(), EngineError> {
        self.reference.restore(&saved.nodes)?;
        if let Some(network) = &mut self.network {
            network.restore(part("a network at half the step", &saved.network)?)?;
        }
        self.lone.restore(&saved.lone)?;
        (self.begun, self.errors) = (saved.begun, saved.errors);
        Ok(())
    }
}
