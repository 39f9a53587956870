//! Radiation between surfaces on the device: its passes in a frame, and new tables where a joint has moved.

use super::Renderer;
use super::exchanging::Exchanging;
use super::ranges::ranges_of_load;
use crate::environment::StepLoad;
use crate::gpu::error::GpuError;
use crate::gpu::exchange::ExchangeTables;
use crate::gpu::frame::Frame;
use crate::gpu::resource::Resource;
use crate::saved::Saved;

impl Renderer {
    /// The passes that find what nodes receive in a load that lasts `steps`. Empty where surfaces do not see each other.
    pub(super) fn exchange_frame(&mut self, load: &StepLoad, steps: f64) -> Frame {
        let Some(light) = ranges_of_load(&self.ranges, load).first().map(|range| range.variant) else {
            return Frame::default();
        };
        self.exchange.as_mut().map(|own| own.frame(light, load, steps)).unwrap_or_default()
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
        own.order.clone_from(&tables.order);
        self.resources.upload(&mut self.once, Resource::ExchangeNodes, &tables.nodes)?;
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
        let at_places = self.received_at_places()?;
        let Some(own) = &self.exchange else { return Ok(Vec::new()) };
        let mut of_patches = vec![0.0; own.order.len()];
        own.order.iter().zip(at_places).for_each(|(patch, [received, _])| of_patches[*patch as usize] = received);
        Ok(of_patches)
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

    /// What patches reflect at first, and the sunlight that they absorb, as found last [W/m2].
    ///
    /// # Errors
    /// A call that fails.
    pub(super) fn exchanged_light(&mut self) -> Result<(Vec<[f32; 2]>, Vec<f32>), GpuError> {
        self.wait()?;
        let Some(places) = self.exchange.as_ref().map(Exchanging::places) else { return Ok(Default::default()) };
        let reflected = self.resources.download(&mut self.once, Resource::ExchangeReflected, places)?;
        Ok((reflected, self.resources.download(&mut self.once, Resource::ExchangeSunlight, places)?))
    }

    /// All that patches absorb [W/m2], and the share of each that sunlight can reach, in the order of the device.
    ///
    /// # Errors
    /// A call that fails.
    pub(super) fn received_at_places(&mut self) -> Result<Vec<[f32; 2]>, GpuError> {
        self.wait()?;
        let Some(places) = self.exchange.as_ref().map(Exchanging::places) else { return Ok(Vec::new()) };
        self.resources.download(&mut self.once, Resource::ExchangeReceived, places)
    }

    /// Takes what `seen`, `exchanged_light`, `received_at_places` and [`Exchanging::save`] gave.
    pub(super) fn restore_exchange(&mut self, saved: &Saved) -> Result<(), GpuError> {
        let Some(own) = &mut self.exchange else { return Ok(()) };
        own.renewal.restore(saved)?;
        own.fresh = false;
        let seen: Vec<[f32; 2]> = saved.list_of("seen", own.places())?;
        let reflected: Vec<[f32; 2]> = saved.list_of("reflected", own.places())?;
        let sunlight: Vec<f32> = saved.list_of("sunlight", own.places())?;
        self.resources.upload(&mut self.once, Resource::ExchangeSeen, &seen)?;
        self.resources.upload(&mut self.once, Resource::ExchangeReflected, &reflected)?;
        self.resources.upload(&mut self.once, Resource::ExchangeSunlight, &sunlight)?;
        let received: Vec<[f32; 2]> = saved.list_of("received", own.places())?;
        self.resources.upload(&mut self.once, Resource::ExchangeReceived, &received)
    }
}
