//! The thermal network of a scene: made from its model, heated by its loads, and integrated tick by tick.

use std::convert::Infallible;
use std::sync::Arc;

use wildmatch::WildMatch;

use super::prepare::PrepareError;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::network::{ESTIMATE_FLOOR, NetworkStepper};
use crate::model::Model;
use crate::scene::{ContactRule, Scene};
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::material::{Material, Response};
use crate::thermal::network::control::{ControlError, FLOOR, Part, Settings, Use, integrate_part};
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::schedule::{HeatTable, Schedule, Thermostat};
use crate::thermal::network::steady::{SteadyError, steady};
use crate::thermal::network::stepper::{Attempt, Method, Stepper, WorkCounts};
use crate::thermal::network::{Network, NodeKind};
use crate::thermal::nodes::{Nodes, PADDING};
use crate::thermal::shell::{Contact, NO_NODE, Selection, Shell, ShellMaterial, Surface};

/// What a reader of a network's temperatures must know.
pub const HOLLOW: &str = "A thermal network exchanges heat with space, Sun and planet on the outside of bodies only: \
                          radiation inside hollow bodies and between surfaces is off.";

/// Heat in a scene's network.
#[derive(Debug, Clone)]
struct Heated {
    /// Nodes with their shares.
    shares: Vec<(u32, f64)>,
    /// Over scene time.
    power: HeatTable,
    /// What switches it.
    thermostat: Option<Thermostat>,
}

/// The network of a scene.
#[derive(Debug)]
pub struct SceneNetwork {
    /// As made from the mesh.
    pub shell: Shell,
    /// How it is integrated.
    pub settings: Settings,
    /// Node of every node of the device, or `NO_NODE`.
    node_of_slot: Vec<u32>,
    /// Area that heats it [m2].
    load_areas: Vec<f64>,
    heated: Vec<Heated>,
    /// Time over which errors add up [s].
    horizon: f64,
}

/// The shell of a scene's network, where it has one.
pub(super) fn shell(
    scene: &Scene,
    model: &Model,
    parts: &[String],
    materials: &[Material],
) -> Result<Option<Shell>, PrepareError> {
    let of = |material: &Material| match material.response {
        Response::Network => ShellMaterial::of(material).map(Some),
        Response::Instant | Response::Transition(_) => Ok(None),
    };
    let wrong = |error| PrepareError::network(scene, error);
    let shells = materials.iter().map(of).collect::<Result<Vec<_>, _>>().map_err(wrong)?;
    if shells.iter().all(Option::is_none) {
        return Ok(None);
    }
    let surface = Surface {
        positions: &model.positions,
        triangles: &model.triangles,
        parts: &model.vertex_part,
        materials: &model.vertex_material,
    };
    let contacts =
        scene.contacts.iter().map(|rule| contact(rule, scene, parts, materials)).collect::<Result<Vec<_>, _>>()?;
    let space = scene.environment.background_temperature.unwrap_or(0.0);
    Shell::new(&surface, &shells, &contacts, scene.network.merge_rate, space).map(Some).map_err(wrong)
}

fn contact(
    rule: &ContactRule,
    scene: &Scene,
    parts: &[String],
    materials: &[Material],
) -> Result<Contact, PrepareError> {
    let name = format!("between '{}' and '{}'", rule.between[0].pattern(), rule.between[1].pattern());
    let select = |owners: &crate::scene::Owners| {
        let by_part = matches!(owners, crate::scene::Owners::Parts(_));
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
    /// Ties a shell to the nodes of the device and to the heaters of the scene.
    pub(super) fn new(
        shell: Shell,
        scene: &Scene,
        parts: &[String],
        nodes: &Nodes,
        probes: &[usize],
        horizon: f64,
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
                let part = &parts[nodes.group_part[slot / crate::thermal::nodes::GROUP] as usize];
                if *vertex != PADDING && structure(slot) != NO_NODE && patterns.iter().any(|p| p.matches(part)) {
                    *areas.entry(structure(slot)).or_insert(0.0) += shell.load_areas[*vertex as usize];
                }
            }
            let whole: f64 = areas.values().sum();
            if whole <= 0.0 {
                let message = format!("heater: no part '{}' is in the network", heater.parts.join("', '"));
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
            heated.push(Heated { shares, power: heater.power.clone(), thermostat });
        }
        if let Some(node) = shell.network.unbalanced_node() {
            let message = format!("node {node} of the network stores no heat and has nowhere to give it");
            return Err(PrepareError::network(scene, message));
        }
        let settings =
            Settings { integrator: scene.network.integrator, tolerance: scene.network.tolerance, floor: FLOOR };
        Ok(Self { shell, settings, node_of_slot, load_areas, heated, horizon })
    }

    /// The network.
    pub fn network(&self) -> &Network {
        &self.shell.network
    }

    /// Whether a node of the device belongs to the network.
    pub fn has(&self, slot: usize) -> bool {
        self.node_of_slot[slot] != NO_NODE
    }

    /// Number of nodes of a kind.
    pub fn nodes_of(&self, kind: NodeKind) -> usize {
        self.network().kinds.iter().filter(|one| **one == kind).count()
    }

    /// Heat of every node [W] from the flux that nodes of the device absorb [W/m2].
    pub fn heat(&self, absorbed: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut heat = vec![0.0; self.network().len()];
        for (slot, (node, area)) in self.node_of_slot.iter().zip(&self.load_areas).enumerate() {
            if *node != NO_NODE {
                heat[*node as usize] += area * absorbed(slot);
            }
        }
        heat
    }

    /// Hands every node of the device in the network its temperature [K].
    pub fn scatter(&self, temperatures: &[f64], mut set: impl FnMut(usize, f64)) {
        for (slot, node) in self.node_of_slot.iter().enumerate() {
            if *node != NO_NODE {
                set(slot, temperatures[*node as usize]);
            }
        }
    }

    /// What a user should look at.
    pub(super) fn remarks(&self) -> Vec<String> {
        let summary = &self.shell.summary;
        let mut remarks = Vec::new();
        if summary.merged > 0 {
            remarks.push(format!(
                "{} nodes of the network were merged into neighbours that they even out with faster than {:.0} /s",
                summary.merged, summary.merge_rate
            ));
        }
        if summary.clamped > 0 {
            remarks.push(format!(
                "{} negative conductances at borders of the network were set to 0: {:.2e} of all",
                summary.clamped, summary.clamped_share
            ));
        }
        remarks
    }

    /// The network in words: name and value.
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
            ("clamped conductances".to_owned(), format!("{} ({:.2e} of all)", summary.clamped, summary.clamped_share)),
            ("edges flipped".to_owned(), summary.flips.to_string()),
            ("non-manifold edges".to_owned(), summary.non_manifold.to_string()),
            ("triangles too flat to conduct".to_owned(), summary.degenerate.to_string()),
            ("fastest rate at 300 K".to_owned(), format!("{rate:.4} /s")),
            ("integrator".to_owned(), self.settings.integrator.to_string()),
            ("tolerance".to_owned(), format!("{} K", self.settings.tolerance)),
        ];
        for (name, pairs, total) in &summary.contacts {
            lines.push((format!("contact {name}"), format!("{total:.4} W/K over {pairs} conductors")));
        }
        lines
    }

    /// Heat and thermostats of a tick that starts at `start` [s] and lasts `length` [s].
    fn schedule(&self, heat: Vec<f64>, on: &[bool], start: f64, length: f64) -> Schedule {
        let mut schedule = Schedule { times: vec![length], ..Schedule::default() };
        schedule.heat = (0..).zip(heat).map(|(node, heat)| (node, HeatTable::constant(heat))).collect();
        for heated in &self.heated {
            match &heated.thermostat {
                Some(thermostat) => {
                    let initially_on = on[schedule.thermostats.len()];
                    schedule.thermostats.push(Thermostat { initially_on, ..thermostat.clone() });
                    schedule.spread.push(heated.shares.clone());
                }
                None => {
                    let times: Vec<f64> = heated.power.times.iter().map(|time| time - start).collect();
                    schedule.heat.extend(heated.shares.iter().map(|(node, share)| {
                        let powers = heated.power.powers.iter().map(|power| power * share).collect();
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

    fn sensors(&self) -> Vec<u32> {
        self.thermostats().iter().map(|thermostat| thermostat.sensor).collect()
    }
}

/// Who integrates.
enum Worker {
    Device(Box<NetworkStepper>),
    Host(Box<ReferenceStepper>),
}

fn sure<T>(result: Result<T, Infallible>) -> T {
    match result {
        Ok(value) => value,
        Err(never) => match never {},
    }
}

impl Stepper for Worker {
    type Error = GpuError;

    fn set_heat(&mut self, power: &[f64], slope: &[f64]) -> Result<(), GpuError> {
        match self {
            Self::Device(stepper) => stepper.set_heat(power, slope),
            Self::Host(stepper) => {
                sure(stepper.set_heat(power, slope));
                Ok(())
            }
        }
    }

    fn balance(&mut self, t: f64) -> Result<bool, GpuError> {
        match self {
            Self::Device(stepper) => stepper.balance(t),
            Self::Host(stepper) => Ok(sure(stepper.balance(t))),
        }
    }

    fn attempt(&mut self, method: Method, t: f64, step: f64, count: u32) -> Result<Attempt, GpuError> {
        match self {
            Self::Device(stepper) => stepper.attempt(method, t, step, count),
            Self::Host(stepper) => Ok(sure(stepper.attempt(method, t, step, count))),
        }
    }

    fn hottest(&self) -> f64 {
        match self {
            Self::Device(stepper) => stepper.hottest(),
            Self::Host(stepper) => stepper.hottest(),
        }
    }

    fn keep(&mut self) -> Result<(), GpuError> {
        match self {
            Self::Device(stepper) => stepper.keep(),
            Self::Host(stepper) => {
                sure(stepper.keep());
                Ok(())
            }
        }
    }

    fn temperatures(&mut self) -> Result<Vec<f64>, GpuError> {
        match self {
            Self::Device(stepper) => stepper.temperatures(),
            Self::Host(stepper) => Ok(sure(stepper.temperatures())),
        }
    }

    fn set_temperatures(&mut self, temperatures: &[f64]) -> Result<(), GpuError> {
        match self {
            Self::Device(stepper) => stepper.set_temperatures(temperatures),
            Self::Host(stepper) => {
                sure(stepper.set_temperatures(temperatures));
                Ok(())
            }
        }
    }

    fn steady(&mut self, t: f64) -> Result<bool, GpuError> {
        match self {
            Self::Device(stepper) => stepper.steady(t),
            Self::Host(stepper) => Ok(sure(stepper.steady(t))),
        }
    }

    fn counts(&self) -> WorkCounts {
        match self {
            Self::Device(stepper) => stepper.counts(),
            Self::Host(stepper) => stepper.counts(),
        }
    }
}

/// A scene's network under way.
pub struct NetworkRun {
    scene: Arc<SceneNetwork>,
    worker: Worker,
    settings: Settings,
    on: Vec<bool>,
    step: f64,
    uses: [Option<Use>; 3],
    rejected: u64,
    switches: u64,
    /// Why the device does not integrate, where it was asked to.
    refused: Option<String>,
}

impl NetworkRun {
    /// In f64 on the processor.
    pub fn reference(scene: &Arc<SceneNetwork>) -> Self {
        let worker = Worker::Host(Box::new(ReferenceStepper::new(scene.network().clone(), &scene.sensors())));
        Self::new(scene, worker, FLOOR, None)
    }

    /// On a device; in f64 on the processor where the device does not take the network.
    ///
    /// # Errors
    /// A call that fails.
    pub fn on_device(context: &Arc<Context>, scene: &Arc<SceneNetwork>) -> Result<Self, GpuError> {
        match NetworkStepper::new(context, scene.network(), &scene.sensors()) {
            Ok(stepper) => Ok(Self::new(scene, Worker::Device(Box::new(stepper)), ESTIMATE_FLOOR, None)),
            Err(GpuError::UnsupportedNetwork { reason }) => {
                Ok(Self { refused: Some(reason), ..Self::reference(scene) })
            }
            Err(error) => Err(error),
        }
    }

    fn new(scene: &Arc<SceneNetwork>, worker: Worker, floor: f64, refused: Option<String>) -> Self {
        Self {
            on: scene.thermostats().iter().map(|thermostat| thermostat.initially_on).collect(),
            settings: Settings { floor, ..scene.settings },
            scene: Arc::clone(scene),
            worker,
            step: f64::INFINITY,
            uses: [None; 3],
            rejected: 0,
            switches: 0,
            refused,
        }
    }

    /// The scene's network.
    pub fn scene(&self) -> &Arc<SceneNetwork> {
        &self.scene
    }

    /// The steady state under the heat of every node [W] at a time [s].
    ///
    /// # Errors
    /// A call that fails, or no steady state.
    pub fn settle(&mut self, heat: Vec<f64>, time: f64) -> Result<(), GpuError> {
        // The balance of each node alone is where the search begins.
        let network = self.scene.network();
        let space = network.space_temperature.powi(4);
        let guess = |(heat, area): (&f64, &f64)| (heat.max(0.0) / (STEFAN_BOLTZMANN * area) + space).sqrt().sqrt();
        let emitted: f64 = network.emissive_areas.iter().sum();
        let common = guess((&heat.iter().sum::<f64>(), &emitted)).clamp(3.0, 2000.0);
        self.settle_at(common)?;
        let schedule = self.scene.schedule(heat, &self.on, time, 0.0);
        let network = self.scene.network();
        let found = match steady(&mut self.worker, network, &schedule) {
            // A large network: the device steps it, but does not solve it as a whole.
            Err(SteadyError::Stepper(GpuError::UnsupportedNetwork { .. })) => {
                let mut stepper = ReferenceStepper::new(network.clone(), &self.scene.sensors());
                sure(stepper.set_temperatures(&vec![common; network.len()]));
                steady(&mut stepper, network, &schedule).map_err(|error| failure(time, &unsteady(&error)))?
            }
            Err(SteadyError::Stepper(error)) => return Err(error),
            found => found.map_err(|error| failure(time, &unsteady(&error)))?,
        };
        self.worker.set_temperatures(&found.temperatures)?;
        self.on = found.on;
        Ok(())
    }

    /// Every node at a temperature [K]; arithmetic ones balance at the first tick.
    ///
    /// # Errors
    /// A call that fails.
    pub fn settle_at(&mut self, temperature: f64) -> Result<(), GpuError> {
        self.step = f64::INFINITY;
        self.worker.set_temperatures(&vec![temperature; self.scene.network().len()])
    }

    /// One tick from `start` [s] of `length` [s] under a constant heat of every node [W].
    ///
    /// # Errors
    /// A call that fails, or temperatures that cannot be found.
    pub fn tick(&mut self, heat: Vec<f64>, start: f64, length: f64) -> Result<(), GpuError> {
        let schedule = self.scene.schedule(heat, &self.on, start, length);
        let part = Part { horizon: self.scene.horizon.max(length), step: self.step, tight_switches: false };
        let series = integrate_part(&mut self.worker, self.scene.network(), &schedule, &self.settings, part, |_| true)
            .map_err(|error| match error {
                ControlError::Stepper(error) => error,
                other => failure(start, &unfinished(&other)),
            })?;
        self.step = series.step;
        self.on = series.on;
        self.rejected += series.rejected;
        self.switches += series.switches.len() as u64;
        for (sum, new) in self.uses.iter_mut().zip(series.uses) {
            *sum = match (*sum, new) {
                (Some(a), Some(b)) => Some(Use {
                    sub_steps: a.sub_steps + b.sub_steps,
                    time: a.time + b.time,
                    range: [a.range[0].min(b.range[0]), a.range[1].max(b.range[1])],
                    stages: [a.stages[0].min(b.stages[0]), a.stages[1].max(b.stages[1])],
                }),
                (a, b) => a.or(b),
            };
        }
        Ok(())
    }

    /// Temperatures of the nodes [K].
    ///
    /// # Errors
    /// A call that fails.
    pub fn temperatures(&mut self) -> Result<Vec<f64>, GpuError> {
        self.worker.temperatures()
    }

    /// Replaces the temperatures of the nodes [K].
    ///
    /// # Errors
    /// A call that fails.
    pub fn set_temperatures(&mut self, temperatures: &[f64]) -> Result<(), GpuError> {
        self.step = f64::INFINITY;
        self.worker.set_temperatures(temperatures)
    }

    /// What was done, in words: name and value.
    pub fn description(&self) -> Vec<(String, String)> {
        let worker = match (&self.worker, &self.refused) {
            (Worker::Device(_), _) => "on the device, f32 with carried residual".to_owned(),
            (Worker::Host(_), None) => "f64 on the processor".to_owned(),
            (Worker::Host(_), Some(reason)) => format!("f64 on the processor, because of the device: {reason}"),
        };
        let mut lines = vec![("integrated".to_owned(), worker)];
        for (name, used) in ["Euler with residual", "RKL2", "TR-BDF2"].iter().zip(&self.uses) {
            if let Some(used) = used {
                let [short, long] = used.range;
                let [fewest, most] = used.stages;
                lines.push((
                    (*name).to_owned(),
                    format!("{} sub-steps of {short:.3} to {long:.3} s, {fewest} to {most} stages", used.sub_steps),
                ));
            }
        }
        let counts = self.worker.counts();
        lines.push(("sub-steps taken back".to_owned(), self.rejected.to_string()));
        lines.push(("stages".to_owned(), counts.stages.to_string()));
        lines.push(("dispatches".to_owned(), counts.dispatches.to_string()));
        if !self.on.is_empty() {
            lines.push(("switches of thermostats".to_owned(), self.switches.to_string()));
        }
        lines
    }
}

fn failure(time: f64, reason: &str) -> GpuError {
    GpuError::Network { time, reason: reason.to_owned() }
}

fn unsteady<E>(error: &SteadyError<E>) -> String {
    match error {
        SteadyError::Stepper(_) => "the stepper failed".to_owned(),
        SteadyError::Closed { node } => format!("the heat of node {node} has no way to space"),
        SteadyError::NotFound { node } => format!(
            "no steady state was found (node {node} is furthest from it): state initial.temperature to start elsewhere"
        ),
        SteadyError::Cycles { thermostat } => format!(
            "no steady state: thermostat {thermostat} has none, on or off; state initial.temperature to start elsewhere"
        ),
    }
}

/// Why an integration ended early, in words.
pub(crate) fn unfinished<E>(error: &ControlError<E>) -> String {
    match error {
        ControlError::Stepper(_) => "the stepper failed".to_owned(),
        ControlError::Unbalanced { node, .. } => format!("the arithmetic nodes do not balance, node {node} least"),
        ControlError::NoStep { node, temperature, .. } => {
            format!("no step is short enough; node {node} is at {temperature} K")
        }
        ControlError::TooHot { node, temperature, .. } => {
            format!("node {node} is hotter than the device holds, {temperature} K")
        }
        ControlError::Chatter { thermostat, .. } => format!("thermostat {thermostat} switches without end"),
        ControlError::Stopped => "it was stopped".to_owned(),
    }
}
