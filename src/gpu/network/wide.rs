//! A large network on the device: every stage is a dispatch over all nodes.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;

use super::frame::{AT_START, WidePlan};
use super::fused::{Pool, device_stages, error_weights};
use super::tables::Tables;
use crate::gpu::bindings::allocate_set;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::frame::Frame;
use crate::gpu::layout::{NetworkPass, NetworkStage};
use crate::gpu::memory::Buffer;
use crate::gpu::once::Once;
use crate::gpu::pass::{NetworkWork, Resource, Step, Work};
use crate::gpu::pipeline::{Pipeline, module};
use crate::gpu::variant::{WideKind, WideVariant};
use crate::thermal::network::Network;
use crate::thermal::network::stepper::{Attempt, Method, WorkCounts};

/// Invocations of a workgroup, and nodes whose errors one invocation reduces.
const WORKGROUP: usize = 64;
/// Nodes of one dispatch: 65,535 workgroups.
pub const NODES_AT_MOST: usize = 65_535 * WORKGROUP;
/// Links of one node: some drivers end a shader's loops after 65,535 turns.
pub const LINKS_AT_MOST: usize = 60_000;
/// Sub-steps of one submission.
const SUB_STEPS_AT_MOST: u32 = 64;
/// Bindings of glsl/network_wide.comp.
const BINDINGS: u32 = 10;

/// Buffers and kernels of a large network. Fields are dropped in order.
pub struct Wide {
    once: Once,
    pipelines: BTreeMap<WideVariant, (Pipeline, [vk::DescriptorSet; 2])>,
    _pool: Pool,
    nodes: Buffer,
    links: Buffer,
    heat: Buffer,
    lists: Buffer,
    buffers: BTreeMap<Resource, Buffer>,
    context: Arc<Context>,
    count: usize,
    sensors: usize,
    lone: usize,
    plan: WidePlan,
    space_temperature: f32,
    /// Where the last try left its rests.
    odd: bool,
    counts: WorkCounts,
}

/// What the passes of a submission say.
struct Constants {
    stages: Vec<NetworkStage>,
    weights: [f32; 3],
    /// Start of the first sub-step [s], and the length of one.
    time: f64,
    step: f64,
}

impl Wide {
    /// Uploads the network.
    ///
    /// # Errors
    /// More than the device holds, or a call that fails.
    pub fn new(context: &Arc<Context>, network: &Network, tables: &Tables, sensors: &[u32]) -> Result<Self, GpuError> {
        let mut once = Once::new(context)?;
        let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let copied = storage | vk::BufferUsageFlags::TRANSFER_DST | vk::BufferUsageFlags::TRANSFER_SRC;
        let count = network.len();
        let mut filled = |name: &str, bytes: &[u8]| -> Result<Buffer, GpuError> {
            let buffer = Buffer::new(context, name, bytes.len() as u64, copied, MemoryLocation::GpuOnly)?;
            once.upload(&buffer, bytes)?;
            Ok(buffer)
        };
        let nodes = filled("network nodes", bytemuck::cast_slice(&tables.nodes))?;
        let links = filled("network links", bytemuck::cast_slice(&tables.links))?;
        let lists: Vec<u32> = sensors.iter().chain(&tables.lone).copied().collect();
        let lists = filled("network lists", bytemuck::cast_slice(&lists))?;
        once.free_staging();
        let mut heat = Buffer::new(context, "network heat", 8 * count as u64, storage, MemoryLocation::CpuToGpu)?;
        heat.write(&vec![[0.0f32; 2]; count]);
        let mut buffers = BTreeMap::new();
        let (device, to_host) = (MemoryLocation::GpuOnly, MemoryLocation::GpuToCpu);
        let sensed = 2 * sensors.len() * SUB_STEPS_AT_MOST as usize;
        for (resource, words, location) in [
            (Resource::NetworkKeptBase, count, to_host),
            (Resource::NetworkKeptRest, count, to_host),
            (Resource::NetworkBase, count, device),
            (Resource::NetworkRestEven, count, device),
            (Resource::NetworkRestOdd, count, device),
            (Resource::NetworkWork, 4 * count, device),
            (Resource::NetworkErrors, count.div_ceil(WORKGROUP), to_host),
            (Resource::NetworkSensed, sensed, to_host),
        ] {
            let name = format!("{resource:?}");
            buffers.insert(resource, Buffer::new(context, &name, 4 * words as u64, copied, location)?);
        }
        let pool = Pool::new(context, 14, BINDINGS)?;
        let plan = WidePlan {
            radiative: tables.radiative,
            lone: !tables.lone.is_empty(),
            sensors: !sensors.is_empty(),
            stages: 1,
        };
        let mut wide = Self {
            once,
            pipelines: BTreeMap::new(),
            _pool: pool,
            nodes,
            links,
            heat,
            lists,
            buffers,
            context: Arc::clone(context),
            count,
            sensors: sensors.len(),
            lone: tables.lone.len(),
            plan,
            space_temperature: network.space_temperature as f32,
            odd: false,
            counts: WorkCounts::default(),
        };
        for kind in [
            WideKind::Begin,
            WideKind::First,
            WideKind::Stage,
            WideKind::Lone,
            WideKind::Last,
            WideKind::Reduce,
            WideKind::Sense,
        ] {
            wide.make_pipeline(WideVariant::of(kind, tables.radiative))?;
        }
        Ok(wide)
    }

    fn make_pipeline(&mut self, variant: WideVariant) -> Result<(), GpuError> {
        let types: Vec<_> = (0..BINDINGS).map(|binding| (binding, vk::DescriptorType::STORAGE_BUFFER)).collect();
        let constants = size_of::<NetworkPass>() as u32;
        let pipeline = Pipeline::compute_with_constants(
            &self.context,
            &variant.name(),
            &module(&variant.name()),
            &types,
            constants,
        )?;
        let mut sets = [vk::DescriptorSet::null(); 2];
        for (odd, set) in sets.iter_mut().enumerate() {
            *set = allocate_set(&self.context, self._pool.raw, pipeline.set_layout)?;
            let (present, next) = if odd == 1 {
                (Resource::NetworkRestOdd, Resource::NetworkRestEven)
            } else {
                (Resource::NetworkRestEven, Resource::NetworkRestOdd)
            };
            let of = |resource| &self.buffers[&resource];
            let buffers = [
                &self.nodes,
                &self.links,
                &self.heat,
                of(Resource::NetworkBase),
                of(present),
                of(next),
                of(Resource::NetworkWork),
                &self.lists,
                of(Resource::NetworkErrors),
                of(Resource::NetworkSensed),
            ];
            for (binding, buffer) in (0..).zip(buffers) {
                let infos = [vk::DescriptorBufferInfo { buffer: buffer.raw, offset: 0, range: vk::WHOLE_SIZE }];
                let write = [vk::WriteDescriptorSet::default()
                    .dst_set(*set)
                    .dst_binding(binding)
                    .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                    .buffer_info(&infos)];
                // SAFETY: set and buffer are alive, and nothing uses the set yet.
                unsafe { self.context.device.update_descriptor_sets(&write, &[]) };
            }
        }
        self.pipelines.insert(variant, (pipeline, sets));
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
        self.heat.write(heat);
    }

    /// Base and rest of every node [K].
    pub fn state(&self) -> Vec<[f32; 2]> {
        let [base, rest] =
            [Resource::NetworkKeptBase, Resource::NetworkKeptRest].map(|resource| &self.buffers[&resource]);
        base.read(self.count).iter().zip(rest.read(self.count)).map(|(base, rest)| [*base, *rest]).collect()
    }

    /// Replaces the kept state.
    pub fn set_state(&mut self, state: &[[f32; 2]]) {
        for (part, resource) in [Resource::NetworkKeptBase, Resource::NetworkKeptRest].into_iter().enumerate() {
            let values: Vec<f32> = state.iter().map(|pair| pair[part]).collect();
            if let Some(buffer) = self.buffers.get_mut(&resource) {
                buffer.write(&values);
            }
        }
    }

    /// Keeps what the last try left.
    ///
    /// # Errors
    /// A call that fails.
    pub fn keep(&mut self) -> Result<(), GpuError> {
        let constants = Constants { stages: device_stages(1, 0.0), weights: [0.0; 3], time: 0.0, step: 0.0 };
        self.submit(&[WidePlan::keep(self.odd)], &constants, 0)
    }

    /// Balances the arithmetic nodes.
    ///
    /// # Errors
    /// A call that fails.
    pub fn balance(&mut self, t: f64) -> Result<bool, GpuError> {
        if self.lone == 0 {
            return Ok(true);
        }
        let constants = Constants { stages: device_stages(1, 0.0), weights: [0.0; 3], time: t, step: 0.0 };
        self.odd = false;
        self.submit(&[self.plan.start(), self.plan.end()], &constants, 0)?;
        self.keep()?;
        Ok(self.state().iter().flatten().all(|part| part.is_finite()))
    }

    /// Tries some sub-steps.
    ///
    /// # Errors
    /// A call that fails.
    pub fn attempt(&mut self, method: Method, t: f64, step: f64, count: u32) -> Result<Attempt, GpuError> {
        let stages = match method {
            Method::Rkl2 { stages } => stages,
            Method::Euler | Method::TrBdf2 => 1,
        };
        self.plan.stages = stages;
        let mut constants =
            Constants { stages: device_stages(stages, step), weights: error_weights(method, step), time: t, step };
        self.odd = false;
        let mut attempt = Attempt::default();
        for first in (0..count).step_by(SUB_STEPS_AT_MOST as usize) {
            let some = (count - first).min(SUB_STEPS_AT_MOST);
            let mut frames = if first == 0 { vec![self.plan.start()] } else { Vec::new() };
            for number in 0..some {
                let (frame, odd) = self.plan.sub_step(number, self.odd);
                self.odd = odd;
                frames.push(frame);
            }
            frames.push(self.plan.end());
            constants.time = t + f64::from(first) * step;
            self.submit(&frames, &constants, some)?;
            let sensed: &[[f32; 2]] = self.buffers[&Resource::NetworkSensed].read(self.sensors * some as usize);
            attempt.sensed.extend(sensed.iter().map(|[base, rest]| f64::from(*base) + f64::from(*rest)));
            self.counts.sub_steps += u64::from(some);
            self.counts.stages += u64::from(some) * u64::from(stages);
        }
        let errors: &[u32] = self.buffers[&Resource::NetworkErrors].read(self.count.div_ceil(WORKGROUP));
        let largest = f32::from_bits(errors.iter().max().copied().unwrap_or(0));
        attempt.error = if largest.is_nan() { f64::INFINITY } else { f64::from(largest) };
        Ok(attempt)
    }

    /// Records and runs some frames one after the other.
    fn submit(&mut self, frames: &[Frame], constants: &Constants, sub_steps: u32) -> Result<(), GpuError> {
        debug_assert!(sub_steps <= SUB_STEPS_AT_MOST);
        let mut dispatches = 0;
        let Self { once, pipelines, buffers, count, sensors, lone, space_temperature, .. } = self;
        once.run(|device, commands| {
            for step in frames.iter().flat_map(|frame| &frame.steps) {
                match step {
                    Step::Barriers(barriers) => {
                        let barriers: Vec<_> = barriers
                            .iter()
                            .map(|barrier| {
                                vk::BufferMemoryBarrier2::default()
                                    .src_stage_mask(barrier.before.stage)
                                    .src_access_mask(barrier.before.access)
                                    .dst_stage_mask(barrier.after.stage)
                                    .dst_access_mask(barrier.after.access)
                                    .buffer(buffers[&barrier.resource].raw)
                                    .size(vk::WHOLE_SIZE)
                            })
                            .collect();
                        let dependency = vk::DependencyInfo::default().buffer_memory_barriers(&barriers);
                        // SAFETY: the buffers belong to this network.
                        unsafe { device.cmd_pipeline_barrier2(commands, &dependency) };
                    }
                    Step::Pass(pass) => match pass.work {
                        Work::Network(work) => {
                            let (pipeline, sets) = &pipelines[&work.variant];
                            let sizes = Sizes { count: *count, sensors: *sensors, lone: *lone };
                            let said = constants.of(work, &sizes, *space_temperature);
                            let set = sets[usize::from(work.odd)];
                            dispatches += 1;
                            // SAFETY: pipeline, set and buffers live until `run` has waited; invocations beyond the
                            // last return at once.
                            unsafe {
                                let point = pipeline.bind_point;
                                device.cmd_bind_pipeline(commands, point, pipeline.raw);
                                device.cmd_bind_descriptor_sets(commands, point, pipeline.layout, 0, &[set], &[]);
                                let stages = vk::ShaderStageFlags::COMPUTE;
                                let bytes = bytemuck::bytes_of(&said);
                                device.cmd_push_constants(commands, pipeline.layout, stages, 0, bytes);
                                device.cmd_dispatch(commands, said.count.div_ceil(WORKGROUP as u32), 1, 1);
                            }
                        }
                        Work::Copy { from, to } => {
                            let (from, to) = (&buffers[&from], &buffers[&to]);
                            let size = from.bytes.min(to.bytes);
                            let copy = [vk::BufferCopy { src_offset: 0, dst_offset: 0, size }];
                            // SAFETY: the copy stays within both buffers.
                            unsafe { device.cmd_copy_buffer(commands, from.raw, to.raw, &copy) };
                        }
                        Work::Clear(resource) => {
                            let raw = buffers[&resource].raw;
                            // SAFETY: the buffer may be a transfer destination.
                            unsafe { device.cmd_fill_buffer(commands, raw, 0, vk::WHOLE_SIZE, 0) };
                        }
                        _ => {}
                    },
                }
            }
        })?;
        self.counts.dispatches += dispatches;
        Ok(())
    }
}

/// Numbers of things.
struct Sizes {
    count: usize,
    sensors: usize,
    lone: usize,
}

impl Constants {
    /// What a pass says: its kernel knows which of the weights it has.
    fn of(&self, work: NetworkWork, sizes: &Sizes, space_temperature: f32) -> NetworkPass {
        let Sizes { count: nodes, sensors, lone } = *sizes;
        let kind = work.variant.kind;
        let start = self.time + f64::from(work.sub_step) * self.step;
        let stage = self.stages[(work.stage as usize).min(self.stages.len() - 1)];
        // A stage evaluates what the one before it left, at the time of that one.
        let evaluated = match kind {
            WideKind::Stage => self.stages[work.stage as usize - 1].time,
            _ => stage.time,
        };
        let after = if self.step == 0.0 || work.stage == AT_START { 0.0 } else { f64::from(evaluated) };
        let [at_end, at_start, change] = self.weights;
        let (mu, nu, mu_step, gamma_step) = match kind {
            WideKind::Last => (change, 0.0, at_end, at_start),
            _ => (stage.mu, stage.nu, stage.mu_step, stage.gamma_step),
        };
        let count = match kind {
            WideKind::Lone => lone,
            WideKind::Sense => sensors,
            WideKind::Reduce => nodes.div_ceil(WORKGROUP),
            _ => nodes,
        };
        NetworkPass {
            count: count as u32,
            nodes: nodes as u32,
            sensors: sensors as u32,
            sensed_at: work.sub_step * sensors as u32,
            time: (start + after) as f32,
            space_temperature,
            mu,
            nu,
            mu_step,
            gamma_step,
        }
    }
}
