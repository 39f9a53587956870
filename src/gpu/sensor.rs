//! The sensor on the device: its tables, and its passes after the image.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use super::frame::Frame;
use super::layout;
use super::pass::{
    Access, COMPUTE_READ, COMPUTE_UNIFORM, COMPUTE_WRITE, COPY_READ, COPY_WRITE, Entry, Kernel, Pass, Said, Scope,
    Work, access, barrier, copy_pass, scope, to_host,
};
use super::resource::Resource;
use super::resource_row::Count;
use super::sensor_variant::{SensorVariant, Vignette};
use crate::thermal::brightness::BrightnessTable;
use crate::thermal::radiance::RadianceTable;
use crate::thermal::sensor::halo::HaloGrid;
use crate::thermal::sensor::reading::SensorConstants;
use crate::thermal::sensor::spread::Spread;
use crate::thermal::sensor::twin::SensorView;
use crate::thermal::sensor::{Exposure, Sensor, Vignetting};

/// Pixels of a group.
pub const GROUP: usize = 4;
/// Name of the copy of an image for the sensor.
pub const COPIED: &str = "read radiance for the sensor";
/// Name of the copy of what the sensor reads to the host.
pub const READ: &str = "read sensor";
/// Groups of a workgroup.
const WORKGROUP: usize = 64;

/// What a sensor needs on the device.
#[derive(Debug, Clone)]
pub struct SensorTables {
    /// The sensor, for the exposures.
    pub sensor: Sensor,
    /// Its numbers, without those of an exposure.
    pub settings: layout::Sensor,
    /// Weights of point spread and halo.
    pub kernel: Vec<[f32; 4]>,
    /// Share of the light that arrives at each pixel, rows rounded up to whole groups. Empty without a map.
    pub vignetting: Vec<f32>,
    /// First guesses of inverse temperatures. Empty without a radiometric output.
    pub guesses: Vec<f32>,
    variant: SensorVariant,
}

impl SensorTables {
    /// Rounds a sensor to f32.
    pub fn new(sensor: &Sensor, table: &RadianceTable, view: &SensorView) -> Self {
        let constants = SensorConstants::new(sensor, table);
        let [width, height] = view.size;
        let groups = width.div_ceil(GROUP);
        let mut kernel = sensor.spread.as_ref().map(kernel_of).unwrap_or_default();
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
            bad: sensor.bad_pixels > 0.0,
            kelvin: sensor.kelvin_per_count.is_some(),
        };
        let guesses =
            guesses.iter().flat_map(|table| table.inverse_temperatures.iter().map(|one| *one as f32)).collect();
        Self { sensor: sensor.clone(), settings, kernel, vignetting, guesses, variant }
    }

    /// Whether another sensor differs only in its settings and in the weights of its kernel.
    pub fn is_alike(&self, other: &Self) -> bool {
        let counts = [Count::SensorWeights, Count::SensorRows, Count::SensorCells, Count::SensorPixels];
        self.variant == other.variant
            && counts.iter().all(|count| self.count(*count) == other.count(*count))
            && self.vignetting == other.vignetting
            && self.guesses == other.guesses
    }

    /// Number of elements for a `count` of the sensor; 0 for others.
    pub(super) fn count(&self, count: Count) -> usize {
        let layout::Sensor { width, height, groups, terms, cells_across, cells_down, .. } = self.settings;
        let groups = groups as usize * height as usize;
        match count {
            Count::Sensor => 1,
            Count::SensorWeights if self.kernel.is_empty() => 0,
            Count::SensorWeights => Spread::ROOM,
            Count::SensorPixels => width as usize * height as usize,
            Count::SensorGroups => groups,
            Count::SensorRows => groups * terms as usize,
            Count::SensorCells => cells_across as usize * cells_down as usize,
            Count::SensorVignetting => self.vignetting.len() / GROUP,
            Count::SensorBolometer if self.variant.lag => groups,
            Count::SensorGuesses => self.guesses.len(),
            _ => 0,
        }
    }

    /// The numbers of an exposure.
    pub fn at(&self, exposure: &Exposure) -> layout::Sensor {
        layout::Sensor {
            time_low: exposure.counter as u32,
            time_high: (exposure.counter >> 32) as u32,
            shutter: exposure.shutter,
            decay: exposure.decay as f32,
            drift: self.settings.drift * exposure.age as f32,
            ..self.settings
        }
    }

    /// The passes of an image, after those that leave it in `shown` and copy it.
    pub fn frame(&self, shown: Resource) -> Frame {
        let cells = self.settings.cells_across as usize * self.settings.cells_down as usize;
        frame(self.variant, self.count(Count::SensorGroups), cells, shown)
    }
}

/// Weights in the order in which the shaders read them. A tap along a row has the weights of the four pixels of a group. A tap along a column has one
/// weight for all four.
fn kernel_of(spread: &Spread) -> Vec<[f32; 4]> {
    let taps = 2 * spread.radius + 1;
    let mut kernel = Vec::new();
    for term in &spread.terms {
        let weight = |at: usize, pixel: usize| {
            at.checked_sub(pixel).filter(|at| *at < taps).map_or(0.0, |at| term.row[at] as f32)
        };
        kernel.extend((0..taps + 3).map(|at| [0, 1, 2, 3].map(|pixel| weight(at, pixel))));
        kernel.extend(term.column.iter().map(|weight| [*weight as f32; 4]));
    }
    kernel
}

/// A dispatch over groups or cells.
fn dispatch(name: &str, kernel: Kernel, count: usize, bound: Vec<(u32, Resource, Scope)>) -> Entry {
    let accesses = bound
        .into_iter()
        .map(|(binding, resource, scope)| Access { binding: Some(binding), ..access(resource, scope) });
    let work = Work::Dispatch { kernel, workgroups: count.div_ceil(WORKGROUP) as u32, set: 0, said: Said::Nothing };
    Entry::Pass(Pass { name: name.to_owned(), work, accesses: accesses.collect() })
}

/// The passes of a sensor over an image that the list before has left in `shown` and copied to the host.
pub fn frame(variant: SensorVariant, groups: usize, cells: usize, shown: Resource) -> Frame {
    use Resource as R;
    let read = scope(S::COMPUTE_SHADER, A::NONE);
    let copied = scope(S::COPY, A::NONE);
    let both = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_READ | A::SHADER_STORAGE_WRITE);
    let settings = (0, R::Sensor, COMPUTE_UNIFORM);
    let mut entries = vec![
        // The sensor may still read the last image.
        Entry::Barriers(vec![barrier(R::SensorSeen, read, COPY_WRITE)]),
        Entry::Pass(copy_pass(COPIED, shown, R::SensorSeen)),
    ];
    let mut seen = vec![barrier(R::SensorSeen, COPY_WRITE, COMPUTE_READ)];
    let mut made = Vec::new();
    if variant.spread {
        seen.push(barrier(R::SensorRows, read, COMPUTE_WRITE));
        made.push(barrier(R::SensorRows, COMPUTE_WRITE, COMPUTE_READ));
    }
    if variant.halo {
        seen.push(barrier(R::SensorCells, read, COMPUTE_WRITE));
    }
    entries.push(Entry::Barriers(seen));
    if variant.spread {
        let bound = vec![
            settings,
            (1, R::SensorKernel, COMPUTE_UNIFORM),
            (2, R::SensorSeen, COMPUTE_READ),
            (3, R::SensorRows, COMPUTE_WRITE),
        ];
        entries.push(dispatch("sensor_rows", Kernel::SensorRows, groups, bound));
    }
    if variant.halo {
        let bound = vec![settings, (1, R::SensorSeen, COMPUTE_READ), (2, R::SensorCells, COMPUTE_WRITE)];
        entries.push(dispatch("sensor_cells", Kernel::SensorCells, cells, bound));
        entries.push(Entry::Barriers(vec![
            barrier(R::SensorCells, COMPUTE_WRITE, COMPUTE_READ),
            barrier(R::SensorHalo, read, COMPUTE_WRITE),
        ]));
        let bound = vec![
            settings,
            (1, R::SensorKernel, COMPUTE_UNIFORM),
            (2, R::SensorCells, COMPUTE_READ),
            (3, R::SensorHalo, COMPUTE_WRITE),
        ];
        entries.push(dispatch("sensor_halo", Kernel::SensorHalo, cells, bound));
        made.push(barrier(R::SensorHalo, COMPUTE_WRITE, COMPUTE_READ));
    }
    if variant.lag {
        made.push(barrier(R::SensorBolometer, COMPUTE_WRITE, both));
    }
    made.push(barrier(R::SensorReading, copied, COMPUTE_WRITE));
    entries.push(Entry::Barriers(made));
    let mut bound = vec![settings, (6, R::SensorReading, COMPUTE_WRITE)];
    match variant.spread {
        true => bound.extend([(1, R::SensorKernel, COMPUTE_UNIFORM), (2, R::SensorRows, COMPUTE_READ)]),
        false => bound.push((2, R::SensorSeen, COMPUTE_READ)),
    }
    bound.extend(variant.halo.then_some((3, R::SensorHalo, COMPUTE_READ)));
    bound.extend((variant.vignette == Vignette::Map).then_some((4, R::SensorVignetting, COMPUTE_READ)));
    if variant.lag {
        bound.extend([(5, R::SensorBolometer, COMPUTE_READ), (5, R::SensorBolometer, COMPUTE_WRITE)]);
    }
    if variant.kelvin {
        bound.extend([(7, R::BandTable, COMPUTE_READ), (8, R::SensorGuesses, COMPUTE_READ)]);
    }
    entries.push(dispatch("sensor_pixel", Kernel::SensorPixel(variant), groups, bound));
    entries.push(Entry::Barriers(vec![barrier(R::SensorReading, COMPUTE_WRITE, COPY_READ)]));
    entries.push(Entry::Pass(copy_pass(READ, R::SensorReading, R::SensorReadback)));
    entries.push(Entry::Barriers(vec![to_host(R::SensorReadback)]));
    Frame { entries }
}
