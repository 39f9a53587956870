//! Device time of each pass, measured by timestamp queries.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;

use super::context::Context;
use super::error::{During as _, GpuError};
use super::samples::Samples;

/// Timestamp queries of one slot. It does nothing on a queue without timestamps.
///
/// Passes between two barriers may run at the same time, so they share a time. A timestamp waits for everything before it. On lavapipe that costs about
/// 0.1 ms: one for each pass made steps of the station half as long again.
pub(crate) struct Timing {
    context: Arc<Context>,
    pool: Option<vk::QueryPool>,
    capacity: u32,
    /// Names of the groups of passes, each of which ends at a timestamp. The first timestamp begins the frame.
    names: Vec<String>,
    /// Whether the frame is timed.
    on: bool,
    /// The group that has no timestamp yet: its first pass, and what the names of all its passes have in common.
    open: Option<[String; 2]>,
}

/// Durations of every group of passes in a run [ms], by name, in order of time.
pub(crate) type PassTimes = BTreeMap<String, Samples<f64>>;

impl Timing {
    /// Makes queries for up to `passes` passes.
    pub(crate) fn new(context: &Arc<Context>, passes: usize) -> Result<Self, GpuError> {
        let capacity = u32::try_from(passes + 1).unwrap_or(u32::MAX).max(2);
        let pool = if context.info.timestamp_period > 0.0 {
            let create = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(capacity);
            // SAFETY: the device is alive, and its queue supports timestamps.
            Some(unsafe { context.device.create_query_pool(&create, None) }.during("creating a query pool")?)
        } else {
            None
        };
        Ok(Self { context: Arc::clone(context), pool, capacity, names: Vec::new(), on: false, open: None })
    }

    pub(super) fn begin_frame(&mut self, commands: vk::CommandBuffer, timed: bool) {
        self.names.clear();
        self.open = None;
        self.on = timed;
        if let Some(pool) = self.pool.filter(|_| timed) {
            // SAFETY: the host waited for the last frame of the slot.
            unsafe { self.context.device.cmd_reset_query_pool(commands, pool, 0, self.capacity) };
        }
        self.stamp(commands);
    }

    /// A pass of this name follows.
    pub(super) fn begin_pass(&mut self, commands: vk::CommandBuffer, name: &str) {
        match &mut self.open {
            Some([first, common]) if kind(first) == kind(name) => common.truncate(shared(common, name)),
            _ => {
                self.end_group(commands);
                self.open = Some([name.to_owned(), name.to_owned()]);
            }
        }
    }

    /// Ends the passes that may run at the same time: at a barrier, and at the end of a frame.
    pub(super) fn end_group(&mut self, commands: vk::CommandBuffer) {
        if let Some([_, common]) = self.open.take() {
            self.names.push(common);
            self.stamp(commands);
        }
    }

    /// Writes the timestamp at the end of the groups so far.
    fn stamp(&self, commands: vk::CommandBuffer) {
        let query = u32::try_from(self.names.len()).unwrap_or(u32::MAX);
        if let Some(pool) = self.pool.filter(|_| self.on && query < self.capacity) {
            // SAFETY: the pool has a query for each pass and one more, and was reset at the start of the frame.
            unsafe {
                self.context.device.cmd_write_timestamp2(commands, vk::PipelineStageFlags2::ALL_COMMANDS, pool, query);
            }
        }
    }

    /// Names of the groups of passes in the slot's last frame, timed or not.
    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// Name, start and duration of the groups of passes in the slot's last frame, empty if it was not timed [ns of the device clock]. The frame must be complete.
    pub(super) fn collect(&self) -> Result<Vec<(String, f64, f64)>, GpuError> {
        let Some(pool) = self.pool.filter(|_| self.on && !self.names.is_empty()) else { return Ok(Vec::new()) };
        let mut stamps = vec![0u64; (self.names.len() + 1).min(self.capacity as usize)];
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
        let spans = spans(&stamps, self.context.info.timestamp_bits);
        let time = |(name, [start, length]): (&String, [u64; 2])| {
            (name.clone(), start as f64 * period, length as f64 * period)
        };
        Ok(self.names.iter().zip(spans).map(time).collect())
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

/// Start and length between one timestamp and the next, of a clock with so many bits that begins again at 0. The starts
/// go on beyond the bits.
fn spans(stamps: &[u64], bits: u32) -> Vec<[u64; 2]> {
    let valid = u64::MAX.checked_shr(64 - bits.min(64)).unwrap_or(0);
    let mut start = stamps.first().map_or(0, |first| first & valid);
    let next = |pair: &[u64]| {
        let length = pair[1].wrapping_sub(pair[0]) & valid;
        start = start.wrapping_add(length);
        [start.wrapping_sub(length), length]
    };
    stamps.windows(2).map(next).collect()
}

/// What two passes have in common that share a time: the first two words of their names, such as `thermal_step.merge`.
fn kind(name: &str) -> &str {
    let end = name.match_indices('.').nth(1).map_or(name.len(), |(end, _)| end);
    &name[..end]
}

/// Length of the words with which both names begin.
fn shared(a: &str, b: &str) -> usize {
    let words = a.split('.').zip(b.split('.')).take_while(|(a, b)| a == b);
    words.map(|(word, _)| word.len() + 1).sum::<usize>().saturating_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_of_few_bits_begins_again_within_a_frame() {
        let last = (1 << 36) - 10;
        // The upper bits are undefined.
        assert_eq!(spans(&[last | 3 << 40, 20, 25 | 5 << 50], 36), [[last, 30], [last + 30, 5]]);
        assert_eq!(spans(&[u64::MAX - 1, 7], 64)[0][1], 9);
        assert_eq!(spans(&[5], 64), [[0; 2]; 0]);
    }

    #[test]
    fn passes_that_share_a_time_have_the_words_in_common() {
        let [plain, both] = ["thermal_step.merge.sun", "thermal_step.merge.sun.both_sides"];
        assert_eq!((kind(plain), kind("cull"), kind("read radiance")), ("thermal_step.merge", "cull", "read radiance"));
        assert_eq!(&both[..shared(both, plain)], plain);
        assert_eq!(&both[..shared(both, "thermal_step.merge.sunlit")], "thermal_step.merge");
        assert_eq!(shared("cull", "radiance"), 0);
    }
}
