//! A large network on the device: every stage is a dispatch over all nodes.

mod constants;
mod record;
mod solve;

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;

use self::constants::Constants;
use self::solve::Budget;
use super::frame::WidePlan;
use super::host::{Pool, room};
use super::sliced::Sliced;
use super::tables::Tables;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::layout::{NetworkLink, NetworkSolver};
use crate::gpu::memory::Buffer;
use crate::gpu::once::Once;
use crate::gpu::pass::{NetworkNodes, Resource};
use crate::gpu::pipeline::Pipeline;
use crate::gpu::wide_variant::WideVariant;
use crate::thermal::network::Network;
use crate::thermal::network::stepper::{Attempt, Method, WorkCounts};

/// Invocations of a workgroup.
const WORKGROUP: usize = 64;
/// Nodes of one dispatch: 65,535 workgroups, four nodes an invocation.
pub const NODES_AT_MOST: usize = 65_535 * WORKGROUP * super::sliced::GROUP;
/// Links of one node: some drivers end a shader's loops after 65,535 turns.
pub const LINKS_AT_MOST: usize = 60_000;
/// Sub-steps of one submission, and passes from which on it is ended.
const SUB_STEPS_AT_MOST: u32 = 64;
const PASSES_AT_MOST: u32 = 4_000;
/// Kinds of pass, in two states, over up to three sets of nodes.
const SETS: u32 = 64;
/// Bindings of a pass at most.
const BINDINGS: u32 = 20;

/// Bytes on the device of a large network: its tables, its stages, and the vectors of the solver, which a steady state
/// needs; what the host reads and writes is not counted. At most so many: parallel conductors count as several.
pub fn network_bytes(network: &Network) -> u64 {
    let groups = network.len().next_multiple_of(super::sliced::SLICE) / super::sliced::GROUP;
    let (entries, links) = super::sliced::entries(network);
    let a_entry = if network.radiative.is_empty() { 32 } else { 48 };
    let tails = if links > 0 { 16 * groups + size_of::<NetworkLink>() * links } else { 0 };
    // Rows; the last two stages, start and rates; solver; lists of groups and masks.
    let a_group = 64 + 4 * (8 + 8 + 4 + 4) + 4 * 4 * SOLVER.len() + 20;
    (a_group * groups + a_entry * entries + tails) as u64
}

/// Vectors that only a network that solves needs.
const SOLVER: [Resource; 8] = [
    Resource::SolverResidual,
    Resource::SolverConditioned,
    Resource::SolverDirection,
    Resource::SolverProductDirection,
    Resource::SolverSolution,
    Resource::SolverProduct,
    Resource::SolverInverse,
    Resource::SolverRoots,
];

/// Nodes that a pass is confined to.
struct List {
    /// Groups with any of them, or the sensors.
    list: Buffer,
    masks: Buffer,
    count: usize,
}

/// What selects a descriptor set: the pass, its nodes, and where the present stage is.
type SetKey = (WideVariant, NetworkNodes, bool);

/// Buffers and kernels of a large network. Fields are dropped in order.
pub struct Wide {
    once: Once,
    pipelines: BTreeMap<WideVariant, Pipeline>,
    sets: BTreeMap<SetKey, vk::DescriptorSet>,
    pool: Pool,
    /// What never changes, by binding, and last the heat, which the host writes.
    tables: Vec<Buffer>,
    lists: BTreeMap<NetworkNodes, List>,
    buffers: BTreeMap<Resource, Buffer>,
    context: Arc<Context>,
    count: usize,
    groups: usize,
    sensors: usize,
    plan: WidePlan,
    space_temperature: f32,
    /// Where the last try left its state.
    odd: bool,
    counts: WorkCounts,
    /// Iterations recorded of a stage's balance, of a stage of TR-BDF2, and of a steady state.
    budgets: [Budget; 3],
}

impl Wide {
    /// Uploads the network.
    ///
    /// # Errors
    /// More than the device holds, or a call that fails.
    pub fn new(context: &Arc<Context>, network: &Network, tables: &Tables, sensors: &[u32]) -> Result<Self, GpuError> {
        let sliced = Sliced::new(tables);
        let mut once = Once::new(context)?;
        let mut filled = |name: &str, bytes: &[u8]| -> Result<Buffer, GpuError> {
            let buffer = room(context, name, bytes.len().div_ceil(4), MemoryLocation::GpuOnly)?;
            once.upload(&buffer, bytes)?;
            Ok(buffer)
        };
        let mut buffers_of_tables = vec![
            filled("network rows", bytemuck::cast_slice(&sliced.rows))?,
            filled("network slices", bytemuck::cast_slice(&sliced.slices))?,
            filled("network neighbours", bytemuck::cast_slice(&sliced.neighbours))?,
            filled("network conductances", bytemuck::cast_slice(&sliced.conductances))?,
            filled("network exchanges", bytemuck::cast_slice(&sliced.exchanges))?,
            filled("network tails", bytemuck::cast_slice(if sliced.links.is_empty() { &[] } else { &sliced.tails }))?,
            filled("network links", bytemuck::cast_slice(&sliced.links))?,
        ];
        let mut lists = BTreeMap::new();
        let mut arithmetic: Vec<u32> = tables.lone.iter().chain(&tables.coupled).copied().collect();
        arithmetic.sort_unstable();
        for (nodes, list) in [
            (NetworkNodes::All, &[][..]),
            (NetworkNodes::Lone, &tables.lone),
            (NetworkNodes::Arithmetic, &arithmetic),
            (NetworkNodes::Free, &tables.free),
        ] {
            let (groups, masks) = Sliced::groups_of(list);
            let count = if nodes == NetworkNodes::All { sliced.groups } else { groups.len() };
            let list = filled("network groups", bytemuck::cast_slice(&groups))?;
            let masks = filled("network masks", bytemuck::cast_slice(&masks))?;
            lists.insert(nodes, List { list, masks, count });
        }
        let (list, masks) = (filled("sensors", bytemuck::cast_slice(sensors))?, filled("no masks", &[])?);
        lists.insert(NetworkNodes::Sensors, List { list, masks, count: sensors.len() });
        once.free_staging();
        let (groups, solves) = (sliced.groups, Self::solver_groups(&lists));
        let mut heat = room(context, "network heat", 8 * groups, MemoryLocation::CpuToGpu)?;
        heat.write(&vec![[0.0f32; 8]; groups]);
        buffers_of_tables.push(heat);
        let mut buffers = BTreeMap::new();
        let (device, to_host) = (MemoryLocation::GpuOnly, MemoryLocation::GpuToCpu);
        for (resource, words, location) in [
            (Resource::NetworkKept, 8 * groups, to_host),
            (Resource::NetworkEven, 8 * groups, device),
            (Resource::NetworkOdd, 8 * groups, device),
            (Resource::NetworkStart, 4 * groups, device),
            (Resource::NetworkRates, 4 * groups, device),
            (Resource::NetworkErrors, groups, to_host),
            (Resource::NetworkSensed, 2 * sensors.len() * SUB_STEPS_AT_MOST as usize, to_host),
            (Resource::SolverPartials, 2 * solves.div_ceil(WORKGROUP), device),
            (Resource::SolverScalars, size_of::<NetworkSolver>() / 4, to_host),
        ] {
            buffers.insert(resource, room(context, &format!("{resource:?}"), words, location)?);
        }
        if let Some(kept) = buffers.get_mut(&Resource::NetworkKept) {
            // The nodes that fill up the last slice stay at 0 K.
            kept.write(&vec![[0.0f32; 8]; groups]);
        }
        let plan = WidePlan {
            radiative: tables.radiative,
            tails: !sliced.links.is_empty(),
            lone: !tables.lone.is_empty() && tables.coupled.is_empty(),
            coupled: !tables.coupled.is_empty(),
            sensors: !sensors.is_empty(),
            stages: 1,
            iterations: [1, 1],
        };
        let mut wide = Self {
            once,
            pipelines: BTreeMap::new(),
            sets: BTreeMap::new(),
            pool: Pool::new(context, SETS, BINDINGS)?,
            tables: buffers_of_tables,
            lists,
            buffers,
            context: Arc::clone(context),
            count: network.len(),
            groups,
            sensors: sensors.len(),
            plan,
            space_temperature: network.space_temperature as f32,
            odd: false,
            counts: WorkCounts::default(),
            budgets: [Budget::balance(), Budget::stage(), Budget::steady()],
        };
        if plan.coupled {
            wide.make_solver()?;
        }
        Ok(wide)
    }

    fn solver_groups(lists: &BTreeMap<NetworkNodes, List>) -> usize {
        lists.values().map(|list| list.count).max().unwrap_or(0)
    }

    /// Makes the solver's vectors, which only a network that solves needs.
    fn make_solver(&mut self) -> Result<(), GpuError> {
        let once = &mut self.once;
        for resource in SOLVER {
            if self.buffers.contains_key(&resource) {
                continue;
            }
            let name = format!("{resource:?}");
            let buffer = room(&self.context, &name, 4 * self.groups, MemoryLocation::GpuOnly)?;
            // What is no unknown stays 0 in the products.
            once.run(|device, commands| {
                // SAFETY: the buffer may be a transfer destination, and lives until `run` has waited.
                unsafe { device.cmd_fill_buffer(commands, buffer.raw, 0, vk::WHOLE_SIZE, 0) };
            })?;
            self.buffers.insert(resource, buffer);
        }
        Ok(())
    }

    /// Time of all submissions so far by the device's own clock [ms], where it has one.
    pub fn device_ms(&self) -> Option<f64> {
        self.once.device_ms()
    }

    /// Work so far.
    pub fn counts(&self) -> WorkCounts {
        self.counts
    }

    /// Heat of every node [W] and its slope [W/s].
    pub fn set_heat(&mut self, heat: &[[f32; 2]]) {
        if let Some(buffer) = self.tables.last_mut() {
            buffer.write(heat);
        }
    }

    /// Base and rest of every node [K].
    pub fn state(&self) -> &[[f32; 2]] {
        self.buffers[&Resource::NetworkKept].read(self.count)
    }

    /// Replaces the kept state.
    pub fn set_state(&mut self, state: &[[f32; 2]]) {
        if let Some(buffer) = self.buffers.get_mut(&Resource::NetworkKept) {
            buffer.write(state);
        }
    }

    /// Keeps what the last try left.
    ///
    /// # Errors
    /// A call that fails.
    pub fn keep(&mut self) -> Result<(), GpuError> {
        self.submit(&[WidePlan::keep(self.odd)], Constants::none())
    }

    /// Tries some sub-steps.
    ///
    /// # Errors
    /// A call that fails.
    pub fn attempt(&mut self, method: Method, t: f64, step: f64, count: u32) -> Result<Attempt, GpuError> {
        self.plan.stages = match method {
            Method::Rkl2 { stages } => stages,
            Method::Euler => 1,
            Method::TrBdf2 => 0,
        };
        if method == Method::TrBdf2 {
            self.make_solver()?;
        }
        let solves = self.plan.coupled || method == Method::TrBdf2;
        let which = usize::from(method == Method::TrBdf2);
        loop {
            self.plan.iterations = self.budgets[which].iterations();
            let attempt = self.attempt_once(method, t, step, count)?;
            if !solves {
                return Ok(attempt);
            }
            let solver = self.solver();
            self.counts.iterations += solver.iterations as u64;
            if solver.lost > 0.0 {
                return Ok(Attempt { error: f64::INFINITY, ..attempt });
            }
            if self.budgets[which].was_enough(&solver) {
                return Ok(attempt);
            }
            if !self.budgets[which].grow(&solver) {
                self.budgets[which] = if which == 0 { Budget::balance() } else { Budget::stage() };
                return Ok(Attempt { error: f64::INFINITY, ..attempt });
            }
        }
    }

    fn attempt_once(&mut self, method: Method, t: f64, step: f64, count: u32) -> Result<Attempt, GpuError> {
        let mut constants = Constants::new(method, t, step);
        self.odd = false;
        let mut attempt = Attempt::default();
        let passes = self.plan.sub_step(0, false).0.steps.len() as u32 / 2;
        let at_once = (PASSES_AT_MOST / passes.max(1)).clamp(1, SUB_STEPS_AT_MOST);
        for first in (0..count).step_by(at_once as usize) {
            let some = (count - first).min(at_once);
            let mut frames = if first == 0 { vec![self.plan.start()] } else { Vec::new() };
            for number in 0..some {
                let (frame, odd) = self.plan.sub_step(number, self.odd);
                self.odd = odd;
                frames.push(frame);
            }
            frames.push(self.plan.end());
            constants.time = t + f64::from(first) * step;
            self.submit(&frames, constants.clone())?;
            let sensed: &[[f32; 2]] = self.buffers[&Resource::NetworkSensed].read(self.sensors * some as usize);
            attempt.sensed.extend(sensed.iter().map(|[base, rest]| f64::from(*base) + f64::from(*rest)));
            self.counts.sub_steps += u64::from(some);
            self.counts.stages += u64::from(some) * constants.stages_of_method();
        }
        let words = if method == Method::TrBdf2 { self.groups } else { self.groups.div_ceil(WORKGROUP) };
        let errors: &[u32] = self.buffers[&Resource::NetworkErrors].read(words);
        let largest = f32::from_bits(errors.iter().max().copied().unwrap_or(0));
        attempt.error = if largest.is_nan() { f64::INFINITY } else { f64::from(largest) };
        Ok(attempt)
    }
}
