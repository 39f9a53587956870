//! The sample of the check in steps of half the length, which gives the error of the step length.
//!
//! Both runs begin in the same state at time 0 and are in f64. Both have the light of whole steps, which follows the Sun by an angle of their own.

use super::differences::Differences;
use super::network::{NetworkCheck, NetworkCheckState};
use crate::environment::step::StepLoads;
use crate::simulation::engine::EngineError;
use crate::simulation::prepare::Prepared;
use crate::thermal::incident::IncidentFunction;
use crate::thermal::material::{Material, Response};
use crate::thermal::misfit::part;
use crate::thermal::reference::{Reference, ReferenceState};

/// Most drawn nodes of a network that is stepped in halves. In f64 two halves take twice as long as a whole step.
const LARGEST_NETWORK: usize = 5_000;

/// From the difference between steps and half steps to the error of steps: exact for an error in proportion to the step.
const ERROR_OF_DIFFERENCE: f64 = 2.0;

/// Error of the step length: the error of the mean load over a step, after the response to it. The estimate is twice the difference in f64 between
/// steps and steps of half the length, from the same state at time 0. For an error in proportion to the step the estimate is the error, and for an
/// error in proportion to the step's square it is 3/2 of the error. Where the Sun comes or goes inside a step the estimate is 1 to 2 times the error,
/// and up to 2.4 times was seen on a transition. Nodes that follow their load at once are not in these figures, because their temperature follows the
/// mean load by definition.
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
}

/// The sample at half the step, and its differences so far.
pub(super) struct Halves {
    loads: StepLoads,
    reference: Reference<IncidentFunction>,
    network: Option<NetworkCheck>,
    /// Device node of each node of the sample that stores heat. `None` where its temperature follows the load at once.
    stores: Vec<Option<usize>>,
    /// Drawn nodes of a network that is too large.
    too_large: Option<usize>,
    begun: bool,
    errors: Differences,
}

/// The saved state of a sample at half the step.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct HalvesState {
    nodes: ReferenceState,
    network: Option<NetworkCheckState>,
    begun: bool,
    errors: Differences,
}

impl HalvesState {
    /// Forgets the errors and the costs of the steps.
    pub(crate) fn forget_run(&mut self) {
        self.errors = Differences::default();
        self.network.iter_mut().for_each(|network| network.run.forget_run());
    }
}

impl Halves {
    /// A sample at half the step, not yet begun. `slots` are the device nodes of `reference`. `network` tells whether the check steps a network.
    pub(crate) fn new(
        prepared: &Prepared,
        reference: &Reference<IncidentFunction>,
        slots: &[usize],
        network: bool,
    ) -> Self {
        let scene = prepared.network.as_ref().filter(|_| network);
        let drawn = scene.map_or_else(Vec::new, |scene| {
            (0..prepared.nodes.vertex_of_node.len()).filter(|slot| scene.has(*slot)).collect()
        });
        let too_large = Some(drawn.len()).filter(|count| *count > LARGEST_NETWORK);
        let network = scene.filter(|_| too_large.is_none()).map(|scene| NetworkCheck {
            // The shares of the Sun come from the whole steps.
            light: None,
            ..NetworkCheck::new(prepared, scene, drawn)
        });
        let stores = |(slot, node): (&usize, &crate::thermal::reference::ReferenceNode)| {
            let own = match &prepared.network {
                Some(scene) if scene.has(*slot) => network.is_some() && scene.stores_heat(*slot),
                _ => has_memory(&prepared.materials[node.material as usize]),
            };
            own.then_some(*slot)
        };
        Self {
            loads: prepared.loads.clone(),
            stores: slots.iter().zip(reference.nodes()).map(stores).collect(),
            reference: reference.clone(),
            network,
            too_large,
            begun: false,
            errors: Differences::default(),
        }
    }

    /// Whether the steps have begun, and any node stores heat.
    pub(crate) fn has_begun(&self) -> bool {
        self.begun && self.stores.iter().any(Option::is_some)
    }

    /// Begins in the state of the whole steps.
    pub(crate) fn begin(&mut self, reference: &Reference<IncidentFunction>, network: Option<&NetworkCheck>) {
        self.begun = true;
        self.reference = reference.clone();
        if let (Some(own), Some(network)) = (&mut self.network, network) {
            own.run.start_from(&network.run.temperatures(), network.run.on());
            own.take_temperatures();
        }
    }

    /// Advances by `steps` steps from `start` [s] for `length` [s], in two halves. `whole` and `network` have the shares of the Sun.
    pub(crate) fn step(
        &mut self,
        whole: &Reference<IncidentFunction>,
        network: Option<&Reference<IncidentFunction>>,
        steps: f64,
        [start, length]: [f64; 2],
    ) {
        self.reference.light(whole.lit().clone());
        self.reference.receive(whole.received().to_vec());
        if let (Some(own), Some(network)) = (&mut self.network, network) {
            own.loads.light(network.lit().clone());
            own.loads.receive(network.received().to_vec());
        }
        let half = 0.5 * length;
        for from in [start, start + half] {
            let load = self.loads.step_load(from, from + half);
            self.reference.step(&load, 0.5 * steps);
            if let Some(network) = self.network.as_mut().filter(|network| network.failed.is_none()) {
                network.step(&load, from, half);
            }
        }
    }

    /// Compares with the temperatures of the sample after the whole step [K], which ended at `time` [s].
    pub(crate) fn compare(&mut self, whole: &[f64], time: f64) {
        let known = |slot: &usize| self.network.as_ref().and_then(|network| network.temperatures.get(slot)).copied();
        let nodes = self.stores.iter().zip(whole.iter().zip(self.reference.temperatures()));
        for (slot, (whole, own)) in nodes.filter_map(|(slot, both)| Some((slot.as_ref()?, both))) {
            let error = ERROR_OF_DIFFERENCE * (whole - known(slot).unwrap_or(*own)).abs();
            self.errors.add(error, (*slot, 0, time));
        }
    }

    /// The error so far. `named` names a device node.
    pub(crate) fn error(&self, named: impl Fn(usize) -> String) -> Option<StepLengthError> {
        (self.errors.count > 0).then(|| StepLengthError {
            nodes: self.stores.iter().flatten().count() as u64,
            max_k: self.errors.largest,
            rms_k: self.errors.rms(),
            worst_node: named(self.errors.worst.0),
            worst_time_s: self.errors.worst.2,
        })
    }

    /// Why a network is not in the error of the step length.
    pub(crate) fn remark(&self) -> Option<String> {
        let failed = self.network.as_ref().and_then(|network| network.failed.as_ref());
        match (self.too_large, failed) {
            (Some(count), _) => Some(format!(
                "The thermal network has {count} drawn nodes, more than {LARGEST_NETWORK}: its nodes are not in the error of the step length."
            )),
            (None, Some(reason)) => Some(format!(
                "The f64 network could not be stepped at half the step, so the error of the step length is incomplete: {reason}"
            )),
            (None, None) => None,
        }
    }

    /// The state and the errors so far.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn save(&mut self) -> Result<HalvesState, EngineError> {
        Ok(HalvesState {
            nodes: self.reference.save(),
            network: self.network.as_mut().map(NetworkCheck::save).transpose()?,
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
        (self.begun, self.errors) = (saved.begun, saved.errors);
        Ok(())
    }
}

/// Whether the temperature of a node depends on its past.
fn has_memory(material: &Material) -> bool {
    match &material.response {
        Response::Instant | Response::Network | Response::Given => false,
        Response::Radiative(plate) => plate.capacity > 0.0 || plate.over.is_some(),
        Response::Transition(transition) => {
            [&transition.heating, &transition.cooling].iter().all(|profile| profile.t_max_steps > 0.0)
        }
    }
}
