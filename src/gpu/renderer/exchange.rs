//! Radiation between surfaces on the device: its passes, and when the shares of the planet's light are found anew.

use super::{Renderer, ranges_of_load};
use crate::environment::StepLoad;
use crate::exchange::sky::Renewal;
use crate::gpu::error::GpuError;
use crate::gpu::exchange::{ExchangeTables, PatchRun, exchange};
use crate::gpu::frame::Frame;
use crate::gpu::layout::ExchangePass;
use crate::gpu::resource::Resource;
use crate::gpu::variant::ThermalVariant;
use crate::saved::Saved;

/// What a renderer keeps of the tables.
pub(super) struct Exchanging {
    runs: Vec<PatchRun>,
    sky_rays: u32,
    room: usize,
    renewal: Renewal,
    /// Whether the shares of the planet's light must be found anew, whatever the angle.
    fresh: bool,
}

impl Exchanging {
    /// The state before the first step.
    pub fn new(tables: &ExchangeTables, angle: f64) -> Self {
        let renewal = Renewal { angle, found_for: None };
        Self { runs: tables.runs.clone(), sky_rays: tables.sky_rays, room: tables.room, renewal, fresh: true }
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
    fn places(&self) -> usize {
        self.runs.last().map_or(0, |run| run.2 as usize) + 1
    }

    /// The state that a run needs to go on.
    pub fn save(&self) -> Saved {
        self.renewal.save()
    }
}

impl Renderer {
    /// The passes that find what nodes receive in a step. Empty where surfaces do not see each other.
    pub(super) fn exchange_frame(&mut self, load: &StepLoad) -> Frame {
        let Some(light) = ranges_of_load(&self.ranges, load).first().map(|range| range.variant) else {
            return Frame::default();
        };
        let Some(own) = &mut self.exchange else { return Frame::default() };
        let sky = (own.renewal.is_due(load) || own.fresh) && load.planet.is_some();
        own.fresh &= !sky;
        exchange(&own.runs, light, sky)
    }

    /// Replaces the tables after a joint has moved.
    ///
    /// # Errors
    /// More entries than the room that was taken at the start, or a call that fails.
    pub fn set_exchange(&mut self, tables: &ExchangeTables) -> Result<(), GpuError> {
        self.wait()?;
        let Some(own) = &mut self.exchange else { return Ok(()) };
        if tables.entries.len() > own.room {
            return Err(GpuError::ExchangeGrew { entries: 4 * tables.entries.len(), room: 4 * own.room });
        }
        own.fresh = true;
        self.resources.upload(&mut self.once, Resource::ExchangePatches, &tables.patches)?;
        self.resources.upload(&mut self.once, Resource::ExchangeEntries, &tables.entries)?;
        self.resources.upload(&mut self.once, Resource::ExchangeSky, &tables.sky)?;
        self.resources.free_staging();
        Ok(())
    }

    /// What every patch absorbs from the others in the last step [W/m2]. Empty without exchange.
    ///
    /// # Errors
    /// A call that fails.
    pub fn received(&mut self) -> Result<Vec<f32>, GpuError> {
        self.wait()?;
        let Some(places) = self.exchange.as_ref().map(Exchanging::places) else { return Ok(Vec::new()) };
        self.resources.download(&mut self.once, Resource::ExchangeReceived, places - 1)
    }

    /// Shares of the planet's infrared and albedo that every patch sees.
    ///
    /// # Errors
    /// A call that fails.
    pub fn seen(&mut self) -> Result<Vec<[f32; 2]>, GpuError> {
        self.wait()?;
        let Some(places) = self.exchange.as_ref().map(Exchanging::places) else { return Ok(Vec::new()) };
        self.resources.download(&mut self.once, Resource::ExchangeSeen, places)
    }

    /// Takes what `seen` and [`Exchanging::save`] gave.
    pub(super) fn restore_exchange(&mut self, saved: &Saved) -> Result<(), GpuError> {
        let Some(own) = &mut self.exchange else { return Ok(()) };
        own.renewal.restore(saved)?;
        own.fresh = false;
        let seen: Vec<[f32; 2]> = saved.list_of("seen", own.places())?;
        self.resources.upload(&mut self.once, Resource::ExchangeSeen, &seen)
    }
}
