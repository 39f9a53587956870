//! Radiation between surfaces on the device: new tables where a joint has moved, and what patches receive.

use super::Renderer;
use crate::gpu::effects::exchange::state::Exchanging;
use crate::gpu::effects::exchange::tables::{ExchangeTables, FindingTables};
use crate::gpu::effects::exchange::{ENTRIES, RECEIVED, ROWS, SEEN, SKY};
use crate::gpu::error::GpuError;
use crate::thermal::received::{FaceLoad, PlanetShares};
use crate::trace::span;

impl Renderer {
    /// Takes other rows after a joint has moved: the share of the second finding, and findings that are `new`.
    ///
    /// # Errors
    /// More entries than the room that was taken at the start, or a call that fails.
    pub(crate) fn set_exchange(&mut self, tables: &ExchangeTables, new: [bool; 2]) -> Result<(), GpuError> {
        if new.contains(&true) {
            self.wait()?;
        }
        let Some(own) = &mut self.scene.exchange else { return Ok(()) };
        own.renewal.new_rows();
        own.share = tables.share();
        for slot in [0, 1].into_iter().filter(|slot| new[*slot]) {
            let FindingTables { rows, entries, sky, .. } = &tables.findings[slot];
            if entries.len() > own.room {
                return Err(GpuError::ExchangeGrew { entries: 4 * entries.len(), room: 4 * own.room });
            }
            let _brings = span("bringing rows to the device");
            self.resources.upload_from(&mut self.once, &ROWS, rows, slot * rows.len())?;
            self.resources.upload_from(&mut self.once, &ENTRIES, entries, slot * own.room)?;
            self.resources.upload_from(&mut self.once, &SKY, sky, slot * sky.len())?;
            self.resources.free_staging();
        }
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

    /// The light of the last step on every patch. Empty without exchange.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn face_loads(&mut self) -> Result<Vec<FaceLoad>, GpuError> {
        let received = self.received_at_places()?;
        let Some(own) = &self.scene.exchange else { return Ok(Vec::new()) };
        let seen: Vec<[f32; 2]> = self.resources.download(&mut self.once, &SEEN, own.places())?;
        let mut loads = vec![FaceLoad::NOTHING; own.order.len()];
        for ((patch, [absorbed, exposed]), seen) in own.order.iter().zip(received).zip(seen) {
            let [planet_ir, albedo] = seen.map(f64::from);
            loads[*patch as usize] = FaceLoad {
                absorbed: f64::from(absorbed),
                planet_shares: PlanetShares { planet_ir, albedo },
                exposed: f64::from(exposed),
            };
        }
        self.resources.free_staging();
        Ok(loads)
    }

    /// All that patches absorb [W/m2], and the share of each that sunlight can reach, in the order of the device.
    ///
    /// # Errors
    /// A call that fails.
    fn received_at_places(&mut self) -> Result<Vec<[f32; 2]>, GpuError> {
        self.wait()?;
        let Some(places) = self.scene.exchange.as_ref().map(Exchanging::places) else { return Ok(Vec::new()) };
        self.resources.download(&mut self.once, &RECEIVED, places)
    }
}
