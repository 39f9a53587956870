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
use super::parts::{Part, SOLVER, lodgings, parts};
use super::sliced::Sliced;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::memory::Buffer;
use crate::gpu::once::Once;
use crate::gpu::pass::{NetworkNodes, Resource};
use crate::gpu::pipeline::Pipeline;
use crate::gpu::wide_variant::WideVariant;
use crate::thermal::network::Network;
use crate::thermal::network::stepper::{Attempt, Method, WorkCounts};

/// Invocations of a workgroup.
pub(super) const WORKGROUP: usize = 64;
/// Nodes of one dispatch: 65,535 workgroups, four nodes an invocation.
pub const NODES_AT_MOST: usize = 65_535 * WORKGROUP * super::sliced::GROUP;
/// Links of one node: some drivers end a shader's loops after 65,535 turns.
pub const LINKS_AT_MOST: usize = 60_000;
/// Sub-steps of one submission, and passes from which on it is ended.
pub(super) const SUB_STEPS_AT_MOST: u32 = 64;
const PASSES_AT_MOST: u32 = 4_000;
/// Kinds of pass, in two states, over up to three sets of nodes.
const SETS: u32 = 64;
/// Bindings of a pass at most.
const BINDINGS: u32 = 20;

/// Nodes that a pass is confined to.
struct List {
    /// Groups with any of them and a bit for each, or the sensors.
    list: Buffer,
    count: usize,
}

/// A piece of a buffer that passes write: all of it, or what a scene has to spare.
pub(super) struct Piece {
    pub(super) buffer: Arc<Buffer>,
    pub(super) offset: u64,
    pub(super) bytes: u64,
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
    buffers: BTreeMap<Resource, Piece>,
    /// Where the solver's vectors may lie: what is in there need not last while a network is stepped.
    spare: Vec<Arc<Buffer>>,
    /// Whether the solver has written there since that was last asked.
    wrote_spare: bool,
    /// Bytes of every vector of the solver.
    vector: u64,
    context: Arc<Context>,
    /// Where every node stands in what the device has.
    slot_of_node: Vec<u32>,
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
    pub fn new(
        context: &Arc<Context>,
        network: &Network,
        sensors: &[u32],
        spare: Vec<Arc<Buffer>>,
    ) -> Result<Self, GpuError> {
        let sliced = Sliced::new(network);
        let all: BTreeMap<Part, u64> = parts(&sliced.sizes(), sliced.coupled, sensors.len()).into_iter().collect();
        let mut once = Once::new(context)?;
        let make = |part: Part, location| room(context, &part.name(), all[&part].div_ceil(4) as usize, location);
        let mut filled = |part: Part, bytes: &[u8]| -> Result<Buffer, GpuError> {
            let buffer = make(part, MemoryLocation::GpuOnly)?;
            once.upload(&buffer, bytes)?;
            Ok(buffer)
        };
        let plan = WidePlan {
            radiative: sliced.radiative,
            tails: !sliced.links.is_empty(),
            lone: !sliced.arithmetic.is_empty() && !sliced.coupled,
            coupled: sliced.coupled,
            sensors: !sensors.is_empty(),
            stages: 1,
            iterations: [1, 1],
        };
        let groups = sliced.groups;
        let Sliced { rows, slices, neighbours, conductances, radiators, tails, links, .. } = sliced;
        let Sliced { arithmetic, free, slot_of_node, .. } = sliced;
        let sensor_slots: Vec<u32> = sensors.iter().map(|sensor| slot_of_node[*sensor as usize]).collect();
        // Each is freed when it is uploaded.
        let mut tables = vec![filled(Part::Table(0), bytemuck::cast_slice(&rows))?];
        drop(rows);
        tables.push(filled(Part::Table(1), bytemuck::cast_slice(&slices))?);
        drop(slices);
        tables.push(filled(Part::Table(2), bytemuck::cast_slice(&neighbours))?);
        drop(neighbours);
        tables.push(filled(Part::Table(3), bytemuck::cast_slice(&conductances))?);
        drop(conductances);
        tables.push(filled(Part::Table(4), bytemuck::cast_slice(&radiators))?);
        drop(radiators);
        tables.push(filled(Part::Table(5), bytemuck::cast_slice(&tails))?);
        tables.push(filled(Part::Table(6), bytemuck::cast_slice(&links))?);
        drop((tails, links));
        let balanced = if plan.coupled { NetworkNodes::Arithmetic } else { NetworkNodes::Lone };
        let mut lists = BTreeMap::new();
        for (nodes, list, count) in [
            (NetworkNodes::All, &[][..], groups),
            (balanced, &arithmetic, arithmetic.len()),
            (NetworkNodes::Free, &free, free.len()),
            (NetworkNodes::Sensors, &sensor_slots, sensors.len()),
        ] {
            lists.insert(nodes, List { list: filled(Part::List(nodes), bytemuck::cast_slice(list))?, count });
        }
        once.free_staging();
        let mut heat = make(Part::Table(7), MemoryLocation::CpuToGpu)?;
        heat.clear();
        tables.push(heat);
        let mut buffers = BTreeMap::new();
        for (part, bytes) in &all {
            let Part::Of(resource) = *part else { continue };
            if SOLVER.contains(&resource) {
                continue;
            }
            let location = if part.is_of_host() { MemoryLocation::GpuToCpu } else { MemoryLocation::GpuOnly };
            let mut buffer = make(*part, location)?;
            if resource == Resource::NetworkKept {
                // The nodes that fill up the last slice stay at 0 K.
                buffer.clear();
            }
            buffers.insert(resource, Piece { buffer: Arc::new(buffer), offset: 0, bytes: *bytes });
        }
        let mut wide = Self {
            once,
            pipelines: BTreeMap::new(),
            sets: BTreeMap::new(),
            pool: Pool::new(context, SETS, BINDINGS)?,
            tables,
            lists,
            buffers,
            spare,
            wrote_spare: false,
            vector: all[&Part::Of(SOLVER[0])],
            context: Arc::clone(context),
            slot_of_node,
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

    /// Makes the solver's vectors, which only a network that solves needs, where the scene has nothing to spare for them.
    fn make_solver(&mut self) -> Result<(), GpuError> {
        let spare: Vec<u64> = self.spare.iter().map(|buffer| buffer.bytes).collect();
        for (resource, lodging) in SOLVER.into_iter().zip(lodgings(&spare, self.vector)) {
            if self.buffers.contains_key(&resource) {
                continue;
            }
            let piece = match lodging {
                Some((number, offset)) => Piece { buffer: Arc::clone(&self.spare[number]), offset, bytes: self.vector },
                None => {
                    let words = self.vector as usize / 4;
                    let buffer = room(&self.context, &Part::Of(resource).name(), words, MemoryLocation::GpuOnly)?;
                    Piece { buffer: Arc::new(buffer), offset: 0, bytes: self.vector }
                }
            };
            self.buffers.insert(resource, piece);
        }
        Ok(())
    }

    /// Whether the solver has written to spare buffers since this was last asked.
    pub fn wrote_spare(&mut self) -> bool {
        std::mem::take(&mut self.wrote_spare)
    }

    /// Bytes on the device as they were allocated; what the host reads and writes and what is spare is not counted.
    pub fn device_bytes(&self) -> u64 {
        let tables = self.tables[..self.tables.len() - 1].iter().map(|buffer| buffer.bytes);
        let lists = self.lists.values().map(|list| list.list.bytes);
        let is_own = |(resource, piece): (&Resource, &Piece)| {
            let spare = self.spare.iter().any(|spare| Arc::ptr_eq(spare, &piece.buffer));
            (!spare && !Part::Of(*resource).is_of_host()).then_some(piece.buffer.bytes)
        };
        tables.chain(lists).sum::<u64>() + self.buffers.iter().filter_map(is_own).sum::<u64>()
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
        let slots = self.in_slots(heat);
        if let Some(buffer) = self.tables.last_mut() {
            buffer.write(&slots);
        }
    }

    /// Pairs of every node in the order of the device.
    fn in_slots(&self, pairs: &[[f32; 2]]) -> Vec<[f32; 2]> {
        let mut slots = vec![[0.0; 2]; pairs.len()];
        for (slot, pair) in self.slot_of_node.iter().zip(pairs) {
            slots[*slot as usize] = *pair;
        }
        slots
    }

    /// Base and rest of every node [K].
    pub fn state(&self) -> impl Iterator<Item = [f32; 2]> + '_ {
        let slots: &[[f32; 2]] = self.buffers[&Resource::NetworkKept].buffer.read(self.slot_of_node.len());
        self.slot_of_node.iter().map(|slot| slots[*slot as usize])
    }

    /// Replaces the kept state.
    pub fn set_state(&mut self, state: &[[f32; 2]]) {
        let slots = self.in_slots(state);
        let kept = self.buffers.get_mut(&Resource::NetworkKept);
        if let Some(buffer) = kept.and_then(|piece| Arc::get_mut(&mut piece.buffer)) {
            buffer.write(&slots);
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
            let sensed: &[[f32; 2]] = self.buffers[&Resource::NetworkSensed].buffer.read(self.sensors * some as usize);
            attempt.sensed.extend(sensed.iter().map(|[base, rest]| f64::from(*base) + f64::from(*rest)));
            self.counts.sub_steps += u64::from(some);
            self.counts.stages += u64::from(some) * constants.stages_of_method();
        }
        let words = if method == Method::TrBdf2 { self.groups } else { self.groups.div_ceil(WORKGROUP) };
        let errors: &[u32] = self.buffers[&Resource::NetworkErrors].buffer.read(words);
        let largest = f32::from_bits(errors.iter().max().copied().unwrap_or(0));
        attempt.error = if largest.is_nan() { f64::INFINITY } else { f64::from(largest) };
        Ok(attempt)
    }
}
