//! Band radiance of a blackbody and its inverse, computed on the device for a list of numbers.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;

use super::buffer_set::{BufferSet, binding_types};
use super::context::Context;
use super::error::GpuError;
use super::layout;
use super::memory::Buffer;
use super::once::Once;
use super::pipeline::Pipeline;
use super::shaders::Shader;
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

/// Runs an entry point that turns a list into a list of the same length: tables at binding 0 and from 3, input 1, output 2.
fn map(
    context: &Arc<Context>,
    entry: &'static str,
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
    let pipeline = Pipeline::compute(context, &Shader::new(entry, Vec::new()), &binding_types(&buffers), 0)?;
    let set = BufferSet::new(context, pipeline.set_layout, &buffers)?;
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
            device.cmd_bind_descriptor_sets(commands, pipeline.bind_point, pipeline.layout, 0, &[set.raw], &[]);
            device.cmd_dispatch(commands, (padded.len() / WORKGROUP) as u32, 1, 1);
            device.cmd_pipeline_barrier2(commands, &dependency);
        }
    })?;
    Ok(buffers[2].1.read::<f32>(input.len()).to_vec())
}
