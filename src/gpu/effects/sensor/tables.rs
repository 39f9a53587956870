//! Tables of a sensor for the device.

use crate::gpu::layout;
use crate::thermal::brightness::BrightnessTable;
use crate::thermal::radiance::RadianceTable;
use crate::thermal::sensor::halo::HaloGrid;
use crate::thermal::sensor::reading::SensorConstants;
use crate::thermal::sensor::spread::{FINENESS, Spread, Term};
use crate::thermal::sensor::twin::SensorView;
use crate::thermal::sensor::{Exposure, Sensor, Vignetting};

/// Pixels of a group.
pub(crate) const GROUP: usize = 4;

/// Where the share of light of each pixel comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Vignette {
    /// All pixels have all light.
    None,
    /// The fourth power of a cosine.
    Cos4,
    /// A map.
    Map,
}

/// A variant of `sensor_pixel.comp`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SensorVariant {
    /// Whether it ends a point spread, which `sensor_rows.comp` began.
    pub spread: bool,
    /// Whether it adds a halo.
    pub halo: bool,
    /// Loss of light towards the corners.
    pub vignette: Vignette,
    /// Whether the bolometer lags.
    pub lag: bool,
    /// Whether there is temporal noise.
    pub noise: bool,
    /// Whether there is a fixed pattern.
    pub pattern: bool,
    /// Whether there are bad pixels.
    pub bad: bool,
    /// Whether temperatures are counted.
    pub kelvin: bool,
}

/// What a sensor needs on the device.
#[derive(Debug, Clone)]
pub struct SensorTables {
    /// The sensor, for the exposures.
    pub(crate) sensor: Sensor,
    /// The numbers of the sensor, without an exposure's numbers.
    pub(crate) settings: layout::Sensor,
    /// Weights of the point spread along rows.
    pub(crate) row_kernel: Vec<[f32; 4]>,
    /// Weights of the point spread along columns, and of the halo.
    pub(crate) kernel: Vec<[f32; 4]>,
    /// Share of the light that arrives at each pixel, rows rounded up to whole groups. Empty without a map.
    pub(crate) vignetting: Vec<f32>,
    /// First guesses of inverse temperatures. Empty without a radiometric output.
    pub(crate) guesses: Vec<f32>,
    /// Its effects.
    pub(crate) variant: SensorVariant,
}

impl SensorTables {
    /// Rounds a sensor to f32.
    pub(crate) fn new(sensor: &Sensor, table: &RadianceTable, view: &SensorView) -> Self {
        let constants = SensorConstants::new(sensor, table);
        let [width, height] = view.size;
        let groups = width.div_ceil(GROUP);
        let (row_kernel, mut kernel) = sensor.spread.as_ref().map(kernels_of).unwrap_or_default();
        let grid = sensor.halo.map(|halo| HaloGrid::new(&halo, view.size));
        let halo_weights = kernel.len();
        kernel.extend(grid.iter().flat_map(|grid| grid.weights.iter().map(|weight| [*weight as f32, 0.0, 0.0, 0.0])));
        let guesses = sensor.kelvin_per_count.map(|_| BrightnessTable::new(table));
        let vignetting = match &sensor.vignetting {
            Some(Vignetting::Map(map)) => {
                let row = |row: &[f64]| {
                    let padding = std::iter::repeat_n(1.0, groups * GROUP - width);
                    row.iter().map(|share| *share as f32).chain(padding).collect::<Vec<f32>>()
                };
                map.chunks(width).flat_map(row).collect()
            }
            _ => Vec::new(),
        };
        let settings = layout::Sensor {
            optics: [constants.transmitted, constants.emitted, constants.housing, constants.level].map(|x| x as f32),
            width: width as u32,
            height: height as u32,
            groups: groups as u32,
            terms: sensor.spread.as_ref().map_or(0, |spread| spread.terms.len() as u32),
            radius: sensor.spread.as_ref().map_or(0, |spread| spread.radius as u32),
            halo_weights: halo_weights as u32,
            cell: grid.as_ref().map_or(1, |grid| grid.cell as u32),
            cells_across: grid.as_ref().map_or(0, |grid| grid.size[0] as u32),
            cells_down: grid.as_ref().map_or(0, |grid| grid.size[1] as u32),
            reach: grid.as_ref().map_or(0, |grid| grid.weights.len() as u32 - 1),
            seed: sensor.seed,
            serial: sensor.detector.serial,
            halo_share: sensor.halo.map_or(0.0, |halo| halo.share as f32),
            noise: constants.noise as f32,
            offset_pattern: constants.offset_pattern as f32,
            gain_pattern: constants.gain_pattern as f32,
            scale: constants.scale as f32,
            offset: constants.offset as f32,
            most: constants.most as f32,
            bad: constants.bad as f32,
            counts: constants.counts as f32,
            most_radiance: guesses.as_ref().map_or(0.0, |guesses| guesses.max_radiance as f32),
            focal: view.focal.map(|x| x as f32),
            centre: view.centre.map(|x| x as f32),
            drift: constants.drift as f32,
            ..bytemuck::Zeroable::zeroed()
        };
        let variant = SensorVariant {
            spread: sensor.spread.is_some(),
            halo: sensor.halo.is_some(),
            vignette: match sensor.vignetting {
                None => Vignette::None,
                Some(Vignetting::Cos4) => Vignette::Cos4,
                Some(Vignetting::Map(_)) => Vignette::Map,
            },
            lag: sensor.time_constant.is_some(),
            noise: sensor.noise.is_some(),
            pattern: sensor.pattern.is_some(),
            bad: sensor.detector.bad_pixels > 0.0,
            kelvin: sensor.kelvin_per_count.is_some(),
        };
        let guesses =
            guesses.iter().flat_map(|table| table.inverse_temperatures.iter().map(|one| *one as f32)).collect();
        Self { sensor: sensor.clone(), settings, row_kernel, kernel, vignetting, guesses, variant }
    }

    /// Whether another sensor differs only in its settings and in the weights of its kernel.
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        let sizes = |one: &Self| {
            let layout::Sensor { width, height, terms, cells_across, cells_down, .. } = one.settings;
            (one.kernel.is_empty(), width, height, terms, cells_across, cells_down)
        };
        self.variant == other.variant
            && sizes(self) == sizes(other)
            && self.vignetting == other.vignetting
            && self.guesses == other.guesses
    }

    /// Pixels of the image.
    pub(crate) fn pixels(&self) -> usize {
        self.settings.width as usize * self.settings.height as usize
    }

    /// Groups of four pixels, each row rounded up.
    pub(crate) fn groups(&self) -> usize {
        self.settings.groups as usize * self.settings.height as usize
    }

    /// Cells of the halo.
    pub(crate) fn cells(&self) -> usize {
        self.settings.cells_across as usize * self.settings.cells_down as usize
    }

    /// The numbers of an exposure.
    pub(crate) fn at(&self, exposure: &Exposure) -> layout::Sensor {
        layout::Sensor {
            time_low: exposure.counter as u32,
            time_high: (exposure.counter >> 32) as u32,
            shutter: exposure.shutter,
            decay: exposure.decay as f32,
            behind: exposure.behind as f32,
            drift: self.settings.drift * exposure.age as f32,
            ..self.settings
        }
    }
}

/// Weights along rows and along columns in the order in which the shaders read them, in blocks of the texels of a pixel. The centre of a pixel lies in the
/// middle of its block, so the first block of a line and the last are half empty. Three blocks without weight stand before each line of a row, and three
/// behind, for the other pixels of a group.
fn kernels_of(spread: &Spread) -> (Vec<[f32; FINENESS]>, Vec<[f32; FINENESS]>) {
    let block = |line: &[f64], number: usize| {
        let weight = |lane: usize| {
            let tap = (number * FINENESS + lane).checked_sub(FINENESS / 2);
            tap.and_then(|tap| line.get(tap)).map_or(0.0, |weight| *weight as f32)
        };
        std::array::from_fn(weight)
    };
    let blocks = |line: &[f64]| -> Vec<_> { (0..=2 * spread.radius).map(|number| block(line, number)).collect() };
    let nothing = vec![[0.0; FINENESS]; GROUP - 1];
    let row = |term: &Term| [nothing.clone(), blocks(&term.row), nothing.clone()].concat();
    (spread.terms.iter().flat_map(row).collect(), spread.terms.iter().flat_map(|term| blocks(&term.column)).collect())
}
