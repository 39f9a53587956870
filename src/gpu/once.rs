//! Work that is submitted once and waited for: uploads, downloads, and the small compute commands.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;

use super::context::Context;
use super::error::{Context as _, GpuError};
use super::memory::Buffer;
use super::timing::Timing;

/// Bytes of the staging buffer; longer uploads go in pieces.
const STAGING_BYTES: usize = 16 << 20;

/// A command buffer that is recorded, submitted and waited for, and a staging buffer.
pub struct Once {
    context: Arc<Context>,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    staging: Option<Buffer>,
    timing: Timing,
    /// Of every run so far, by the device's own clock [ms]; `None` on a queue without timestamps.
    device_ms: Option<f64>,
}

impl Once {
    /// Makes the command buffer.
    ///
    /// # Errors
    /// A call that fails.
    pub fn new(context: &Arc<Context>) -> Result<Self, GpuError> {
        let mut once = Self {
            context: Arc::clone(context),
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            staging: None,
            timing: Timing::new(context, 1)?,
            device_ms: None,
        };
        let (pool, commands) = command_buffers(context, 1)?;
        (once.pool, once.commands) = (pool, commands[0]);
        // SAFETY: the device is alive.
        once.fence =
            unsafe { context.device.create_fence(&vk::FenceCreateInfo::default(), None) }.during("creating a fence")?;
        Ok(once)
    }

    /// Records, submits and waits.
    ///
    /// # Errors
    /// A call that fails.
    pub fn run(&mut self, record: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> Result<(), GpuError> {
        let device = &self.context.device;
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
        // SAFETY: the last run was waited for, so the command buffer and the fence are free.
        unsafe {
            device.begin_command_buffer(self.commands, &begin).during("recording")?;
            self.timing.begin_frame(self.commands);
            self.timing.begin_pass(self.commands, "run");
            record(device, self.commands);
            self.timing.end_pass(self.commands);
            device.end_command_buffer(self.commands).during("recording")?;
            device.queue_submit2(self.context.queue, &submit, self.fence).during("submitting")?;
            device.wait_for_fences(&[self.fence], true, u64::MAX).during("waiting")?;
            device.reset_fences(&[self.fence]).during("resetting a fence")?;
        }
        for (_, _, length) in self.timing.collect()? {
            *self.device_ms.get_or_insert(0.0) += length * 1e-6;
        }
        Ok(())
    }

    /// Time of all runs so far by the device's own clock [ms]; `None` on a queue without timestamps.
    pub fn device_ms(&self) -> Option<f64> {
        self.device_ms
    }

    /// Copies bytes to the start of a device buffer.
    ///
    /// # Errors
    /// A call that fails.
    pub fn upload(&mut self, target: &Buffer, bytes: &[u8]) -> Result<(), GpuError> {
        let mut staging = self.take_staging()?;
        let (device_buffer, staging_buffer) = (target.raw, staging.raw);
        let mut offset = 0;
        for piece in bytes.chunks(STAGING_BYTES) {
            staging.write(piece);
            let copy = [vk::BufferCopy { src_offset: 0, dst_offset: offset, size: piece.len() as u64 }];
            self.run(|device, commands| {
                // What is submitted later reads the copy; the fence alone does not make it visible there.
                let memory = [vk::MemoryBarrier2::default()
                    .src_stage_mask(vk::PipelineStageFlags2::COPY)
                    .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                    .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                    .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)];
                let dependency = vk::DependencyInfo::default().memory_barriers(&memory);
                // SAFETY: both buffers are alive and as long as the copy says.
                unsafe {
                    device.cmd_copy_buffer(commands, staging_buffer, device_buffer, &copy);
                    device.cmd_pipeline_barrier2(commands, &dependency);
                }
            })?;
            offset += piece.len() as u64;
        }
        self.staging = Some(staging);
        Ok(())
    }

    /// The first `count` values of a device buffer.
    ///
    /// # Errors
    /// A call that fails.
    pub fn download<T: bytemuck::Pod>(&mut self, from: &Buffer, count: usize) -> Result<Vec<T>, GpuError> {
        let bytes = (count * size_of::<T>()) as u64;
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let to = Buffer::new(&self.context, "download", bytes, usage, MemoryLocation::GpuToCpu)?;
        let (device_buffer, host_buffer) = (from.raw, to.raw);
        let copy = [vk::BufferCopy { src_offset: 0, dst_offset: 0, size: bytes }];
        self.run(|device, commands| {
            // SAFETY: both buffers are alive and as long as the copy says; the fence orders the host after it.
            unsafe { device.cmd_copy_buffer(commands, device_buffer, host_buffer, &copy) };
        })?;
        Ok(to.read(count).to_vec())
    }

    fn take_staging(&mut self) -> Result<Buffer, GpuError> {
        if let Some(staging) = self.staging.take() {
            return Ok(staging);
        }
        let usage = vk::BufferUsageFlags::TRANSFER_SRC;
        Buffer::new(&self.context, "staging", STAGING_BYTES as u64, usage, MemoryLocation::CpuToGpu)
    }

    /// Forgets the staging buffer, which only the filling of a scene needs.
    pub fn free_staging(&mut self) {
        self.staging = None;
    }
}

impl Drop for Once {
    fn drop(&mut self) {
        // SAFETY: every run was waited for; null handles may be destroyed.
        unsafe {
            self.context.device.destroy_fence(self.fence, None);
            self.context.device.destroy_command_pool(self.pool, None);
        }
    }
}

/// A pool and its command buffers, each to be reset alone.
pub(super) fn command_buffers(
    context: &Context,
    count: u32,
) -> Result<(vk::CommandPool, Vec<vk::CommandBuffer>), GpuError> {
    let create = vk::CommandPoolCreateInfo::default()
        .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER)
        .queue_family_index(context.queue_family);
    // SAFETY: the device is alive, and the family is the queue's.
    let pool = unsafe { context.device.create_command_pool(&create, None) }.during("creating a command pool")?;
    let allocate = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(count);
    // SAFETY: the pool was just made.
    match unsafe { context.device.allocate_command_buffers(&allocate) } {
        Ok(commands) => Ok((pool, commands)),
        Err(result) => {
            // SAFETY: nothing was allocated from it.
            unsafe { context.device.destroy_command_pool(pool, None) };
            Err(GpuError::Call { call: "allocating command buffers", result })
        }
    }
}
