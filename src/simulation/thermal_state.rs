//! The thermal state of a craft in a file of its own, from which another run of the same craft begins.
//!
//! The file holds the state of `state.rs` without the values that belong to one run only: measured times, counts of work, and triangles culled for one
//! camera.

use super::check::{Check, CheckState};
use super::engine::{Engine, EngineError};
use super::prepare::Prepared;
use super::state::BetweenSteps;
use super::uncertainty::UncertaintyState;
use crate::scene::file_hash;
use crate::thermal::material::{Material, Response};

/// A thermal state, of which craft it is, and where it was taken.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct ThermalState {
    craft: CraftIdentity,
    /// The scene file.
    scene: String,
    /// Time of the state [s].
    pub(crate) time: f64,
    pub(crate) state: BetweenSteps,
    /// The errors of the temperatures, where the scene asks for them.
    pub(crate) errors: Option<UncertaintyState>,
}

/// The properties of a prepared scene on which its state depends.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct CraftIdentity {
    /// SHA-256 of the glTF file.
    model: String,
    /// SHA-256 of the nodes in device order: positions, normals, parts, materials.
    nodes: String,
    /// Name of each material, and SHA-256 of its values.
    materials: Vec<(String, String)>,
    /// Settings of the thermal network. Empty without one.
    network: String,
    shadows: String,
    /// SHA-256 of the nodes of each patch of radiation between surfaces. Empty without it.
    patches: String,
    /// Length of a step [s], where a transition counts in steps.
    step: Option<f64>,
    /// A device and the reference keep the state of a node in different numbers.
    on_device: bool,
}

impl CraftIdentity {
    fn new(prepared: &Prepared, on_device: bool) -> Self {
        let (scene, nodes) = (&prepared.scene, &prepared.nodes);
        let bytes = [
            bytemuck::cast_slice::<_, u8>(&nodes.vertex_of_node),
            bytemuck::cast_slice(&nodes.group_material),
            bytemuck::cast_slice(&nodes.group_part),
            bytemuck::cast_slice(&nodes.positions),
            bytemuck::cast_slice(&nodes.normals),
        ];
        let materials = prepared.materials.iter().map(|Material { name, front, sides, bulk, response, .. }| {
            let values = format!("{front:?} {sides:?} {bulk:?} {response:?}");
            (name.clone(), file_hash(values.as_bytes()))
        });
        let network = || format!("{:?} {:?} {:?}", scene.network, scene.contacts, scene.heaters);
        let moves = prepared.materials.iter().any(|material| matches!(material.response, Response::Transition(_)));
        Self {
            model: prepared.hashes.of_file(&scene.model_path),
            nodes: file_hash(&bytes.concat()),
            materials: materials.collect(),
            network: prepared.network.as_ref().map(|_| file_hash(network().as_bytes())).unwrap_or_default(),
            shadows: format!("{:?}", scene.shadows),
            patches: prepared
                .exchange
                .as_ref()
                .map(|craft| file_hash(bytemuck::cast_slice(&craft.patches.of_node)))
                .unwrap_or_default(),
            step: moves.then_some(scene.time.step),
            on_device,
        }
    }
}

impl ThermalState {
    /// The present state, which belongs to a time [s].
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn take(
        prepared: &Prepared,
        engine: &mut dyn Engine,
        check: Option<&mut Check>,
        time: f64,
    ) -> Result<Self, EngineError> {
        let craft = CraftIdentity::new(prepared, engine.pass_times().is_some());
        let mut state = BetweenSteps::capture(0, engine, check)?;
        state.engine.forget_run();
        state.check.iter_mut().for_each(CheckState::forget_run);
        Ok(Self { craft, scene: prepared.scene.source.display().to_string(), time, state, errors: None })
    }

    /// The same with the errors of its temperatures.
    pub(crate) fn with_errors(self, errors: Option<UncertaintyState>) -> Self {
        Self { errors: errors.map(UncertaintyState::without_pixels), ..self }
    }

    /// Where the state was taken, in words.
    pub(crate) fn origin(&self) -> String {
        format!("{} s of {}", self.time, self.scene)
    }

    /// The differences between the craft of the state and the craft of a scene, in words. Empty where the state fits.
    pub(crate) fn differences(&self, prepared: &Prepared, on_device: bool) -> Vec<String> {
        let (then, now) = (&self.craft, CraftIdentity::new(prepared, on_device));
        let mut found = Vec::new();
        if then.model != now.model {
            found.push(format!("the model {} is another file", prepared.scene.model_path.display()));
        }
        for (name, hash) in &now.materials {
            match then.materials.iter().find(|(known, _)| known == name) {
                None => found.push(format!("the material '{name}' is new")),
                Some((_, known)) if known != hash => found.push(format!("the material '{name}' has other values")),
                Some(_) => {}
            }
        }
        let is_gone = |name: &String| !now.materials.iter().any(|(known, _)| known == name);
        let gone = then.materials.iter().filter(|(name, _)| is_gone(name));
        found.extend(gone.map(|(name, _)| format!("the material '{name}' is gone")));
        for (is_same, difference) in [
            (
                then.nodes == now.nodes,
                "the order of the nodes is another (model.max_edge, [[part]], [[joint]] or the response of a material)",
            ),
            (then.network == now.network, "the thermal network is another ([network], [[contact]], [[heater]])"),
            (then.shadows == now.shadows, "[shadows] is another"),
            (
                now.patches.is_empty() || then.patches.is_empty() || then.patches == now.patches,
                "the patches of [exchange] are others (its patch_edge, or the ends of the way of a joint)",
            ),
        ] {
            if !is_same {
                found.push(difference.to_owned());
            }
        }
        if let (Some(then), Some(now)) = (then.step, now.step)
            && then != now
        {
            found.push(format!("time.step was {then} s and is {now} s; transitions count in steps"));
        }
        if then.on_device != now.on_device {
            let name = |device: bool| if device { "a device" } else { "the f64 reference (--device cpu)" };
            let (then, now) = (name(then.on_device), name(now.on_device));
            found.push(format!("it was taken on {then}, and this runs on {now}"));
        }
        found
    }

    /// Brings the engine to the state. Returns whether the check has taken it too: its sample must be the sample of the run that saved it.
    ///
    /// # Errors
    /// A call that fails, or a state of another craft.
    pub(crate) fn begin(&self, engine: &mut dyn Engine, check: Option<&mut Check>) -> Result<bool, EngineError> {
        self.state.restore(engine, None)?;
        let (Some(check), Some(state)) = (check, &self.state.check) else { return Ok(false) };
        if check.restore(state).is_err() {
            return Ok(false);
        }
        check.begin_halves(engine)?;
        Ok(true)
    }
}
