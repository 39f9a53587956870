//! Radiation between surfaces on the device: new tables where a joint has moved, and what patches receive.

use super::Renderer;
use crate::gpu::effects::exchange::state::Exchanging;
use crate::gpu::effects::exchange::tables::ExchangeTables;
use crate::gpu::effects::exchange::{ENTRIES, NODES, PATCHES, RECEIVED, REFLECTED, SEEN, SKY, SUNLIGHT};
use crate::gpu::error::GpuError;
use crate::saved::Saved;

impl Renderer {
    /// Replaces the tables after a joint has moved.
    ///
    /// # Errors
    /// More entries than the room that was taken at the start, or a call that fails.
    pub(crate) fn set_exchange(&mut self, tables: &ExchangeTables) -> Result<(), GpuError> {
        self.wait()?;
        let Some(own) = &mut self.scene.exchange else { return Ok(()) };
        if tables.entries.len() > own.room {
            return Err(GpuError::ExchangeGrew { entries: 4 * tables.entries.len(), room: 4 * own.room });
        }
        own.fresh = true;
        own.order.clone_from(&tables.order);
        self.resources.upload(&mut self.once, &NODES, &tables.nodes)?;
        self.resources.upload(&mut self.once, &PATCHES, &tables.patches)?;
        self.resources.upload(&mut self.once, &ENTRIES, &tables.entries)?;
        self.resources.upload(&mut self.once, &SKY, &tables.sky)?;
        self.resources.free_staging();
        Ok(())
    }

    /// What every patch absorbs from the others in the last step [W/m2]. Empty without exchange.
    ///
    /// # Errors
    /// A call that fails.
    pub fn received(&mut self) -> Result<Vec<f32>, GpuError> {
        let at_places = self.received_at_places()?;
        let Some(own) = &self.scene.exchange else { return Ok(Vec::new()) };
        let mut of_patches = vec![0.0; own.order.len()];
        own.order.iter().zip(at_places).for_each(|(patch, [received, _])| of_patches[*patch as usize] = received);
        Ok(of_patches)
    }

    /// Shares of the planet's infrared and albedo that every patch sees.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn seen(&mut self) -> Result<Vec<[f32; 2]>, GpuError> {
        self.wait()?;
        let Some(places) = self.scene.exchange.as_ref().map(Exchanging::places) else { return Ok(Vec::new()) };
        self.resources.download(&mut self.once, &SEEN, places)
    }

    /// What patches reflect at first, and the sunlight that they absorb, as found last [W/m2].
    ///
    /// # Errors
    /// A call that fails.
    pub(super) fn exchanged_light(&mut self) -> Result<(Vec<[f32; 2]>, Vec<f32>), GpuError> {
        self.wait()?;
        let Some(places) = self.scene.exchange.as_ref().map(Exchanging::places) else { return Ok(Default::default()) };
        let reflected = self.resources.download(&mut self.once, &REFLECTED, places)?;
        Ok((reflected, self.resources.download(&mut self.once, &SUNLIGHT, places)?))
    }

    /// All that patches absorb [W/m2], and the share of each that sunlight can reach, in the order of the device.
    ///
    /// # Errors
    /// A call that fails.
    pub(super) fn received_at_places(&mut self) -> Result<Vec<[f32; 2]>, GpuError> {
        self.wait()?;
        let Some(places) = self.scene.exchange.as_ref().map(Exchanging::places) else { return Ok(Vec::new()) };
        self.resources.download(&mut self.once, &RECEIVED, places)
    }

    /// Takes what `seen`, `exchanged_light`, `received_at_places` and [`Exchanging::save`] gave.
    pub(super) fn restore_exchange(&mut self, saved: &Saved) -> Result<(), GpuError> {
        let Some(own) = &mut self.scene.exchange else { return Ok(()) };
        own.renewal.restore(saved)?;
        own.fresh = false;
        let seen: Vec<[f32; 2]> = saved.list_of("seen", own.places())?;
        let reflected: Vec<[f32; 2]> = saved.list_of("reflected", own.places())?;
        let sunlight: Vec<f32> = saved.list_of("sunlight", own.places())?;
        self.resources.upload(&mut self.once, &SEEN, &seen)?;
        self.resources.upload(&mut self.once, &REFLECTED, &reflected)?;
        self.resources.upload(&mut self.once, &SUNLIGHT, &sunlight)?;
        let received: Vec<[f32; 2]> = saved.list_of("received", own.places())?;
        self.resources.upload(&mut self.once, &RECEIVED, &received)
    }
}
