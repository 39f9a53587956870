//! What a device can do at best: how fast it copies, and what a dispatch costs that does nothing.

use std::sync::Arc;
use std::time::Instant;

use ash::vk;
use gpu_allocator::MemoryLocation;

use super::context::Context;
use super::error::GpuError;
use super::memory::Buffer;
use super::once::Once;
use super::pass::{COMPUTE_WRITE, scope};
use super::pipeline::Pipeline;
use super::shaders::Shader;

/// Runs before any is timed: drivers compile and page in lazily.
const WARM_UP: usize = 3;

/// What a run took, once for every sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Samples {
    /// By the device's own clock [ms]; empty on a queue without timestamps.
    pub device_ms: Vec<f64>,
    /// From its recording until the host knows that it is done [ms].
    pub wall_ms: Vec<f64>,
}

fn sampled(
    once: &mut Once,
    samples: usize,
    record: impl Fn(&ash::Device, vk::CommandBuffer),
) -> Result<Samples, GpuError> {
    for _ in 0..WARM_UP {
        once.run(&record)?;
    }
    let mut device_ms = Vec::with_capacity(samples);
    let mut wall_ms = Vec::with_capacity(samples);
    for _ in 0..samples {
        let (began, before) = (Instant::now(), once.device_ms().unwrap_or(0.0));
        once.run(&record)?;
        wall_ms.push(began.elapsed().as_secs_f64() * 1e3);
        device_ms.extend(once.device_ms().map(|now| now - before));
    }
    Ok(Samples { device_ms, wall_ms })
}

/// Copies `bytes` from one device buffer to another.
///
/// # Errors
/// No memory, or a call that fails.
pub fn copies(context: &Arc<Context>, bytes: u64, samples: usize) -> Result<Samples, GpuError> {
    let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
    let buffer = |name: &str| Buffer::new(context, name, bytes, usage, MemoryLocation::GpuOnly);
    let (from, to) = (buffer("copied from")?, buffer("copied to")?);
    let mut once = Once::new(context)?;
    once.run(|device, commands| {
        // SAFETY: the buffer may be a transfer destination and lives until `run` has waited.
        unsafe { device.cmd_fill_buffer(commands, from.raw, 0, vk::WHOLE_SIZE, 0x3f80_0000) };
    })?;
    let copy = [vk::BufferCopy { src_offset: 0, dst_offset: 0, size: bytes }];
    sampled(&mut once, samples, |device, commands| {
        // SAFETY: both buffers are as long as the copy says and live until `run` has waited; runs follow each other.
        unsafe { device.cmd_copy_buffer(commands, from.raw, to.raw, &copy) };
    })
}

/// Runs `dispatches` dispatches of one workgroup that does nothing, with a barrier between any two.
///
/// # Errors
/// A call that fails.
pub fn empty_dispatches(context: &Arc<Context>, dispatches: u32, samples: usize) -> Result<Samples, GpuError> {
    let pipeline = Pipeline::compute(context, &Shader::new("empty.comp", Vec::new()), &[], 0)?;
    let both = vk::AccessFlags2::SHADER_STORAGE_READ | vk::AccessFlags2::SHADER_STORAGE_WRITE;
    let after = scope(vk::PipelineStageFlags2::COMPUTE_SHADER, both);
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(COMPUTE_WRITE.stage)
        .src_access_mask(COMPUTE_WRITE.access)
        .dst_stage_mask(after.stage)
        .dst_access_mask(after.access)];
    let mut once = Once::new(context)?;
    sampled(&mut once, samples, |device, commands| {
        let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
        // SAFETY: the pipeline, which binds nothing, lives until `run` has waited.
        unsafe {
            device.cmd_bind_pipeline(commands, pipeline.bind_point, pipeline.raw);
            for number in 0..dispatches {
                if number > 0 {
                    device.cmd_pipeline_barrier2(commands, &dependency);
                }
                device.cmd_dispatch(commands, 1, 1, 1);
            }
        }
    })
}
