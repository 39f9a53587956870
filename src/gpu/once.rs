//! Submissions that the host waits for: uploads, downloads, networks and small compute commands.

use std::sync::Arc;

use ash::vk;

use super::bindings::Bindings;
use super::context::Context;
use super::error::{During as _, GpuError};
use super::pass::Frame;
use super::record::Recorder;
use super::store::Resources;
use super::timing::Timing;

/// A command buffer for submissions that the host waits for.
pub(crate) struct Once {
    context: Arc<Context>,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    timing: Timing,
    /// Device time of all runs so far [ms]; `None` without timestamps.
    device_ms: Option<f64>,
}

impl Once {
    /// Makes the command buffer and its fence.
    pub(crate) fn new(context: &Arc<Context>) -> Result<Self, GpuError> {
        let mut once = Self {
            context: Arc::clone(context),
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
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

    /// Records lists in order, submits them and waits. `bindings` has the pipelines of the dispatches.
    pub(super) fn run<'f>(
        &mut self,
        lists: impl IntoIterator<Item = &'f Frame>,
        resources: &Resources,
        bindings: Option<&Bindings>,
    ) -> Result<(), GpuError> {
        let device = &self.context.device;
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
        let mut recorder = Recorder::new(&self.context, self.commands, resources, bindings);
        // SAFETY: the host waited for the last run, so the command buffer and the fence are free.
        unsafe {
            device.begin_command_buffer(self.commands, &begin).during("recording")?;
            self.timing.begin_frame(self.commands, true);
            self.timing.begin_pass(self.commands, "run");
            lists.into_iter().for_each(|list| recorder.record(list, None));
            self.timing.end_group(self.commands);
            device.end_command_buffer(self.commands).during("recording")?;
            self.context.submit(&submit, self.fence).during("submitting")?;
            device.wait_for_fences(&[self.fence], true, u64::MAX).during("waiting")?;
            device.reset_fences(&[self.fence]).during("resetting a fence")?;
        }
        for (_, _, length) in self.timing.collect()? {
            *self.device_ms.get_or_insert(0.0) += length * 1e-6;
        }
        Ok(())
    }

    /// Device time of all runs so far [ms]; `None` without timestamps.
    pub(crate) fn device_ms(&self) -> Option<f64> {
        self.device_ms
    }
}

impl Drop for Once {
    fn drop(&mut self) {
        // SAFETY: the host waited for every run. Null handles may be destroyed.
        unsafe {
            self.context.device.destroy_fence(self.fence, None);
            self.context.device.destroy_command_pool(self.pool, None);
        }
    }
}

/// Makes a command pool and command buffers that are reset separately.
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
