//! Builds a scene's thermal network from its mesh, contacts and heaters.

use std::sync::Mutex;

use wildmatch::WildMatch;

use super::{Heated, SceneNetwork};
use crate::model::Model;
use crate::model::nodes::{Nodes, PADDING};
use crate::scene::{CONTACT_DISTANCE, ContactRule, LISTED_DISTANCE, NEIGHBOUR_CONDUCTANCE, NeighbourContacts, Scene};
use crate::simulation::prepare_error::PrepareError;
use crate::thermal::material::{Material, Response};
use crate::thermal::network::control::{IntegrationSettings, ONE_PASS_TOLERANCE};
use crate::thermal::network::one_pass::OnePassPlan;
use crate::thermal::network::schedule::Thermostat;
use crate::thermal::shell::{Contact, NO_NODE, NeighbourRule, Selection, Shell, ShellMaterial, ShellSurface};

/// The shell of a scene's network, where it has one. `joints` is the joint of each part.
pub(in crate::simulation) fn shell(
    scene: &Scene,
    model: &Model,
    parts: &[String],
    materials: &[Material],
    joints: &[u32],
) -> Result<Option<Shell>, PrepareError> {
    let of = |material: &Material| match material.response {
        Response::Network => ShellMaterial::of(material).map(Some),
        Response::Instant | Response::Transition(_) | Response::Radiative(_) | Response::Given => Ok(None),
    };
    let wrong = |error| PrepareError::network(scene, error);
    let shells = materials.iter().map(of).collect::<Result<Vec<_>, _>>().map_err(wrong)?;
    if shells.iter().all(Option::is_none) {
        return Ok(None);
    }
    let surface = ShellSurface {
        positions: &model.positions,
        triangles: &model.triangles,
        parts: &model.vertex_part,
        materials: &model.vertex_material,
    };
    let contacts =
        scene.contacts.iter().map(|rule| contact(rule, scene, parts, materials)).collect::<Result<Vec<_>, _>>()?;
    let space = scene.environment.background_temperature.unwrap_or(0.0);
    let all: Vec<ShellMaterial> = materials
        .iter()
        .zip(&shells)
        .map(|(one, shell)| shell.unwrap_or_else(|| ShellMaterial::outside(one)))
        .collect();
    let stated = scene.network.neighbours;
    let (join, per_area, distance) = match stated {
        NeighbourContacts::Auto { per_area, distance } => (true, per_area, distance.unwrap_or(CONTACT_DISTANCE)),
        NeighbourContacts::Stated | NeighbourContacts::Unstated => (false, NEIGHBOUR_CONDUCTANCE, CONTACT_DISTANCE),
    };
    // Who says that only stated contacts count has no use for a list of what nearly touches.
    let listed_distance = if stated == NeighbourContacts::Stated { distance } else { LISTED_DISTANCE };
    let neighbours = NeighbourRule { distance, listed_distance, per_area, join, joints, all: &all };
    Shell::new(&surface, &shells, &contacts, Some(neighbours), scene.network.merge_rate, space).map(Some).map_err(wrong)
}

fn contact(
    rule: &ContactRule,
    scene: &Scene,
    parts: &[String],
    materials: &[Material],
) -> Result<Contact, PrepareError> {
    let name = format!("between '{}' and '{}'", rule.between[0].pattern(), rule.between[1].pattern());
    let select = |owners: &crate::scene::OwnerPatterns| {
        let by_part = matches!(owners, crate::scene::OwnerPatterns::Parts(_));
        let selection = Selection {
            name: owners.pattern().to_owned(),
            parts: parts.iter().map(|part| !by_part || owners.fits(part, "")).collect(),
            materials: materials.iter().map(|material| by_part || owners.fits("", &material.name)).collect(),
        };
        if selection.parts.contains(&true) && selection.materials.contains(&true) {
            return Ok(selection);
        }
        let kind = if by_part { "part" } else { "material" };
        Err(PrepareError::network(scene, format!("contact {name}: the model has no {kind} '{}'", owners.pattern())))
    };
    let [first, second] = &rule.between;
    Ok(Contact {
        between: [select(first)?, select(second)?],
        name,
        distance: rule.distance,
        conductance: rule.conductance,
    })
}

impl SceneNetwork {
    /// Connects a shell to the device nodes and to the heaters of the scene. `hottest` [K] is the temperature that no node of each
    /// material is expected to exceed.
    pub(in crate::simulation) fn new(
        shell: Shell,
        scene: &Scene,
        parts: &[String],
        nodes: &Nodes,
        probes: &[usize],
        hottest: &[f64],
    ) -> Result<Self, PrepareError> {
        let of_slot = |vertex: &u32| if *vertex == PADDING { NO_NODE } else { shell.node_of_vertex[*vertex as usize] };
        let area = |vertex: &u32| if *vertex == PADDING { 0.0 } else { shell.load_areas[*vertex as usize] };
        let node_of_slot = nodes.vertex_of_node.iter().map(of_slot).collect();
        let load_areas = nodes.vertex_of_node.iter().map(area).collect();
        let structure = |slot: usize| shell.structure_of_vertex[nodes.vertex_of_node[slot] as usize];
        let mut heated = Vec::new();
        for heater in &scene.heaters {
            let patterns: Vec<WildMatch> = heater.parts.iter().map(|pattern| WildMatch::new(pattern)).collect();
            let mut areas = std::collections::BTreeMap::new();
            for (slot, vertex) in nodes.vertex_of_node.iter().enumerate() {
                let part = &parts[nodes.group_part[slot / crate::model::nodes::GROUP] as usize];
                if *vertex != PADDING && structure(slot) != NO_NODE && patterns.iter().any(|p| p.matches(part)) {
                    *areas.entry(structure(slot)).or_insert(0.0) += shell.load_areas[*vertex as usize];
                }
            }
            let whole: f64 = areas.values().sum();
            if whole <= 0.0 {
                let message = format!("heater.part: no part '{}' is in the network", heater.parts.join("', '"));
                return Err(PrepareError::network(scene, message));
            }
            let shares: Vec<(u32, f64)> = areas.into_iter().map(|(node, area)| (node, area / whole)).collect();
            let thermostat = match &heater.thermostat {
                None => None,
                Some(thermostat) => {
                    let sensor = structure(probes[thermostat.probe]);
                    if sensor == NO_NODE {
                        let name = &scene.probes[thermostat.probe].name;
                        let message = format!("heater: the probe '{name}' lies on a part that is not in the network");
                        return Err(PrepareError::network(scene, message));
                    }
                    Some(Thermostat {
                        node: shares[0].0,
                        sensor,
                        power: heater.power.after(0.0).0,
                        on_below: thermostat.on_below,
                        off_above: thermostat.off_above,
                        initially_on: thermostat.initially_on,
                    })
                }
            };
            let probe = heater.thermostat.as_ref().map(|thermostat| &scene.probes[thermostat.probe].name);
            let sensed = probe.map_or(String::new(), |probe| format!(", sensed at probe '{probe}',"));
            let name = format!("heater of '{}'{sensed}", heater.parts.join("', '"));
            heated.push(Heated { name, shares, power: heater.power.clone(), thermostat });
        }
        if let Some(node) = shell.network.unbalanced_node() {
            let message = format!("node {node} of the network stores no heat and has no path to a sink");
            return Err(PrepareError::network(scene, message));
        }
        let mut hottest_of_node = vec![hottest.iter().copied().fold(0.0, f64::max); shell.network.len()];
        for (slot, vertex) in nodes.real() {
            let node = shell.node_of_vertex[vertex as usize];
            if node != NO_NODE {
                hottest_of_node[node as usize] =
                    hottest[nodes.group_material[slot / crate::model::nodes::GROUP] as usize];
            }
        }
        let integrator = scene.network.integrator;
        let heaters: Vec<_> = heated.iter().map(Heated::in_one_pass).collect();
        let one_pass = integrator
            .takes_one_pass()
            .then(|| OnePassPlan::fitting_heaters(&shell.network, scene.time.step, &hottest_of_node, &heaters));
        let usual = if matches!(one_pass, Some(Ok(_))) { ONE_PASS_TOLERANCE } else { integrator.tolerance() };
        let settings = IntegrationSettings { integrator, tolerance: scene.network.tolerance.unwrap_or(usual) };
        let (step, horizon) = (scene.time.step, scene.orbit.period());
        let set_powers = Mutex::default();
        Ok(Self { shell, settings, node_of_slot, load_areas, heated, set_powers, one_pass, step, horizon })
    }
}
