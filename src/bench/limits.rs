//! Measures the limits of a device: copy bandwidth and the cost of a dispatch.

use std::sync::Arc;

use serde::Serialize;

use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::limits::{Samples, copies, empty_dispatches};
use crate::output::statistics::Percentiles;

/// Sizes of the copies [bytes]. Both sizes exceed processor caches and fit into any device.
const BYTES: [u64; 2] = [64 << 20, 256 << 20];
/// Number of dispatches in one submission.
const IN_A_ROW: u32 = 256;
const SAMPLES: usize = 20;

/// The limits of a device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limits {
    /// Copies between device buffers. Each byte is read and written.
    pub(crate) copies: Vec<Copied>,
    /// Time of an empty dispatch from recording until the host sees its end [us].
    pub(crate) submission_us: Option<Percentiles>,
    /// Time of each of many empty dispatches with barriers between them [us].
    pub(crate) dispatch_us: Option<Percentiles>,
    /// Whether the device's clock measured the times.
    pub(crate) by_timestamps: bool,
}

impl Limits {
    /// The highest median bandwidth [GB/s].
    pub(crate) fn bandwidth(&self) -> Option<f64> {
        let rates = self.copies.iter().filter_map(|copied| copied.gigabytes_per_second);
        rates.map(|rate| rate.median).reduce(f64::max)
    }
}

/// Measurement of a copy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Copied {
    pub(crate) bytes: u64,
    /// Bytes read and written over time [GB/s].
    pub(crate) gigabytes_per_second: Option<Percentiles>,
}

/// Measures a device. `quick` leaves out the larger copy.
///
/// # Errors
/// No memory, or a call that fails.
pub(crate) fn measure(context: &Arc<Context>, quick: bool) -> Result<Limits, GpuError> {
    let mut all = Vec::new();
    for bytes in BYTES.into_iter().take(if quick { 1 } else { BYTES.len() }) {
        let samples = copies(context, bytes, SAMPLES)?;
        // A copy reads and writes every byte.
        let rates: Vec<f64> = best(&samples).iter().map(|ms| 2.0 * bytes as f64 / ms * 1e-6).collect();
        all.push(Copied { bytes, gigabytes_per_second: Percentiles::of(&rates) });
    }
    let one = empty_dispatches(context, 1, 10 * SAMPLES)?;
    let many = empty_dispatches(context, IN_A_ROW, SAMPLES)?;
    let each: Vec<f64> = best(&many).iter().map(|ms| 1e3 * ms / f64::from(IN_A_ROW)).collect();
    let alone: Vec<f64> = one.wall_ms.iter().map(|ms| 1e3 * ms).collect();
    Ok(Limits {
        copies: all,
        submission_us: Percentiles::of(&alone),
        dispatch_us: Percentiles::of(&each),
        by_timestamps: !one.device_ms.is_empty(),
    })
}

/// Device times, or host times if the device has no clock.
fn best(samples: &Samples) -> &[f64] {
    if samples.device_ms.is_empty() { &samples.wall_ms } else { &samples.device_ms }
}
