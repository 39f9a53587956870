//! Measured limits of a device: its copy bandwidth and the cost of an empty dispatch.

use std::sync::Arc;
use std::time::Instant;

use super::bindings::Bindings;
use super::context::Context;
use super::error::GpuError;
use super::lists::{self, COPIED_FROM, COPIED_TO, UNTOUCHED};
use super::once::Once;
use super::pass::Frame;
use super::store::Resources;

/// Untimed runs at the start, because drivers compile and map pages late.
const WARM_UP: usize = 3;

/// Durations of a measurement, one for each sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Samples {
    /// Time by device timestamps [ms], empty on a queue without timestamps.
    pub(crate) device_ms: Vec<f64>,
    /// Time on the host from recording to completion [ms].
    pub wall_ms: Vec<f64>,
}

fn sampled(
    once: &mut Once,
    samples: usize,
    list: &Frame,
    resources: &Resources,
    bindings: &Bindings,
) -> Result<Samples, GpuError> {
    let run = |once: &mut Once| once.run([list], resources, Some(bindings));
    for _ in 0..WARM_UP {
        run(once)?;
    }
    let mut device_ms = Vec::with_capacity(samples);
    let mut wall_ms = Vec::with_capacity(samples);
    for _ in 0..samples {
        let (began, before) = (Instant::now(), once.device_ms().unwrap_or(0.0));
        run(once)?;
        wall_ms.push(began.elapsed().as_secs_f64() * 1e3);
        device_ms.extend(once.device_ms().map(|now| now - before));
    }
    Ok(Samples { device_ms, wall_ms })
}

/// Measures copies of `bytes` bytes between two device buffers.
pub fn copies(context: &Arc<Context>, bytes: u64, samples: usize) -> Result<Samples, GpuError> {
    let mut resources = Resources::new(context);
    resources.make(&COPIED_FROM, bytes)?;
    resources.make(&COPIED_TO, bytes)?;
    let mut once = Once::new(context)?;
    let bindings = Bindings::plain(context);
    once.run([&lists::filled()], &resources, None)?;
    sampled(&mut once, samples, &lists::copied(), &resources, &bindings)
}

/// Measures `dispatches` empty dispatches of one workgroup, with a barrier between each two.
pub(crate) fn empty_dispatches(context: &Arc<Context>, dispatches: u32, samples: usize) -> Result<Samples, GpuError> {
    let mut resources = Resources::new(context);
    resources.make_of(&UNTOUCHED, 1)?;
    let list = lists::dispatched(dispatches);
    let mut bindings = Bindings::plain(context);
    bindings.add(&resources, list.passes())?;
    sampled(&mut Once::new(context)?, samples, &list, &resources, &bindings)
}
