//! The f64 reference simulator for all nodes or a sample of them, slow and simple.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use crate::environment::StepLoad;
use crate::environment::shadow::{Lit, LitAreas};
use crate::thermal::balance::{Incident, absorbed_flux, balance_temperature, emissivity_sum};
use crate::thermal::budget::SurfaceGains;
use crate::thermal::material::{Material, Response};
use crate::thermal::misfit::{Misfit, check_length};
use crate::thermal::radiative::{PlateLoad, PlateState, radiative_step};
use crate::thermal::received::FaceLoad;
use crate::thermal::transition::{TransitionState, transition_step};
use crate::trace::span;

/// Incident fluxes on a plate with a unit normal (body frame) during a step.
pub trait IncidentFlux: Sync {
    /// Mean fluxes over the step [W/m2].
    fn incident(&self, load: &StepLoad, normal: DVec3) -> Incident;
}

impl<F: Fn(&StepLoad, DVec3) -> Incident + Sync> IncidentFlux for F {
    fn incident(&self, load: &StepLoad, normal: DVec3) -> Incident {
        self(load, normal)
    }
}

/// A node of the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceNode {
    /// Unit outward normal, body frame.
    pub normal: DVec3,
    /// Index into the materials.
    pub material: u32,
}

/// The saved state of the nodes.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct ReferenceState {
    states: Vec<TransitionState>,
    temperatures: Vec<f64>,
    lit: Lit,
    received: Vec<[FaceLoad; 2]>,
}

/// State and temperature of the nodes. Nodes are independent, so the result does not depend on the number of threads.
#[derive(Debug, Clone)]
pub struct Reference<F> {
    nodes: Vec<ReferenceNode>,
    joints: Vec<u32>,
    materials: Vec<Material>,
    incident: F,
    /// Lit area of each node.
    lit: Lit,
    /// Light from the craft on the faces of each node. Empty where surfaces do not see each other.
    received: Vec<[FaceLoad; 2]>,
    states: Vec<TransitionState>,
    temperatures: Vec<f64>,
}

impl<F: IncidentFlux> Reference<F> {
    /// Nodes at 0 K. Call `settle` or `settle_at` to start them.
    pub fn new(nodes: Vec<ReferenceNode>, materials: Vec<Material>, incident: F) -> Self {
        let states = vec![TransitionState { target: 0.0, span: 0.0, elapsed: 0.0 }; nodes.len()];
        let temperatures = vec![0.0; nodes.len()];
        let (joints, received, lit) = (Vec::new(), Vec::new(), Lit::default());
        Self { nodes, joints, materials, incident, lit, received, states, temperatures }
    }

    /// The nodes with the joint of each (0 is the body). Normals are in the file's pose.
    pub(crate) fn with_joints(self, joints: Vec<u32>) -> Self {
        Self { joints, ..self }
    }

    fn pose<'a>(&self, node: usize, load: &'a StepLoad) -> Option<&'a DAffine3> {
        self.joints.get(node).and_then(|joint| load.joints.get(*joint as usize))
    }

    fn turned(&self, node: usize, load: &StepLoad) -> ReferenceNode {
        let state = self.nodes[node];
        match self.pose(node, load) {
            Some(pose) => ReferenceNode { normal: pose.matrix3 * state.normal, ..state },
            None => state,
        }
    }

    /// Sets the lit area of each node. At the start normals tell the light.
    pub(crate) fn light(&mut self, lit: Lit) {
        self.lit = lit;
    }

    /// Sets the light from the craft on the front and back of each node until the next call.
    pub(crate) fn receive(&mut self, received: Vec<[FaceLoad; 2]>) {
        self.received = received;
    }

    /// Light from the craft on the faces of each node. Empty where surfaces do not see each other.
    pub(crate) fn received(&self) -> &[[FaceLoad; 2]] {
        &self.received
    }

    pub(crate) fn lit(&self) -> &Lit {
        &self.lit
    }

    /// Finds the light of a load where the last one no longer holds.
    pub(crate) fn find_light(&mut self, light: &mut Option<LitAreas>, load: &StepLoad) {
        let Some(light) = light else { return };
        if let Some(areas) = light.find(load) {
            self.light(Lit { areas, by_rays: light.by_rays() });
        }
    }

    /// Settles every node at the balance temperature of a load.
    pub fn settle(&mut self, load: &StepLoad) {
        self.each_node(|all, node, material, _| {
            let t = all.commanded(node, material, load);
            (settled(t, material), t)
        });
    }

    /// Settles every node at a temperature [K].
    pub fn settle_at(&mut self, temperature: f64) {
        self.each_node(|_, _, material, _| (settled(temperature, material), temperature));
    }

    /// Advances by `steps_dt` steps with the balance temperature of the mean load as the target.
    pub fn step(&mut self, load: &StepLoad, steps_dt: f64) {
        self.each_node(|all, node, material, state| {
            let commanded = || all.commanded(node, material, load);
            match &material.response {
                Response::Instant => {
                    let temperature = commanded();
                    (settled(temperature, material), temperature)
                }
                Response::Transition(transition) => transition_step(state, commanded(), steps_dt, transition),
                Response::Radiative(plate) => {
                    let absorbed = all.absorbed_by(node, material, load);
                    let (emissivity, background) = (emissivity_sum(material), load.background_temperature);
                    let load = PlateLoad { absorbed, emissivity, background };
                    let state = radiative_step(plate_of(state), load, steps_dt, plate);
                    (kept(state), state.outside)
                }
                // The temperature comes from the network, or from a file.
                Response::Network | Response::Given => (state, state.target),
            }
        });
    }

    fn commanded(&self, node: usize, material: &Material, load: &StepLoad) -> f64 {
        balance_temperature(
            self.absorbed_by(node, material, load),
            emissivity_sum(material),
            load.background_temperature,
        )
    }

    /// Flux that a node absorbs in a step [W/m2].
    fn absorbed_by(&self, node: usize, material: &Material, load: &StepLoad) -> f64 {
        let [front, back] = self.received_by(node);
        let on_front = self.on_face(node, 0, load);
        absorbed_flux(material, on_front, || self.on_face(node, 1, load)) + front.absorbed + back.absorbed
    }

    /// Light from the craft on the front and back of a node.
    fn received_by(&self, node: usize) -> [FaceLoad; 2] {
        self.received.get(node).copied().unwrap_or([FaceLoad::NOTHING; 2])
    }

    /// Light of Sun and planet on the front (0) or back (1) of a node.
    fn on_face(&self, node: usize, face: usize, load: &StepLoad) -> Incident {
        let normal = self.turned(node, load).normal;
        let by_normal = self.incident.incident(load, if face == 0 { normal } else { -normal });
        let lit = self.lit.areas.get(node).map(|lit| lit.flux(load, self.pose(node, load))[face]);
        let whole = Incident { solar: lit.unwrap_or(by_normal.solar), ..by_normal };
        let open = self.received_by(node)[face].through(whole);
        // Rays tell what lies inside other parts.
        if self.lit.by_rays { Incident { solar: whole.solar, ..open } } else { open }
    }

    /// Light of Sun and planet on the front and back of every node, with the normal of its front in the body frame.
    pub(crate) fn on_faces(&self, load: &StepLoad) -> Vec<([Incident; 2], DVec3)> {
        let on_faces =
            |node: usize| ([0, 1].map(|face| self.on_face(node, face, load)), self.turned(node, load).normal);
        (0..self.nodes.len()).into_par_iter().map(on_faces).collect()
    }

    /// The light that every node absorbs [W/m2], by its cause.
    pub(crate) fn gains(&self, load: &StepLoad) -> Vec<SurfaceGains> {
        let gains = |node: usize| {
            let material = &self.materials[self.nodes[node].material as usize];
            let on_faces = [0, 1].map(|face| self.on_face(node, face, load));
            SurfaceGains::absorbed(material, on_faces, self.received_by(node))
        };
        (0..self.nodes.len()).into_par_iter().map(gains).collect()
    }

    /// Temperatures of the structures below plates [K], in the order of the nodes. `None` for a node without a structure.
    pub fn structures(&self) -> impl Iterator<Item = Option<f64>> {
        let has = |node: &ReferenceNode| self.materials[node.material as usize].has_own_structure();
        self.nodes.iter().zip(&self.states).map(move |(node, state)| has(node).then_some(plate_of(*state).structure))
    }

    /// Replaces the temperature of the structure below a plate [K].
    pub(crate) fn set_structure(&mut self, node: usize, temperature: f64) {
        self.states[node] = kept(PlateState { structure: temperature, trend: 0.0, ..plate_of(self.states[node]) });
    }

    /// Temperatures [K] in the order of the nodes.
    pub fn temperatures(&self) -> &[f64] {
        &self.temperatures
    }

    /// Flux that nodes of a thermal network absorb [W/m2]. 0 for other nodes.
    pub(crate) fn absorbed(&self, load: &StepLoad) -> Vec<f64> {
        let absorbed = |node: usize| {
            let material = &self.materials[self.nodes[node].material as usize];
            self.absorbed_by(node, material, load)
        };
        (0..self.nodes.len()).into_par_iter().map(absorbed).collect()
    }

    pub(crate) fn set_temperature(&mut self, node: usize, temperature: f64) {
        self.temperatures[node] = temperature;
        self.states[node].target = temperature;
    }

    pub(crate) fn save(&self) -> ReferenceState {
        let Self { states, temperatures, lit, received, .. } = self;
        ReferenceState {
            states: states.clone(),
            temperatures: temperatures.clone(),
            lit: lit.clone(),
            received: received.clone(),
        }
    }

    /// Takes a saved state.
    ///
    /// # Errors
    /// Another number of nodes.
    pub(crate) fn restore(&mut self, saved: &ReferenceState) -> Result<(), Misfit> {
        check_length("states of nodes", &saved.states, self.nodes.len())?;
        check_length("temperatures of nodes", &saved.temperatures, self.nodes.len())?;
        if !saved.lit.areas.is_empty() {
            check_length("lit areas of nodes", &saved.lit.areas, self.nodes.len())?;
        }
        if !saved.received.is_empty() {
            check_length("light of the craft on nodes", &saved.received, self.nodes.len())?;
        }
        self.states.clone_from(&saved.states);
        self.temperatures.clone_from(&saved.temperatures);
        self.lit.clone_from(&saved.lit);
        self.received.clone_from(&saved.received);
        Ok(())
    }

    /// The nodes.
    pub fn nodes(&self) -> &[ReferenceNode] {
        &self.nodes
    }

    /// Replaces the state and temperature of every node. The function receives its number, material and state.
    fn each_node<U>(&mut self, update: U)
    where
        U: Fn(&Self, usize, &Material, TransitionState) -> (TransitionState, f64) + Sync,
    {
        let _steps = span("stepping nodes in f64");
        let (mut states, mut temperatures) = (std::mem::take(&mut self.states), std::mem::take(&mut self.temperatures));
        let all = &*self;
        let moved = states.par_iter_mut().zip(&mut temperatures).enumerate();
        moved.for_each(|(node, (state, temperature))| {
            let material = &all.materials[all.nodes[node].material as usize];
            (*state, *temperature) = update(all, node, material, *state);
        });
        (self.states, self.temperatures) = (states, temperatures);
    }
}

/// Target of a step [K]: the balance temperature of its mean load.
pub fn commanded_temperature(
    incident: &impl IncidentFlux,
    node: &ReferenceNode,
    material: &Material,
    load: &StepLoad,
) -> f64 {
    let front = incident.incident(load, node.normal);
    let absorbed = absorbed_flux(material, front, || incident.incident(load, -node.normal));
    balance_temperature(absorbed, emissivity_sum(material), load.background_temperature)
}

/// The state of a node at rest. An instant node stores only its target.
fn settled(temperature: f64, material: &Material) -> TransitionState {
    match &material.response {
        Response::Instant | Response::Network | Response::Given => {
            TransitionState { target: temperature, span: 0.0, elapsed: 0.0 }
        }
        Response::Transition(transition) => TransitionState::settled(temperature, transition),
        Response::Radiative(_) => kept(PlateState::settled(temperature)),
    }
}

/// The three numbers of a plate, in the places of a transition's numbers.
fn kept(state: PlateState) -> TransitionState {
    TransitionState { target: state.outside, span: state.structure, elapsed: state.trend }
}

fn plate_of(state: TransitionState) -> PlateState {
    PlateState { outside: state.target, structure: state.span, trend: state.elapsed }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::SunSample;
    use crate::thermal::STEFAN_BOLTZMANN;
    use crate::thermal::material::{Bulk, Domain, Function, Optics, Profile, Retarget, Sides, Transition};

    fn sun_only(load: &StepLoad, normal: DVec3) -> Incident {
        let solar = load.sun.iter().map(|sun| sun.flux * normal.dot(sun.direction).max(0.0)).sum();
        Incident { solar, ..Incident::default() }
    }

    fn load(flux: f64) -> StepLoad {
        let sun = vec![SunSample { direction: DVec3::X, flux }];
        StepLoad { start: 0.0, sun, planet: None, albedo: None, background_temperature: 2.7, joints: Vec::new() }
    }

    fn materials() -> Vec<Material> {
        let optics = Optics { absorptivity: 0.9, emissivity: 0.8 };
        let profile = Profile { function: Function::Quadratic, t_max_steps: 100.0 };
        let slow = Response::Transition(Transition {
            heating: profile.clone(),
            cooling: profile,
            retarget: Retarget::Merge,
            domain: Domain::Temperature,
        });
        let make = |sides, response| Material {
            gloss: Default::default(),
            in_band: Default::default(),
            name: "test".into(),
            front: optics,
            sides,
            bulk: Bulk::default(),
            response,
            transition: None,
            ranges: [None; 2],
            source: "test".into(),
        };
        vec![
            make(Sides::Outside, Response::Instant),
            make(Sides::Outside, slow),
            make(Sides::Both { back: optics }, Response::Instant),
        ]
    }

    fn reference() -> Reference<impl IncidentFlux> {
        let node = |normal, material| ReferenceNode { normal, material };
        let nodes =
            vec![node(DVec3::X, 0), node(DVec3::X, 1), node(-DVec3::X, 0), node(-DVec3::X, 2), node(DVec3::X, 2)];
        Reference::new(nodes, materials(), sun_only)
    }

    #[test]
    fn instant_follows_and_transition_lags() {
        let balance =
            |flux: f64, faces: f64| (0.9 * flux / (faces * 0.8 * STEFAN_BOLTZMANN) + 2.7_f64.powi(4)).powf(0.25);
        let mut reference = reference();
        reference.settle(&load(0.0));
        assert!(reference.temperatures().iter().all(|t| (t - 2.7).abs() < 1e-12));
        for _ in 0..50 {
            reference.step(&load(1361.0), 1.0);
        }
        let t = reference.temperatures();
        let (hot, sheet) = (balance(1361.0, 1.0), balance(1361.0, 2.0));
        assert!((t[0] - hot).abs() < 1e-9);
        assert!((t[1] - (hot - 0.25 * (hot - 2.7))).abs() < 1e-9, "half the time of a quadratic: a quarter is left");
        assert!((t[2] - 2.7).abs() < 1e-12, "the night face of a skin");
        assert!((t[3] - sheet).abs() < 1e-9 && (t[4] - sheet).abs() < 1e-9, "a sheet is lit from either side");
        assert!(hot - sheet > 60.0);
    }

    #[test]
    fn settles_where_it_is_told_and_runs_alike_twice() {
        let run = || {
            let mut reference = reference();
            reference.settle_at(300.0);
            assert!(reference.temperatures().iter().all(|&t| t == 300.0));
            for step in 0..30 {
                reference.step(&load(1361.0 * f64::from(step % 7)), 1.0);
            }
            reference.temperatures().to_vec()
        };
        assert_eq!(run(), run());
    }
}
