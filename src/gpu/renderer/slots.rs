//! Frames in flight, each with a command buffer, a fence and timestamp queries.

use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use crate::gpu::context::Context;
use crate::gpu::error::{During as _, GpuError};
use crate::gpu::once::command_buffers;
use crate::gpu::pass::Frame;
use crate::gpu::record::Recorder;
use crate::gpu::resource::{Resource, SLOTS};
use crate::gpu::samples::Samples;
use crate::gpu::timing::{PassTimes, Timing};
use crate::trace::{self, DeviceFrame, span};

/// Frames that are timed at first where few are.
const FIRST_TIMED: u64 = 16;
/// One in so many frames is timed then.
const TIMED: u64 = 16;

/// A frame in flight or a completed one.
struct Slot {
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    timing: Timing,
    pending: bool,
    submitted: Instant,
    /// Resources that its list left to the host.
    left: Vec<&'static Resource>,
}

/// All slots, and the measured times of their passes.
pub(super) struct Slots {
    context: Arc<Context>,
    pool: vk::CommandPool,
    slots: Vec<Slot>,
    /// Number of the next slot.
    next: usize,
    /// Device time of every pass so far [ms], by name.
    pub(crate) times: PassTimes,
    /// Most samples of a pass that are kept.
    pub(crate) most_times: usize,
    /// Whether only some frames are timed: the first [`FIRST_TIMED`], then one in [`TIMED`].
    pub(crate) time_few: bool,
    /// Frames so far.
    count: u64,
    /// Names of the passes of the frames since the last take, if they are kept.
    pub(crate) names: Option<Vec<Vec<String>>>,
}

impl Slots {
    /// Slots for lists of up to `passes` passes.
    pub(crate) fn new(context: &Arc<Context>, passes: usize) -> Result<Self, GpuError> {
        let (pool, commands) = command_buffers(context, SLOTS as u32)?;
        let (context, times) = (Arc::clone(context), PassTimes::new());
        let mut slots = Self {
            context,
            pool,
            slots: Vec::new(),
            next: 0,
            times,
            most_times: usize::MAX,
            time_few: false,
            count: 0,
            names: None,
        };
        for commands in commands {
            let timing = Timing::new(&slots.context, passes)?;
            let create = vk::FenceCreateInfo::default();
            // SAFETY: the device is alive.
            let fence = unsafe { slots.context.device.create_fence(&create, None) }.during("creating a fence")?;
            let (submitted, left) = (Instant::now(), Vec::new());
            slots.slots.push(Slot { commands, fence, timing, pending: false, submitted, left });
        }
        Ok(slots)
    }

    /// Waits for the next slot, so that the host may write its buffers. Returns its number.
    pub(crate) fn free(&mut self) -> Result<usize, GpuError> {
        self.finish(self.next)?;
        Ok(self.next)
    }

    /// Records and submits a list in the next slot.
    pub(crate) fn submit<'a>(
        &mut self,
        list: &Frame,
        recorder: impl FnOnce(vk::CommandBuffer) -> Recorder<'a>,
    ) -> Result<usize, GpuError> {
        let number = self.free()?;
        let _records = span("recording a frame");
        self.next = (number + 1) % SLOTS;
        let few = self.time_few && !trace::keeps_frames();
        let timed = !few || self.count < FIRST_TIMED || self.count.is_multiple_of(TIMED);
        self.count += 1;
        let (device, slot) = (&self.context.device, &mut self.slots[number]);
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the slot's last frame is complete, so its command buffer may be recorded again.
        unsafe { device.begin_command_buffer(slot.commands, &begin) }.during("recording")?;
        slot.timing.begin_frame(slot.commands, timed);
        recorder(slot.commands).record(list, Some(&mut slot.timing));
        if let Some(names) = &mut self.names {
            names.push(list.passes().map(|pass| pass.name.clone()).collect());
        }
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(slot.commands)];
        let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
        slot.submitted = Instant::now();
        // SAFETY: the command buffer is complete, and the fence is not signalled.
        unsafe {
            device.end_command_buffer(slot.commands).during("recording")?;
            self.context.submit(&submit, slot.fence).during("submitting a frame")?;
        }
        slot.pending = true;
        slot.left = list.left_to_host().collect();
        Ok(number)
    }

    /// Whether the last list of a slot left a resource to the host.
    pub(crate) fn left(&self, number: usize, resource: &'static Resource) -> bool {
        self.slots[number].left.contains(&resource)
    }

    /// Waits for the frame of a slot.
    pub(crate) fn finish(&mut self, number: usize) -> Result<(), GpuError> {
        let slot = &mut self.slots[number];
        if slot.pending {
            let _waits = span("waiting for the device");
            // SAFETY: the fence was submitted with the slot's frame.
            unsafe {
                self.context.device.wait_for_fences(&[slot.fence], true, u64::MAX).during("waiting for a frame")?;
                self.context.device.reset_fences(&[slot.fence]).during("resetting a fence")?;
            }
            slot.pending = false;
            let passes = slot.timing.collect()?;
            for (number, name) in slot.timing.names().iter().enumerate() {
                let times = self.times.entry(name.clone()).or_insert_with(|| Samples::at_most(self.most_times));
                match passes.get(number) {
                    Some((_, _, length)) => times.push(length * 1e-6),
                    None => times.skip(),
                }
            }
            if trace::keeps_frames() {
                trace::keep_frame(DeviceFrame { submitted: slot.submitted, done: Instant::now(), passes });
            }
        }
        Ok(())
    }

    /// Waits for all frames in flight.
    pub(crate) fn wait(&mut self) -> Result<(), GpuError> {
        (0..SLOTS).try_for_each(|number| self.finish(number))
    }
}

impl Drop for Slots {
    fn drop(&mut self) {
        for number in 0..self.slots.len() {
            // A device that is lost has stopped all work.
            let _ = self.finish(number);
        }
        // SAFETY: all frames of these slots are complete. Another scene may be at work on the device.
        unsafe {
            for slot in &self.slots {
                self.context.device.destroy_fence(slot.fence, None);
            }
            self.context.device.destroy_command_pool(self.pool, None);
        }
    }
}
