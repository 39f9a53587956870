//! Memory of the host that a run takes at its peak, before its engine is made.
//!
//! The memory of the process so far is known. The rest is counted by rays, pixels and planned bytes, with figures that `models/station.toml` and the others of this repository showed; the
//! peak then misses by less than a factor of two.

use super::exchange::ExchangeCraft;
use super::exchange_poses::{MEMORY, MOST};
use super::prepare::Prepared;
use super::target::Target;
use crate::host::resident_memory;

/// Compiled shaders of a driver that computes on the processor [B]: 63 MB on lavapipe.
const SHADERS: u64 = 60 << 20;
/// Where a ray meets its own joint [B a ray].
const MET: u64 = 8;
/// Ends of rays, and view factors and reflections while they are found from them [B a ray].
const FINDING: u64 = 32;
/// Rows in use, with three that are kept whole [B a ray].
const WHOLE: u64 = 16;
/// Packed rows of a pose [B for 8 rays].
const KEPT: u64 = 11;

/// The peak memory of this process in a run [B]. `device` is the planned memory of the device [B]. `None` where the system does not tell the memory so far.
pub(crate) fn forecast_memory(prepared: &Prepared, target: &Target, device: u64) -> Option<u64> {
    let on_processor = target.device().is_some_and(|context| context.info.kind == "cpu");
    let driver = if on_processor { device + SHADERS } else { 0 };
    let pixels = prepared.scene.camera.as_ref().map_or(0, |camera| u64::from(camera.width) * u64::from(camera.height));
    let exchange = prepared.exchange.as_ref().map_or(0, |craft| exchange_bytes(craft, prepared.joints() > 1));
    Some(resident_memory()? + driver + pixels * target.image_bytes(0) + exchange)
}

/// Memory for radiation between surfaces [B].
fn exchange_bytes(craft: &ExchangeCraft, turns: bool) -> u64 {
    let rays = craft.patches.all.len() as u64 * u64::from(craft.settings.rays);
    let poses = if turns { MOST as u64 } else { 1 };
    let met = if turns { MET * rays } else { 0 };
    met + (FINDING + WHOLE) * rays + (poses * rays * KEPT / 8).min(MEMORY as u64)
}
