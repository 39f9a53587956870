//! Band radiance of a blackbody and its inverse, computed on the device for a list of numbers.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;

use super::bindings::allocate_set;
use super::context::Context;
use super::error::{Context as _, GpuError};
use super::layout;
use super::memory::Buffer;
use super::once::Once;
use super::pipeline::Pipeline;
use crate::thermal::brightness::BrightnessTable;
use crate::thermal::radiance::RadianceTable;
use crate::thermal::radiance_f32::RadianceTableF32;

const WORKGROUP: usize = 64;

/// The table of a band as the shader reads it: its head, then ln G with the guards.
pub fn band_table(table: &RadianceTableF32) -> Vec<f32> {
    let head = layout::Band { edge_high: table.edge_high, edge_low: table.edge_low };
    let mut values: Vec<f32> = bytemuck::cast_slice(&[head]).to_vec();
    values.extend_from_slice(&table.values);
    values
}

/// Radiance of a blackbody [W m-2 sr-1] at each temperature [K].
///
/// # Errors
/// A call that fails.
pub fn band_radiances(
    context: &Arc<Context>,
    table: &RadianceTable,
    guesses: &BrightnessTable,
    temperatures: &[f32],
) -> Result<Vec<f32>, GpuError> {
    let table = RadianceTableF32::new(table, guesses);
    map(context, "blackbody.comp", &[&band_table(&table)], temperatures, 300.0)
}

/// Temperature [K] of a blackbody of each radiance [W m-2 sr-1], every one between the floor and the ceiling that
/// `BrightnessTable::check` knows.
///
/// # Errors
/// A call that fails.
pub fn brightness_temperatures(
    context: &Arc<Context>,
    table: &RadianceTable,
    guesses: &BrightnessTable,
    radiances: &[f32],
) -> Result<Vec<f32>, GpuError> {
    let table = RadianceTableF32::new(table, guesses);
    let filler = guesses.max_radiance as f32;
    map(context, "brightness.comp", &[&band_table(&table), &table.inverse_temperatures], radiances, filler)
}

/// Runs a module that turns a list into a list of the same length: tables at binding 0 and from 3, input 1, output 2.
fn map(
    context: &Arc<Context>,
    module: &str,
    tables: &[&[f32]],
    input: &[f32],
    filler: f32,
) -> Result<Vec<f32>, GpuError> {
    let mut padded = input.to_vec();
    padded.resize(input.len().next_multiple_of(WORKGROUP).max(WORKGROUP), filler);
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
    let host = |name: &str, values: &[f32], location| -> Result<Buffer, GpuError> {
        let mut buffer = Buffer::new(context, name, size_of_val(values) as u64, usage, location)?;
        buffer.write(values);
        Ok(buffer)
    };
    let mut buffers = vec![
        (0, host("table", tables[0], MemoryLocation::CpuToGpu)?),
        (1, host("input", &padded, MemoryLocation::CpuToGpu)?),
        (2, host("output", &padded, MemoryLocation::GpuToCpu)?),
    ];
    for (binding, table) in (3..).zip(&tables[1..]) {
        buffers.push((binding, host("table", table, MemoryLocation::CpuToGpu)?));
    }
    let bindings: Vec<_> = buffers.iter().map(|(binding, _)| (*binding, vk::DescriptorType::STORAGE_BUFFER)).collect();
    let pipeline = Pipeline::compute(context, module, &super::pipeline::module(module), &bindings)?;

    let pool = DescriptorPool::new(context, buffers.len() as u32)?;
    let set = allocate_set(context, pool.raw, pipeline.set_layout)?;
    for (binding, buffer) in &buffers {
        let infos = [vk::DescriptorBufferInfo { buffer: buffer.raw, offset: 0, range: vk::WHOLE_SIZE }];
        let write = [vk::WriteDescriptorSet::default()
            .dst_set(set)
            .dst_binding(*binding)
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .buffer_info(&infos)];
        // SAFETY: set and buffer are alive, and nothing uses the set yet.
        unsafe { context.device.update_descriptor_sets(&write, &[]) };
    }
    let mut once = Once::new(context)?;
    once.run(|device, commands| {
        let to_host = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
            .src_access_mask(vk::AccessFlags2::SHADER_STORAGE_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&to_host);
        // SAFETY: pipeline, set and buffers live until `run` has waited; the buffers hold whole workgroups.
        unsafe {
            device.cmd_bind_pipeline(commands, pipeline.bind_point, pipeline.raw);
            device.cmd_bind_descriptor_sets(commands, pipeline.bind_point, pipeline.layout, 0, &[set], &[]);
            device.cmd_dispatch(commands, (padded.len() / WORKGROUP) as u32, 1, 1);
            device.cmd_pipeline_barrier2(commands, &dependency);
        }
    })?;
    Ok(buffers[2].1.read::<f32>(input.len()).to_vec())
}

/// A pool of one set of storage buffers.
pub(super) struct DescriptorPool<'a> {
    context: &'a Context,
    pub(super) raw: vk::DescriptorPool,
}

impl<'a> DescriptorPool<'a> {
    /// For a set of so many buffers.
    pub(super) fn new(context: &'a Context, buffers: u32) -> Result<Self, GpuError> {
        let sizes = [vk::DescriptorPoolSize { ty: vk::DescriptorType::STORAGE_BUFFER, descriptor_count: buffers }];
        let create = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: the device is alive.
        let raw =
            unsafe { context.device.create_descriptor_pool(&create, None) }.during("creating a descriptor pool")?;
        Ok(Self { context, raw })
    }
}

impl Drop for DescriptorPool<'_> {
    fn drop(&mut self) {
        // SAFETY: what used its sets was waited for.
        unsafe { self.context.device.destroy_descriptor_pool(self.raw, None) };
    }
}
