//! The sensor of a scene's image: its passes, and the time of its last exposure.

use super::Sensing;
use super::tables::{GROUP, SensorTables};
use crate::gpu::layout;

/// The sensor of an image.
pub(crate) struct ImageSensor {
    tables: SensorTables,
    /// Numbers of the last exposure.
    pub(crate) settings: layout::Sensor,
    /// Time of the last exposure [s].
    pub(crate) last: Option<f64>,
}

impl ImageSensor {
    pub(crate) fn new(tables: &SensorTables) -> Self {
        Self { settings: tables.settings, tables: tables.clone(), last: None }
    }

    /// What its passes depend on.
    pub(crate) fn sensing(&self) -> Sensing {
        Sensing::of(&self.tables)
    }

    /// Takes the tables of another sensor with the same passes. The bolometer keeps its state.
    pub(crate) fn take(&mut self, tables: SensorTables) {
        self.tables = tables;
    }

    /// Whether the tables of another sensor need no other passes, buffers or uploads.
    pub(crate) fn takes(&self, tables: &SensorTables) -> bool {
        self.tables.is_alike(tables)
    }

    /// Sets the numbers of an exposure at a time [s].
    pub(crate) fn expose(&mut self, time: f64) {
        self.settings = self.tables.at(&self.tables.sensor.exposure(time, self.last));
        self.last = Some(time);
    }

    /// The pixels of rows that were rounded up to whole groups.
    pub(crate) fn unpadded(&self, readings: &[[u16; 2]]) -> Vec<[u16; 2]> {
        let rows = readings.chunks(GROUP * self.settings.groups as usize);
        rows.flat_map(|row| &row[..self.settings.width as usize]).copied().collect()
    }

    /// Pixels of the image with rows rounded up to whole groups.
    pub(crate) fn padded_pixels(&self) -> usize {
        GROUP * self.settings.groups as usize * self.settings.height as usize
    }
}
