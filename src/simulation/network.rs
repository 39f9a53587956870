//! The thermal network of a scene: its heat input, and the map between drawn nodes and network nodes.
//!
//! The device computes the mean flux of a step. The host gathers it to network nodes, a stepper integrates them, and the temperatures are written back. The
//! work on the host costs two transfers of all temperatures in each step, and two frames no longer overlap. On lavapipe this is a small share of the
//! stages.

mod build;
mod change_over;
mod description;
mod failure;
mod gains;
mod given;
mod left;
mod run;
mod saved;
mod steady;

pub(super) use build::shell;
pub(crate) use description::{BEYOND, ESTIMATED};
pub(crate) use failure::unfinished;
pub(crate) use run::NetworkRun;
pub use run::StepCost;
pub(crate) use saved::NetworkRunState;

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

use crate::gpu::effects::network::order::DrawnNodes;
use crate::gpu::effects::network::tables::OnePassTables;
use crate::model::nodes::{GROUP, Nodes};
use crate::thermal::material::{Material, Response};
use crate::thermal::network::connection::root;
use crate::thermal::network::control::IntegrationSettings;
use crate::thermal::network::one_pass::{Conduction, OnePassHeater, OnePassPlan, Unfit};
use crate::thermal::network::schedule::{HeatTable, Schedule, Thermostat};
use crate::thermal::network::{Network, NodeKind};
use crate::thermal::shell::{ApartBy, NO_NODE, Shell};

/// Remark for readers of a network's temperatures without `[exchange]`.
pub(crate) const HOLLOW: &str = "A thermal network exchanges heat with space, Sun and planet on the outside of bodies only: \
                          radiation inside hollow bodies and between surfaces is off.";
/// The same remark with `[exchange]`.
pub(crate) const HOLLOW_WITH_EXCHANGE: &str = "Nothing radiates inside hollow bodies.";

#[derive(Debug, Clone)]
struct Heated {
    /// The heated nodes and the sensor, in words.
    name: String,
    /// Heated nodes with their shares.
    shares: Vec<(u32, f64)>,
    /// Heat over scene time.
    power: HeatTable,
    /// Thermostat of the heater, where it has one.
    thermostat: Option<Thermostat>,
}

impl Heated {
    fn in_one_pass(&self) -> OnePassHeater {
        OnePassHeater { shares: self.shares.clone(), thermostat: self.thermostat.clone() }
    }
}

/// The network of a scene.
#[derive(Debug)]
pub struct SceneNetwork {
    /// The shell that was made from the mesh.
    pub shell: Shell,
    /// Settings of the integration.
    pub settings: IntegrationSettings,
    /// Network node of every device node, or `NO_NODE`.
    node_of_slot: Vec<u32>,
    /// Area over which a device node heats its network node [m2].
    load_areas: Vec<f64>,
    heated: Vec<Heated>,
    /// Powers of heaters that something outside has set [W]. Prepared scene and engine share them.
    set_powers: Mutex<Vec<Option<f64>>>,
    /// The network in one pass, or why it is not stepped so. `None` where the scene asks for sub-steps.
    one_pass: Option<Result<Arc<OnePassPlan>, Unfit>>,
    /// Length of a step of the scene [s].
    step: f64,
    /// Time over which errors accumulate [s].
    horizon: f64,
}

/// Area on which the light of a device node falls [m2].
pub(super) fn light_area(network: Option<&SceneNetwork>, nodes: &Nodes, slot: usize) -> f64 {
    network.and_then(|network| network.load_area(slot)).unwrap_or(nodes.areas[slot])
}

impl SceneNetwork {
    /// The network.
    pub fn network(&self) -> &Network {
        &self.shell.network
    }

    /// Whether a node of the device belongs to the network.
    pub(crate) fn has(&self, slot: usize) -> bool {
        self.node_of_slot[slot] != NO_NODE
    }

    /// Network node of a node of the device that belongs to the network.
    pub(super) fn node_of(&self, slot: usize) -> usize {
        self.node_of_slot[slot] as usize
    }

    /// Whether a node of the device belongs to the network and stores heat there.
    pub(crate) fn stores_heat(&self, slot: usize) -> bool {
        self.has(slot) && self.network().kinds[self.node_of_slot[slot] as usize] == NodeKind::Diffusive
    }

    pub(crate) fn nodes_of(&self, kind: NodeKind) -> usize {
        self.network().kinds.iter().filter(|one| **one == kind).count()
    }

    /// Heat of every network node [W] from the flux that device nodes absorb [W/m2].
    pub(crate) fn heat(&self, absorbed: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut heat = vec![0.0; self.network().len()];
        for (slot, (node, area)) in self.node_of_slot.iter().zip(&self.load_areas).enumerate() {
            if *node != NO_NODE {
                heat[*node as usize] += area * absorbed(slot);
            }
        }
        heat
    }

    /// Area over which a device node heats its network node [m2]. `None` where it belongs to no network.
    pub(super) fn load_area(&self, slot: usize) -> Option<f64> {
        self.has(slot).then(|| self.load_areas[slot])
    }

    /// Part of every network node. `nodes` are in device order.
    pub(super) fn parts(&self, nodes: &Nodes) -> Vec<u32> {
        let mut parts = vec![0; self.network().len()];
        for (slot, vertex) in nodes.real() {
            let part = nodes.group_part[slot / GROUP];
            for of_vertex in [&self.shell.node_of_vertex, &self.shell.structure_of_vertex] {
                // A vertex outside the network has no node.
                if let Some(own) = parts.get_mut(of_vertex[vertex as usize] as usize) {
                    *own = part;
                }
            }
        }
        parts
    }

    /// For each of `count` parts, the lowest of the parts that conductors join to it.
    pub(super) fn bodies(&self, part_of_node: &[u32], count: usize) -> Vec<usize> {
        let mut bodies: Vec<u32> = (0..count as u32).collect();
        let network = self.network();
        let linear = network.linear.iter().map(|conductor| conductor.nodes);
        for nodes in linear.chain(network.radiative.iter().map(|conductor| conductor.nodes)) {
            let [a, b] = nodes.map(|node| root(&mut bodies, part_of_node[node as usize]));
            bodies[a.max(b) as usize] = a.min(b);
        }
        (0..count as u32).map(|part| root(&mut bodies, part) as usize).collect()
    }

    /// Nodes that a heater heats, with their shares.
    pub(super) fn heated_nodes(&self, heater: usize) -> &[(u32, f64)] {
        &self.heated[heater].shares
    }

    /// Whether each heater is on, from the states of the thermostats.
    fn heaters_on(&self, thermostats: &[bool]) -> Vec<bool> {
        let mut thermostats = thermostats.iter();
        let on = |heated: &Heated| heated.thermostat.is_none() || thermostats.next() == Some(&true);
        self.heated.iter().map(on).collect()
    }

    fn heater_of(&self, thermostat: usize) -> Option<usize> {
        let mut switched = (0..self.heated.len()).filter(|number| self.heated[*number].thermostat.is_some());
        switched.nth(thermostat)
    }

    /// Calls a function with every device node in the network and its temperature [K].
    pub(crate) fn scatter(&self, temperatures: &[f64], mut set: impl FnMut(usize, f64)) {
        for (slot, node) in self.node_of_slot.iter().enumerate() {
            if *node != NO_NODE {
                set(slot, temperatures[*node as usize]);
            }
        }
    }

    /// The network in one pass, where the network fits and the scene does not ask for sub-steps.
    pub fn plan(&self) -> Option<&Arc<OnePassPlan>> {
        self.one_pass.as_ref()?.as_ref().ok()
    }

    /// The tables with which a device steps the network in one pass.
    pub(super) fn tables(&self) -> Option<OnePassTables> {
        let drawn = DrawnNodes { nodes: &self.node_of_slot, areas: &self.load_areas };
        self.plan().map(|plan| OnePassTables::new(plan, self.step, drawn, self.heaters(), self.settings.tolerance))
    }

    /// Mean power of every heater [W] over a step from `start` [s] of `length` [s]. Thermostats are taken as on.
    pub(super) fn heater_powers(&self, start: f64, length: f64) -> Vec<f64> {
        (0..self.heated.len()).map(|heater| self.power(heater).mean(start, start + length)).collect()
    }

    /// Power of a heater: the power that was set from outside, or else the scene's.
    fn power(&self, heater: usize) -> HeatTable {
        let set = self.set_powers.lock().unwrap_or_else(PoisonError::into_inner).get(heater).copied().flatten();
        set.map_or_else(|| self.heated[heater].power.clone(), HeatTable::constant)
    }

    /// Sets the power of a heater without a thermostat [W] from here on.
    pub(super) fn set_power(&self, heater: usize, power: f64) {
        let mut set = self.set_powers.lock().unwrap_or_else(PoisonError::into_inner);
        set.resize(self.heated.len(), None);
        set[heater] = Some(power);
    }

    /// Gives every heater the scene's power again.
    pub(super) fn forget_powers(&self) {
        self.set_powers.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }

    /// Present power of every heater at a time [s], thermostats taken as on [W].
    pub(super) fn powers_at(&self, time: f64) -> Vec<f64> {
        (0..self.heated.len()).map(|heater| self.power(heater).after(time).0).collect()
    }

    fn heaters(&self) -> Vec<OnePassHeater> {
        self.heated.iter().map(Heated::in_one_pass).collect()
    }

    /// Remarks for the user.
    pub(super) fn remarks(&self, materials: &[Material]) -> Vec<String> {
        let summary = &self.shell.summary;
        let mut remarks = Vec::new();
        if let Some(Err(unfit)) = &self.one_pass {
            remarks.push(format!("one pass a step does not take the network, which takes sub-steps instead: {unfit}"));
        }
        if summary.merged > 0 {
            remarks.push(format!(
                "{} nodes of the network were merged into a neighbour, because the two exchange heat faster than {:.0} /s",
                summary.merged, summary.merge_rate
            ));
        }
        remarks.extend(self.beside(materials));
        remarks
    }

    /// Remark on materials outside the network that lie at its surfaces.
    fn beside(&self, materials: &[Material]) -> Option<String> {
        let apart = self.shell.summary.neighbours.iter().filter(|pair| pair.apart_by == ApartBy::Response);
        let outside = apart.flat_map(|pair| pair.groups).map(|[_, material]| &materials[material as usize]);
        let outside = outside.filter(|material| material.response != Response::Network);
        let names: BTreeSet<String> =
            outside.map(|material| format!("'{}' ({})", material.name, material.response.name())).collect();
        (!names.is_empty()).then(|| {
            format!(
                "materials outside the network lie at its surfaces, and nothing conducts between them: {}. With \
                 response = \"network\" they can be joined",
                names.into_iter().collect::<Vec<_>>().join(", ")
            )
        })
    }

    /// The network in words, as pairs of name and value.
    pub fn description(&self) -> Vec<(String, String)> {
        let (network, summary) = (self.network(), &self.shell.summary);
        let rate = network.fastest_rate(&vec![300.0; network.len()]);
        let mut lines = vec![
            ("nodes".to_owned(), network.len().to_string()),
            ("diffusive nodes".to_owned(), self.nodes_of(NodeKind::Diffusive).to_string()),
            ("arithmetic nodes".to_owned(), self.nodes_of(NodeKind::Arithmetic).to_string()),
            ("drawn vertices".to_owned(), summary.vertices.to_string()),
            ("linear conductors".to_owned(), network.linear.len().to_string()),
            ("radiative conductors".to_owned(), network.radiative.len().to_string()),
            ("merged nodes".to_owned(), format!("{} (faster than {:.1} /s)", summary.merged, summary.merge_rate)),
            ("edges flipped".to_owned(), summary.flips.to_string()),
            ("non-manifold edges".to_owned(), summary.non_manifold.to_string()),
            ("triangles too flat to conduct".to_owned(), summary.degenerate.to_string()),
            ("fastest rate at 300 K".to_owned(), format!("{rate:.4} /s")),
            ("integrator".to_owned(), self.settings.integrator.to_string()),
            ("tolerance".to_owned(), format!("{} K", self.settings.tolerance)),
        ];
        match &self.one_pass {
            Some(Ok(plan)) => lines.extend(described(plan)),
            Some(Err(unfit)) => lines.push(("one pass a step".to_owned(), format!("not taken: {unfit}"))),
            None => {}
        }
        for (name, pairs, total) in &summary.contacts {
            lines.push((format!("contact {name}"), format!("{total:.4} W/K over {pairs} conductors")));
        }
        lines
    }

    /// Heat and thermostats of a step that starts at `start` [s] and lasts `length` [s].
    pub(super) fn schedule(&self, heat: Vec<f64>, on: &[bool], start: f64, length: f64) -> Schedule {
        let mut schedule = Schedule { constant: heat, times: vec![length], ..Schedule::default() };
        for (heater, heated) in self.heated.iter().enumerate() {
            let power = self.power(heater);
            match &heated.thermostat {
                Some(thermostat) => {
                    let initially_on = on[schedule.thermostats.len()];
                    schedule.thermostats.push(Thermostat { initially_on, ..thermostat.clone() });
                    schedule.spread.push(heated.shares.clone());
                }
                None => {
                    let times: Vec<f64> = power.times.iter().map(|time| time - start).collect();
                    schedule.heat.extend(heated.shares.iter().map(|(node, share)| {
                        let powers = power.powers.iter().map(|power| power * share).collect();
                        (*node, HeatTable { times: times.clone(), powers })
                    }));
                }
            }
        }
        schedule
    }

    fn thermostats(&self) -> Vec<&Thermostat> {
        self.heated.iter().filter_map(|heated| heated.thermostat.as_ref()).collect()
    }

    /// The heater of a thermostat, in words.
    fn thermostat_name(&self, number: usize) -> &str {
        let mut switched = self.heated.iter().filter(|heated| heated.thermostat.is_some());
        switched.nth(number).map_or("heater", |heated| &heated.name)
    }

    pub(super) fn sensors(&self) -> Vec<u32> {
        self.thermostats().iter().map(|thermostat| thermostat.sensor).collect()
    }
}

/// A network in one pass, in words.
fn described(plan: &OnePassPlan) -> Vec<(String, String)> {
    let largest = plan.blocks().iter().map(|block| block.nodes.len()).max().unwrap_or(0);
    let nodes: usize = plan.blocks().iter().map(|block| block.nodes.len()).sum();
    let kinds = plan.conductions();
    let own: usize = kinds.iter().map(Conduction::weights).sum();
    let entry = |name: &str, value: String| (name.to_owned(), value);
    let mut lines = vec![
        entry(
            "blocks that conduct exactly",
            format!("{} of {nodes} nodes, at most {largest} in one", plan.blocks().len()),
        ),
        entry("kinds of blocks", format!("{} with {own} weights, in place of {}", kinds.len(), plan.weights())),
        entry("fast nodes", (0..plan.network().len()).filter(|node| plan.is_fast(*node)).count().to_string()),
    ];
    if let (Some(large), Some(series)) = (plan.large(), plan.series()) {
        lines.push(entry("nodes of large blocks", format!("{}, in {} stages", large.nodes().len(), series.stages())));
    }
    if plan.halvings() > 0 {
        lines.push(entry("longest step", format!("{} s, because a longer one does not fit", plan.longest())));
    }
    lines
}
