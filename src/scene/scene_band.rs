//! The bands of a scene, as `[[band]]` and `output.ratio` state them.

use crate::thermal::emissivity::BandEmissivity;
use crate::thermal::passband::Passband;
use crate::thermal::ratio::RatioTable;
use crate::thermal::sensor::Sensor;

/// A band of the camera.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneBand {
    /// Name of its channel and its files.
    pub name: String,
    /// Its wavelengths and their response.
    pub(crate) passband: Passband,
    /// Its sensor.
    pub(crate) sensor: Option<Sensor>,
    /// Share of the sunlight that the planet reflects, where the band states it.
    pub(crate) planet_albedo: Option<f64>,
    /// Noise of the radiance, where the band states it [W m-2 sr-1].
    pub(crate) noise: Option<f64>,
    /// Emissivities of the materials in the band, front and back. Known when the model is.
    pub(crate) in_band: Vec<[BandEmissivity; 2]>,
}

/// A temperature from the ratio of two radiances.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BandRatio {
    /// Both bands.
    pub(crate) bands: [usize; 2],
    /// One standard deviation of each radiance [W m-2 sr-1].
    pub(crate) noise: [f64; 2],
    pub(crate) table: RatioTable,
}
