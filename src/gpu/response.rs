//! The response of nodes to given targets, computed on the device by the transition that the thermal step takes.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;

use super::buffer_set::{BufferSet, binding_types};
use super::compile::compile_own;
use super::context::Context;
use super::error::GpuError;
use super::layout;
use super::memory::Buffer;
use super::once::Once;
use super::pipeline::{Pipeline, module};
use super::shapes::{Shapes, curve};
use super::variant::{Curve, ResponseVariant};
use crate::thermal::material::Transition;

/// Nodes that the shader's workgroup takes: 64 invocations of four.
const NODES: usize = 256;
/// Steps of one dispatch: not so many that a driver takes it for one that hangs.
const STEPS: usize = 128;

/// A node that starts at rest, and what is commanded of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Temperature at step 0 [K].
    pub initial: f32,
    /// Target of each step from 1 [K].
    pub targets: Vec<f32>,
}

/// Temperatures [K] at the steps from 1 of every run, as long as the run's targets.
///
/// # Errors
/// More than the device holds, or a call that fails.
pub fn respond(context: &Arc<Context>, transition: &Transition, runs: &[Run]) -> Result<Vec<Vec<f32>>, GpuError> {
    let steps = runs.iter().map(|run| run.targets.len()).max().unwrap_or(0);
    let nodes = runs.len().next_multiple_of(NODES);
    let mut device = Device::new(context, transition, runs, nodes)?;
    let mut temperatures: Vec<Vec<f32>> = runs.iter().map(|run| Vec::with_capacity(run.targets.len())).collect();
    for first in (0..steps).step_by(STEPS) {
        let count = STEPS.min(steps - first);
        let mut commanded = vec![0.0f32; count * nodes];
        for (node, run) in runs.iter().enumerate() {
            // A run that is over stays at its last target.
            let last = run.targets.last().copied().unwrap_or(run.initial);
            for step in 0..count {
                commanded[step * nodes + node] = run.targets.get(first + step).copied().unwrap_or(last);
            }
        }
        let found = device.steps(&commanded, count, nodes)?;
        for (node, run) in runs.iter().enumerate() {
            let taken = count.min(run.targets.len().saturating_sub(first));
            temperatures[node].extend((0..taken).map(|step| found[step * nodes + node]));
        }
    }
    Ok(temperatures)
}

/// Pipeline, buffers by binding, and their descriptor set. Fields are dropped in order.
struct Device<'a> {
    once: Once,
    set: BufferSet<'a>,
    pipeline: Pipeline,
    buffers: Vec<(u32, Buffer)>,
}

/// Bindings of glsl/response.comp.
const STEPS_BINDING: u32 = 0;
const COMMANDED: u32 = 1;
const MATERIALS: u32 = 3;
const TARGET: u32 = 8;
const SPAN: u32 = 9;
const ELAPSED: u32 = 10;
const TEMPERATURE: u32 = 11;
const SHAPES: u32 = 12;

impl<'a> Device<'a> {
    fn new(context: &'a Arc<Context>, transition: &Transition, runs: &[Run], nodes: usize) -> Result<Self, GpuError> {
        let shapes = Shapes::one(transition);
        let (kind, curve) = curve(transition);
        let variant = ResponseVariant { kind, curve };
        let mut material: layout::Material = bytemuck::Zeroable::zeroed();
        material.set_transition(transition, &shapes);
        let mut at_rest: Vec<f32> = runs.iter().map(|run| run.initial).collect();
        at_rest.resize(nodes, 0.0);

        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let empty =
            |name: &str, values: usize, location| Buffer::new(context, name, 4 * values as u64, usage, location);
        let mut buffers = vec![
            (STEPS_BINDING, empty("steps", 2, MemoryLocation::CpuToGpu)?),
            (COMMANDED, empty("commanded", STEPS * nodes, MemoryLocation::CpuToGpu)?),
            (MATERIALS, empty("material", 8, MemoryLocation::CpuToGpu)?),
            (TARGET, empty("target", nodes, MemoryLocation::CpuToGpu)?),
            (SPAN, empty("span", nodes, MemoryLocation::CpuToGpu)?),
            (ELAPSED, empty("elapsed", nodes, MemoryLocation::CpuToGpu)?),
            (TEMPERATURE, empty("temperature", STEPS * nodes, MemoryLocation::GpuToCpu)?),
        ];
        if !shapes.values.is_empty() {
            buffers.push((SHAPES, empty("shapes", 4 * shapes.values.len(), MemoryLocation::CpuToGpu)?));
        }
        let zeros = vec![0.0f32; nodes];
        for (binding, buffer) in &mut buffers {
            match *binding {
                MATERIALS => buffer.write(&[material]),
                TARGET => buffer.write(&at_rest),
                SPAN | ELAPSED => buffer.write(&zeros),
                SHAPES => buffer.write(&shapes.values),
                _ => {}
            }
        }
        let name = variant.name();
        let words = match curve {
            Curve::Power => module(&name),
            Curve::Shaped { .. } => compile_own(&name, "response.comp", &variant.defines())?,
        };
        let pipeline = Pipeline::compute(context, &name, &words, &binding_types(&buffers))?;
        let set = BufferSet::new(context, pipeline.set_layout, &buffers)?;
        Ok(Self { once: Once::new(context)?, set, pipeline, buffers })
    }

    /// Takes some steps; targets and temperatures lie step after step. Waits, so the state needs no other barrier.
    fn steps(&mut self, commanded: &[f32], count: usize, nodes: usize) -> Result<&[f32], GpuError> {
        let steps = layout::Steps { count: count as u32, groups: (nodes / 4) as u32 };
        for (binding, buffer) in &mut self.buffers {
            match *binding {
                STEPS_BINDING => buffer.write(&[steps]),
                COMMANDED => buffer.write(commanded),
                _ => {}
            }
        }
        let (pipeline, set) = (&self.pipeline, self.set.raw);
        self.once.run(|device, commands| {
            let memory = [vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
                .src_access_mask(vk::AccessFlags2::SHADER_STORAGE_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::HOST | vk::PipelineStageFlags2::COMPUTE_SHADER)
                .dst_access_mask(
                    vk::AccessFlags2::HOST_READ
                        | vk::AccessFlags2::SHADER_STORAGE_READ
                        | vk::AccessFlags2::SHADER_STORAGE_WRITE,
                )];
            let dependency = vk::DependencyInfo::default().memory_barriers(&memory);
            // SAFETY: pipeline, set and buffers live until `run` has waited; the buffers hold whole workgroups.
            unsafe {
                device.cmd_bind_pipeline(commands, pipeline.bind_point, pipeline.raw);
                device.cmd_bind_descriptor_sets(commands, pipeline.bind_point, pipeline.layout, 0, &[set], &[]);
                device.cmd_dispatch(commands, (nodes / NODES) as u32, 1, 1);
                device.cmd_pipeline_barrier2(commands, &dependency);
            }
        })?;
        let temperature = self.buffers.iter().find(|(binding, _)| *binding == TEMPERATURE);
        Ok(temperature.map_or(&[], |(_, buffer)| buffer.read(count * nodes)))
    }
}
