//! Device time of each pass, measured by timestamp queries.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use super::context::Context;
use super::error::{During as _, GpuError};
use super::samples::Samples;

/// Timestamp queries of one slot. It does nothing on a queue without timestamps.
pub struct Timing {
    context: Arc<Context>,
    pool: Option<vk::QueryPool>,
    capacity: u32,
    names: Vec<String>,
}

/// Measured times of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceFrame {
    /// Host time of the submission.
    pub submitted: Instant,
    /// Host time at which the host saw the fence.
    pub done: Instant,
    /// Name, start and duration of each pass [ns of the device clock].
    pub passes: Vec<(String, f64, f64)>,
}

/// Durations of every pass in a run [ms], by name, in order of time.
pub type PassTimes = BTreeMap<String, Samples<f64>>;

impl Timing {
    /// Makes queries for up to `passes` passes. Later ones of a frame are not measured.
    pub fn new(context: &Arc<Context>, passes: usize) -> Result<Self, GpuError> {
        let capacity = u32::try_from(2 * passes).unwrap_or(u32::MAX).max(2);
        let pool = if context.info.timestamp_period > 0.0 {
            let create = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(capacity);
            // SAFETY: the device is alive, and its queue supports timestamps.
            Some(unsafe { context.device.create_query_pool(&create, None) }.during("creating a query pool")?)
        } else {
            None
        };
        Ok(Self { context: Arc::clone(context), pool, capacity, names: Vec::new() })
    }

    pub(super) fn begin_frame(&mut self, commands: vk::CommandBuffer) {
        self.names.clear();
        if let Some(pool) = self.pool {
            // SAFETY: the host waited for the last frame of the slot.
            unsafe { self.context.device.cmd_reset_query_pool(commands, pool, 0, self.capacity) };
        }
    }

    pub(super) fn begin_pass(&mut self, commands: vk::CommandBuffer, name: &str) {
        self.stamp(commands, 2 * self.names.len());
        self.names.push(name.to_owned());
    }

    pub(super) fn end_pass(&mut self, commands: vk::CommandBuffer) {
        self.stamp(commands, 2 * self.names.len() - 1);
    }

    fn stamp(&self, commands: vk::CommandBuffer, query: usize) {
        let query = u32::try_from(query).unwrap_or(u32::MAX);
        if let Some(pool) = self.pool.filter(|_| query < self.capacity) {
            // SAFETY: the pool has two queries for each pass and was reset at the start of the frame.
            unsafe {
                self.context.device.cmd_write_timestamp2(commands, vk::PipelineStageFlags2::ALL_COMMANDS, pool, query);
            }
        }
    }

    /// Name, start and duration of the passes in the slot's last frame [ns of the device clock]. The frame must be
    /// complete.
    pub(super) fn collect(&self) -> Result<Vec<(String, f64, f64)>, GpuError> {
        let Some(pool) = self.pool else { return Ok(Vec::new()) };
        if self.names.is_empty() {
            return Ok(Vec::new());
        }
        let mut stamps = vec![0u64; (2 * self.names.len()).min(self.capacity as usize)];
        // SAFETY: the frame that wrote the timestamps is complete.
        unsafe {
            self.context.device.get_query_pool_results(
                pool,
                0,
                &mut stamps,
                vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
            )
        }
        .during("reading timestamps")?;
        let period = f64::from(self.context.info.timestamp_period);
        // Once a frame has drawn, lavapipe takes the first timestamp of a pass late, while its dispatch already runs. It runs one pass after the other,
        // so a pass there begins where the one before ends.
        let serial = self.context.info.kind == "cpu";
        let mut last = None;
        let span = |(name, pair): (&String, &[u64])| {
            let begin = last.filter(|_| serial).unwrap_or(pair[0]);
            last = Some(pair[1]);
            (name.clone(), begin as f64 * period, pair[1].wrapping_sub(begin) as f64 * period)
        };
        Ok(self.names.iter().zip(stamps.chunks_exact(2)).map(span).collect())
    }
}

impl Drop for Timing {
    fn drop(&mut self) {
        if let Some(pool) = self.pool {
            // SAFETY: the owner waits for the device before it drops its slots.
            unsafe { self.context.device.destroy_query_pool(pool, None) };
        }
    }
}
