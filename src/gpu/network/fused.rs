//! A small network on the device: one workgroup takes all sub-steps of an attempt in a few dispatches of one submission.

mod settle;

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use bytemuck::Zeroable;
use gpu_allocator::MemoryLocation;

use super::host::{Pool, buffer, room, write_set};
use super::schedule::Schedule;
use super::tables::Tables;
use super::weights::{device_stages, error_weights};
use crate::gpu::bindings::allocate_set;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::layout::{NetworkAttempt, NetworkStage};
use crate::gpu::memory::Buffer;
use crate::gpu::once::Once;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::variant::{FusedKind, FusedVariant};
use crate::thermal::network::Network;
use crate::thermal::network::stepper::{Attempt, Method, WorkCounts};

/// Nodes that the shared memory of the kernels holds.
pub const NODES_AT_MOST: usize = 1024;
/// Turns of loops that a dispatch may plan (glsl/network_fused.comp, LOOPS_AT_MOST).
const LOOPS_AT_MOST: u32 = 48_000;
/// Words of the result: counts, then sensors.
const RESULT_WORDS: usize = 1 << 16;
const RESULT_HEAD: usize = 4;
/// Sub-steps of one submission.
const SUB_STEPS_AT_MOST: u32 = 20_000;
/// Stages of a sub-step.
const STAGES_AT_MOST: u32 = 999;
/// Iterations of Newton's method in one dispatch.
const ITERATIONS: u32 = 12;

/// A system of equations that is solved by elimination: its schedule and buffers.
struct System {
    schedule: Schedule,
    words: Buffer,
    matrix: Buffer,
    /// What the dispatches do; one for balancing and one for stepping.
    attempts: [Buffer; 2],
}

/// Which system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Unknowns {
    /// Arithmetic nodes that are coupled.
    Arithmetic,
    /// All that is no boundary.
    Free,
}

/// A pipeline and its descriptor sets, one for each of the two states.
struct Kernel {
    sets: [vk::DescriptorSet; 2],
    pipeline: Pipeline,
}

/// Buffers and kernels of a small network. Fields are dropped in order.
pub struct Fused {
    once: Once,
    kernels: BTreeMap<(FusedVariant, Unknowns), Kernel>,
    pool: Pool,
    nodes: Buffer,
    links: Buffer,
    heat: Buffer,
    stages: Buffer,
    lists: Buffer,
    states: [Buffer; 2],
    work: Buffer,
    result: Buffer,
    systems: BTreeMap<Unknowns, System>,
    tables: Tables,
    sensors: u32,
    space_temperature: f32,
    kept: usize,
    lanes: u32,
    counts: WorkCounts,
    /// Method, stages and step that the stage buffer holds.
    staged: Option<(u32, f64)>,
    context: Arc<Context>,
}

impl System {
    fn new(context: &Arc<Context>, schedule: Schedule) -> Result<Self, GpuError> {
        let attempt = || buffer(context, "network attempt", &[NetworkAttempt::zeroed()]);
        Ok(Self {
            words: buffer(context, "elimination", &schedule.words)?,
            matrix: room(context, "matrix", schedule.values, MemoryLocation::GpuOnly)?,
            attempts: [attempt()?, attempt()?],
            schedule,
        })
    }
}

impl Fused {
    /// Uploads the network. `None` where it is too large or its arithmetic nodes too much coupled to be eliminated.
    ///
    /// # Errors
    /// A call that fails.
    pub fn new(context: &Arc<Context>, network: &Network, sensors: &[u32]) -> Result<Option<Self>, GpuError> {
        if network.len() > NODES_AT_MOST {
            return Ok(None);
        }
        let tables = Tables::new(network);
        let Some(schedule) = Schedule::new(&tables, &tables.coupled) else { return Ok(None) };
        let lanes = lanes_for(network.len(), context.info.kind == "cpu");
        let mut systems = BTreeMap::new();
        systems.insert(Unknowns::Arithmetic, System::new(context, schedule)?);
        let nodes = network.len();
        let lists: Vec<u32> = sensors.iter().chain(&tables.lone).copied().collect();
        let state = || room(context, "network state", 2 * nodes, MemoryLocation::GpuToCpu);
        let fused = Self {
            once: Once::new(context)?,
            kernels: BTreeMap::new(),
            // Stepping by two methods in three sizes and balancing two systems, two states each.
            pool: Pool::new(context, 16, 11)?,
            nodes: buffer(context, "network nodes", &tables.nodes)?,
            links: buffer(context, "network links", &tables.links)?,
            heat: buffer(context, "network heat", &vec![[0.0f32; 2]; nodes])?,
            stages: buffer(context, "stages", &vec![NetworkStage::zeroed(); STAGES_AT_MOST as usize])?,
            lists: buffer(context, "network lists", &lists)?,
            states: [state()?, state()?],
            work: room(context, "network work", 4 * nodes, MemoryLocation::GpuOnly)?,
            result: room(context, "network result", RESULT_WORDS, MemoryLocation::GpuToCpu)?,
            systems,
            tables,
            sensors: sensors.len() as u32,
            space_temperature: network.space_temperature as f32,
            kept: 0,
            lanes,
            counts: WorkCounts::default(),
            staged: None,
            context: Arc::clone(context),
        };
        // A balance must fit into a dispatch.
        let attempt = fused.describe(Unknowns::Arithmetic, fused.lanes);
        Ok((attempt.loops_iteration * ITERATIONS < LOOPS_AT_MOST).then_some(fused))
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
        self.heat.write(heat);
    }

    /// Base and rest of every node [K].
    pub fn state(&self) -> &[[f32; 2]] {
        self.states[self.kept].read(self.tables.nodes.len())
    }

    /// Replaces the kept state.
    pub fn set_state(&mut self, state: &[[f32; 2]]) {
        self.states[self.kept].write(state);
    }

    /// Keeps what the last try left.
    pub fn keep(&mut self) {
        self.kept = 1 - self.kept;
    }

    /// Tries some sub-steps. `None` where the method takes more than a dispatch can do.
    ///
    /// # Errors
    /// A call that fails.
    pub fn attempt(&mut self, method: Method, t: f64, step: f64, count: u32) -> Result<Option<Attempt>, GpuError> {
        let (stages, unknowns) = match method {
            Method::Euler => (1, Unknowns::Arithmetic),
            Method::Rkl2 { stages } => (stages, Unknowns::Arithmetic),
            Method::TrBdf2 => (2, Unknowns::Free),
        };
        if !self.knows(unknowns)? || stages > STAGES_AT_MOST {
            return Ok(None);
        }
        let lanes = FusedVariant::LANES.into_iter().filter(|lanes| *lanes >= self.lanes);
        let plans = lanes.filter_map(|lanes| self.plan(lanes, unknowns, stages).map(|plan| (lanes, plan)));
        let Some((lanes, (mut planned, per_dispatch))) = plans.into_iter().next() else { return Ok(None) };
        planned.step = step as f32;
        [planned.error_end, planned.error_start, planned.error_change] = error_weights(method, step);
        if method != Method::TrBdf2 && self.staged != Some((stages, step)) {
            self.stages.write(&device_stages(stages, step));
            self.staged = Some((stages, step));
        }
        let kind = match method {
            Method::TrBdf2 => FusedKind::Implicit,
            _ => FusedKind::Explicit { radiative: self.tables.radiative, elimination: !self.tables.coupled.is_empty() },
        };
        let start: Vec<[f32; 2]> = self.state().to_vec();
        self.states[1 - self.kept].write(&start);

        let mut attempt = Attempt::default();
        let room = (RESULT_WORDS - RESULT_HEAD) as u32 / 2 / self.sensors.max(1);
        let mut first = 0;
        while first < count {
            let some = (count - first).min(room).min(SUB_STEPS_AT_MOST);
            planned.time = (t + f64::from(first) * step) as f32;
            planned.count = some;
            let head = self.sub_steps((FusedVariant { kind, lanes }, unknowns), planned, per_dispatch)?;
            let error = f64::from(f32::from_bits(head));
            // NaN would vanish in `max`.
            attempt.error = if error.is_nan() { f64::INFINITY } else { attempt.error.max(error) };
            let words: &[u32] = self.result.read(RESULT_HEAD + 2 * (some * self.sensors) as usize);
            let part = |word: u32| f64::from(f32::from_bits(word));
            attempt.sensed.extend(words[RESULT_HEAD..].chunks_exact(2).map(|pair| part(pair[0]) + part(pair[1])));
            self.counts.sub_steps += u64::from(some);
            self.counts.stages += u64::from(some) * u64::from(stages);
            first += some;
        }
        Ok(Some(attempt))
    }

    /// What dispatches with so many invocations do, and how many sub-steps each; `None` where not one fits.
    fn plan(&self, lanes: u32, unknowns: Unknowns, stages: u32) -> Option<(NetworkAttempt, u32)> {
        let mut planned = self.describe(unknowns, lanes);
        let pass = self.tables.loops(&self.all(), lanes);
        let lone = self.tables.loops(&self.tables.lone, lanes) + 13 * (self.tables.lone.len() as u32).div_ceil(lanes);
        planned.loops_sub_step = (stages + 3) * (pass + lone + 4) + planned.sensors + 8;
        planned.stages = stages;
        let newtons = if planned.unknowns == 0 { 0 } else { 3 * stages + 3 };
        let sub_step = planned.loops_sub_step + newtons * planned.loops_iteration;
        if planned.loops_sub_step + sub_step.max(9 * planned.loops_iteration) > LOOPS_AT_MOST {
            return None;
        }
        let per_dispatch = (LOOPS_AT_MOST - planned.loops_sub_step) / sub_step;
        Some((planned, per_dispatch))
    }

    /// Runs dispatches until all sub-steps of a submission's plan are done. Returns the bits of the largest error.
    fn sub_steps(
        &mut self,
        (variant, unknowns): (FusedVariant, Unknowns),
        planned: NetworkAttempt,
        per_dispatch: u32,
    ) -> Result<u32, GpuError> {
        let state = 1 - self.kept;
        self.make_kernel(variant, unknowns)?;
        if let Some(system) = self.systems.get_mut(&unknowns) {
            system.attempts[1].write(&[planned]);
        }
        self.result.write(&[0u32, 0, 0, 0]);
        loop {
            let done = self.result.read::<u32>(1)[0];
            if done >= planned.count {
                break;
            }
            let dispatches = (planned.count - done).div_ceil(per_dispatch.max(1));
            self.submit((variant, unknowns), state, dispatches)?;
            let head: &[u32] = self.result.read(RESULT_HEAD);
            if head[0] == done {
                // Not one sub-step fits: Newton's method took all turns.
                return Ok(f32::INFINITY.to_bits());
            }
        }
        let head: &[u32] = self.result.read(RESULT_HEAD);
        self.counts.iterations += u64::from(head[2]);
        Ok(head[1])
    }

    fn all(&self) -> Vec<u32> {
        (0..self.tables.nodes.len() as u32).collect()
    }

    fn submit(&mut self, key: (FusedVariant, Unknowns), state: usize, dispatches: u32) -> Result<(), GpuError> {
        let kernel = &self.kernels[&key];
        let (pipeline, set) = (&kernel.pipeline, kernel.sets[state]);
        self.once.run(|device, commands| {
            let storage = vk::AccessFlags2::SHADER_STORAGE_READ | vk::AccessFlags2::SHADER_STORAGE_WRITE;
            let memory = [vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
                .src_access_mask(vk::AccessFlags2::SHADER_STORAGE_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::HOST | vk::PipelineStageFlags2::COMPUTE_SHADER)
                .dst_access_mask(vk::AccessFlags2::HOST_READ | storage)];
            let dependency = vk::DependencyInfo::default().memory_barriers(&memory);
            // SAFETY: pipeline, set and buffers live until `run` has waited.
            unsafe {
                device.cmd_bind_pipeline(commands, pipeline.bind_point, pipeline.raw);
                device.cmd_bind_descriptor_sets(commands, pipeline.bind_point, pipeline.layout, 0, &[set], &[]);
                for _ in 0..dispatches {
                    device.cmd_dispatch(commands, 1, 1, 1);
                    device.cmd_pipeline_barrier2(commands, &dependency);
                }
            }
        })?;
        self.counts.dispatches += u64::from(dispatches);
        Ok(())
    }

    /// What every dispatch of a system says.
    fn describe(&self, unknowns: Unknowns, lanes: u32) -> NetworkAttempt {
        let mut attempt = NetworkAttempt {
            nodes: self.tables.nodes.len() as u32,
            sensors: self.sensors,
            lone: self.tables.lone.len() as u32,
            space_temperature: self.space_temperature,
            ..NetworkAttempt::zeroed()
        };
        if let Some(system) = self.systems.get(&unknowns) {
            system.schedule.describe(&mut attempt, &self.tables, lanes);
        }
        attempt
    }

    /// Makes the system on first use. Returns whether it is small enough.
    fn knows(&mut self, unknowns: Unknowns) -> Result<bool, GpuError> {
        if !self.systems.contains_key(&unknowns) {
            let Some(schedule) = Schedule::new(&self.tables, &self.tables.free) else { return Ok(false) };
            self.systems.insert(unknowns, System::new(&self.context, schedule)?);
        }
        let attempt = self.describe(unknowns, self.lanes);
        Ok(attempt.unknowns == 0 || attempt.loops_iteration * ITERATIONS < LOOPS_AT_MOST)
    }

    fn make_kernel(&mut self, variant: FusedVariant, unknowns: Unknowns) -> Result<(), GpuError> {
        if self.kernels.contains_key(&(variant, unknowns)) {
            return Ok(());
        }
        let system = &self.systems[&unknowns];
        let attempt = &system.attempts[usize::from(variant.kind != FusedKind::Settle)];
        let bindings: Vec<_> = (0..11).map(|binding| (binding, vk::DescriptorType::STORAGE_BUFFER)).collect();
        let pipeline = Pipeline::compute(&self.context, &variant.shader(), &bindings, 0)?;
        let mut sets = [vk::DescriptorSet::null(); 2];
        for (set, state) in sets.iter_mut().zip(&self.states) {
            *set = allocate_set(&self.context, self.pool.raw, pipeline.set_layout)?;
            let buffers = [
                attempt,
                &self.nodes,
                &self.links,
                &self.heat,
                &self.stages,
                &self.lists,
                state,
                &self.work,
                &self.result,
                &system.words,
                &system.matrix,
            ];
            write_set(&self.context, *set, (0..).zip(buffers));
        }
        self.kernels.insert((variant, unknowns), Kernel { sets, pipeline });
        Ok(())
    }
}

/// Invocations of the workgroup: as many as there is work for; on a processor, where each eight of them take turns, fewer.
fn lanes_for(nodes: usize, processor: bool) -> u32 {
    let few = if processor { 64 } else { 8 };
    match nodes {
        _ if nodes <= few => 8,
        _ if nodes <= 256 || processor => 64,
        _ => 256,
    }
}
