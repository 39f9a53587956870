//! The whole network of a scene in f64, beside the run.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::environment::StepLoad;
use crate::environment::shadow::{LightAndPoses, LitAreas};
use crate::simulation::engine::EngineError;
use crate::simulation::network::{NetworkRun, NetworkRunState, SceneNetwork};
use crate::simulation::prepare::Prepared;
use crate::thermal::incident::{IncidentFunction, incident};
use crate::thermal::reference::{Reference, ReferenceState};
use crate::trace::span;

/// The network in f64, with the loads of all its nodes.
pub(super) struct NetworkCheck {
    pub(crate) run: NetworkRun,
    pub(crate) loads: Reference<IncidentFunction>,
    pub(crate) light: Option<LitAreas>,
    pub(crate) slots: Vec<usize>,
    /// Temperature of each node of the device [K]. `None` outside the network, and before it starts.
    pub(crate) temperatures: Vec<Option<f64>>,
    /// Whether it waits for the state of the device at time 0.
    pub(crate) waits: bool,
    pub(crate) failed: Option<String>,
}

/// The saved state of a network in f64.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct NetworkCheckState {
    pub(super) run: NetworkRunState,
    loads: ReferenceState,
    light: Option<LightAndPoses>,
    temperatures: BTreeMap<usize, f64>,
    waits: bool,
    failed: Option<String>,
}

impl NetworkCheck {
    /// A network that is not yet started. `slots` are its drawn nodes.
    pub(crate) fn new(prepared: &Prepared, scene: &Arc<SceneNetwork>, slots: Vec<usize>) -> Self {
        let loads = slots.iter().map(|slot| prepared.nodes.reference_node(*slot)).collect();
        Self {
            run: NetworkRun::tight(scene),
            loads: Reference::new(loads, prepared.materials.clone(), incident as IncidentFunction)
                .with_joints(joints(prepared, &slots)),
            light: prepared.lit_areas(slots.iter().copied()),
            slots,
            temperatures: vec![None; prepared.nodes.vertex_of_node.len()],
            waits: false,
            failed: None,
        }
    }

    /// Heat of every network node under a load [W].
    pub(crate) fn heat(&mut self, load: &StepLoad) -> Vec<f64> {
        self.loads.find_light(&mut self.light, load);
        let _finds = span("finding the heat of the network in f64");
        let mut absorbed = vec![0.0; self.temperatures.len()];
        self.slots.iter().zip(self.loads.absorbed(load)).for_each(|(slot, flux)| absorbed[*slot] = flux);
        self.run.scene().heat(|slot| absorbed[slot])
    }

    /// Advances under a load from `start` [s] for `length` [s].
    pub(crate) fn step(&mut self, load: &StepLoad, start: f64, length: f64) {
        let heat = self.heat(load);
        let done = self.run.step(heat, start, length);
        self.after(done);
    }

    /// The state between two steps.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn save(&mut self) -> Result<NetworkCheckState, EngineError> {
        Ok(NetworkCheckState {
            run: self.run.save(),
            loads: self.loads.save(),
            light: self.light.as_ref().and_then(|light| light.redraw.found_for.clone()),
            temperatures: (0..).zip(&self.temperatures).filter_map(|(slot, kelvin)| Some((slot, (*kelvin)?))).collect(),
            waits: self.waits,
            failed: self.failed.clone(),
        })
    }

    /// Restores a saved state.
    ///
    /// # Errors
    /// A state of another scene.
    pub(crate) fn restore(&mut self, saved: &NetworkCheckState) -> Result<(), EngineError> {
        self.run.restore(&saved.run, usize::MAX)?;
        self.loads.restore(&saved.loads)?;
        if let Some(light) = &mut self.light {
            light.redraw.found_for.clone_from(&saved.light);
        }
        self.temperatures.fill(None);
        for (slot, kelvin) in &saved.temperatures {
            if let Some(own) = self.temperatures.get_mut(*slot) {
                *own = Some(*kelvin);
            }
        }
        self.waits = saved.waits;
        self.failed.clone_from(&saved.failed);
        Ok(())
    }

    /// Takes the temperatures after a call, or why it failed.
    pub(crate) fn after(&mut self, done: Result<(), EngineError>) {
        match done {
            Ok(()) => self.take_temperatures(),
            Err(error) => self.failed = Some(error.to_string()),
        }
    }

    /// Takes the temperatures of the network.
    pub(crate) fn take_temperatures(&mut self) {
        let known = &mut self.temperatures;
        self.run.scene().scatter(&self.run.temperatures(), |slot, temperature| known[slot] = Some(temperature));
    }
}

/// Joints of some nodes. Empty where nothing moves.
pub(super) fn joints(prepared: &Prepared, slots: &[usize]) -> Vec<u32> {
    match prepared.joints() {
        1 => Vec::new(),
        _ => prepared.joints_of(slots.iter().copied()),
    }
}
