//! What a renderer keeps of radiation between surfaces: runs of patches, and when the shares of the planet's light are found anew.

use crate::exchange::sky::Renewal;
use crate::gpu::exchange::{ExchangeTables, PatchRun, exchange};
use crate::gpu::frame::Frame;
use crate::gpu::layout::ExchangePass;
use crate::gpu::variant::ThermalVariant;
use crate::saved::Saved;

/// What a renderer keeps of the tables.
pub(super) struct Exchanging {
    pub runs: Vec<PatchRun>,
    sky_rays: u32,
    /// Patch at each place of the device.
    pub order: Vec<u32>,
    pub room: usize,
    pub renewal: Renewal,
    /// Whether the shares of the planet's light must be found anew, whatever the angle.
    pub fresh: bool,
}

impl Exchanging {
    /// The state before the first step.
    pub fn new(tables: &ExchangeTables, angle: f64) -> Self {
        let renewal = Renewal { angle, found_for: None };
        Self {
            runs: tables.runs.clone(),
            sky_rays: tables.sky_rays,
            order: tables.order.clone(),
            room: tables.room,
            renewal,
            fresh: true,
        }
    }

    /// Every list of passes in a scene with this light.
    pub fn frames(&self, lights: impl Iterator<Item = ThermalVariant>) -> Vec<Frame> {
        lights.map(|light| exchange(&self.runs, light, true)).collect()
    }

    /// Push constants of a pass.
    pub fn constants(&self, first: u32, end: u32) -> ExchangePass {
        ExchangePass { first, end, rays: self.sky_rays, boxes: 0, start: 0.0 }
    }

    /// Number of patches, and one for faces without any.
    pub fn places(&self) -> usize {
        self.runs.last().map_or(0, |run| run.2 as usize) + 1
    }

    /// The state that a run needs to go on.
    pub fn save(&self) -> Saved {
        self.renewal.save()
    }
}
