//! A sample of nodes by themselves in steps and in half steps, where the check can not step all that they exchange heat with.
//!
//! Each node has its load from Sun and planet and its own heat capacity, without conduction and without the light of other surfaces. Both runs begin at the
//! temperatures of the engine. What they leave out is nearly the same in both, so their difference is nearly the difference of the whole craft.

use super::differences::{Differences, ERROR_OF_DIFFERENCE};
use super::network::joints;
use crate::environment::StepLoad;
use crate::environment::shadow::{LightAndPoses, LitAreas};
use crate::environment::step::StepLoads;
use crate::model::nodes::GROUP;
use crate::simulation::engine::EngineError;
use crate::simulation::prepare::Prepared;
use crate::simulation::prepare_steps::hottest;
use crate::thermal::incident::{IncidentFunction, incident};
use crate::thermal::material::{Material, Radiative, Response};
use crate::thermal::reference::{Reference, ReferenceState};

/// Nodes by themselves, in steps and in half steps.
pub(super) struct LoneNodes {
    loads: StepLoads,
    slots: Vec<usize>,
    /// Area of each node [m2].
    areas: Vec<f64>,
    light: Option<LitAreas>,
    whole: Reference<IncidentFunction>,
    half: Reference<IncidentFunction>,
    pub(crate) errors: Differences,
}

/// Their saved state.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct LoneNodesState {
    light: Option<LightAndPoses>,
    whole: ReferenceState,
    half: ReferenceState,
    pub(super) errors: Differences,
}

impl LoneNodes {
    /// At most `sample` of the nodes that store heat and that are `meant`, evenly spread.
    pub(crate) fn new(prepared: &Prepared, sample: usize, meant: impl Fn(usize) -> bool) -> Self {
        let nodes = &prepared.nodes;
        let hottest = hottest(&prepared.scene, &prepared.materials).into_iter();
        let step = prepared.scene.time.step;
        let materials: Vec<Material> = prepared
            .materials
            .iter()
            .zip(hottest)
            .map(|(material, hottest)| by_itself(material, step, hottest))
            .collect();
        let stores =
            |slot: &usize| meant(*slot) && materials[nodes.group_material[slot / GROUP] as usize].response.has_memory();
        let all: Vec<usize> = nodes.real().map(|(slot, _)| slot).filter(stores).collect();
        let count = all.len().min(sample);
        let slots: Vec<usize> = (0..count).map(|place| all[place * all.len() / count]).collect();
        let own = slots.iter().map(|slot| nodes.reference_node(*slot)).collect();
        let whole = Reference::new(own, materials, incident as IncidentFunction).with_joints(joints(prepared, &slots));
        Self {
            loads: prepared.loads.clone(),
            areas: slots.iter().map(|slot| nodes.areas[*slot]).collect(),
            light: prepared.lit_areas(slots.iter().copied()),
            half: whole.clone(),
            whole,
            slots,
            errors: Differences::default(),
        }
    }

    /// Number of nodes.
    pub(crate) fn len(&self) -> usize {
        self.slots.len()
    }

    /// Begins at the temperatures of all nodes [K], in device order.
    pub(crate) fn begin(&mut self, temperatures: &[f32]) {
        self.whole.settle_at(0.0);
        for (node, slot) in self.slots.iter().enumerate() {
            let temperature = f64::from(temperatures.get(*slot).copied().unwrap_or_default());
            self.whole.set_temperature(node, temperature);
        }
        let below: Vec<usize> =
            self.whole.structures().enumerate().filter_map(|(node, own)| own.map(|_| node)).collect();
        for node in below {
            self.whole.set_structure(node, self.whole.temperatures()[node]);
        }
        self.half = self.whole.clone();
    }

    /// Advances by `steps` steps from `start` [s] for `length` [s], whole and in two halves, and compares.
    pub(crate) fn step(&mut self, load: &StepLoad, steps: f64, [start, length]: [f64; 2]) {
        if self.slots.is_empty() {
            return;
        }
        self.whole.find_light(&mut self.light, load);
        self.half.light(self.whole.lit().clone());
        self.whole.step(load, steps);
        let half = 0.5 * length;
        for from in [start, start + half] {
            self.half.step(&self.loads.step_load(from, from + half), 0.5 * steps);
        }
        let pairs = self.whole.temperatures().iter().zip(self.half.temperatures());
        for ((slot, area), (whole, half)) in self.slots.iter().zip(&self.areas).zip(pairs) {
            let error = ERROR_OF_DIFFERENCE * (whole - half).abs();
            self.errors.add(error, steps * area, (*slot, 0, start + length));
        }
    }

    pub(crate) fn save(&self) -> LoneNodesState {
        LoneNodesState {
            light: self.light.as_ref().and_then(|light| light.redraw.found_for.clone()),
            whole: self.whole.save(),
            half: self.half.save(),
            errors: self.errors,
        }
    }

    /// Restores a saved state.
    ///
    /// # Errors
    /// A state of another scene or sample.
    pub(crate) fn restore(&mut self, saved: &LoneNodesState) -> Result<(), EngineError> {
        if let Some(light) = &mut self.light {
            light.redraw.found_for.clone_from(&saved.light);
        }
        self.whole.restore(&saved.whole)?;
        self.half.restore(&saved.half)?;
        self.errors = saved.errors;
        Ok(())
    }
}

/// A material whose nodes are plates by themselves where they belong to a network.
fn by_itself(material: &Material, step: f64, hottest: f64) -> Material {
    let mut own = material.clone();
    if matches!(own.response, Response::Network)
        && let Ok(plate) = Radiative::of(&own.bulk, step)
    {
        own.response = Response::Radiative(Radiative { hottest, ..plate });
    }
    own
}
