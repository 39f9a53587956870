//! The whole sensor in f64, the reference of the passes on the device.

use super::halo::HaloGrid;
use super::noise::{NoiseStream, normal, random_words};
use super::reading::{SensorConstants, count};
use super::{Sensor, Vignetting};
use crate::thermal::brightness::BrightnessTable;
use crate::thermal::misfit::{Misfit, check_length};
use crate::thermal::radiance::RadianceTable;

/// Pixels of one random hash.
const GROUP: usize = 4;

/// Pixels of the camera and its lines of sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SensorView {
    /// Width and height [px].
    pub(crate) size: [usize; 2],
    /// Focal lengths [px].
    pub(crate) focal: [f64; 2],
    /// Principal point [px].
    pub(crate) centre: [f64; 2],
}

/// What a sensor keeps from one image to the next.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct SensorState<T> {
    /// State of the bolometer and signal of the last image: of each pixel in f64, of each group of four on a device. Empty on a device without a bolometer.
    pub(crate) signal: Vec<T>,
    /// Time of the last image [s].
    pub(crate) last: Option<f64>,
}

/// A sensor with its state.
pub(crate) struct SensorTwin {
    sensor: Sensor,
    view: SensorView,
    constants: SensorConstants,
    table: RadianceTable,
    guesses: Option<BrightnessTable>,
    state: SensorState<f64>,
}

impl SensorTwin {
    /// A sensor that has seen nothing.
    pub(crate) fn new(sensor: &Sensor, table: &RadianceTable, view: SensorView) -> Self {
        Self {
            constants: SensorConstants::new(sensor, table),
            guesses: sensor.kelvin_per_count.map(|_| BrightnessTable::new(table)),
            table: table.clone(),
            sensor: sensor.clone(),
            view,
            state: SensorState { signal: vec![0.0; 2 * view.size[0] * view.size[1]], last: None },
        }
    }

    /// Takes another sensor for the same pixels. The bolometer keeps its state.
    pub(crate) fn take(&mut self, sensor: &Sensor) {
        *self = Self { state: self.state.clone(), ..Self::new(sensor, &self.table, self.view) };
    }

    /// Whether a point spread reads the texels in the pixels.
    pub(crate) fn spreads(&self) -> bool {
        self.sensor.spread.is_some()
    }

    /// Digital number and count of each pixel for the radiance of an image [W m-2 sr-1] at a time [s]. A point spread takes the radiance of the texels.
    pub(crate) fn expose(&mut self, radiance: &[f64], texels: &[f64], time: f64) -> Vec<[u16; 2]> {
        let [width, _] = self.view.size;
        let exposure = self.sensor.exposure(time, self.state.last);
        let image = self.sensor.spread.as_ref().map_or_else(|| radiance.to_vec(), |spread| spread.apply(texels, width));
        let halo = self.sensor.halo.map(|halo| {
            let grid = HaloGrid::new(&halo, self.view.size);
            let cells = grid.halo(&grid.cells(radiance, width));
            (halo.share, grid, cells)
        });
        let mut readings = Vec::with_capacity(image.len());
        for (place, &sharp) in image.iter().enumerate() {
            let (x, y) = (place % width, place / width);
            let light =
                halo.as_ref().map_or(sharp, |(share, grid, cells)| sharp + share * (grid.halo_at(cells, x, y) - sharp));
            let vignette = self.vignette(x, y);
            let signal = self.constants.signal(light, vignette);
            let [state, before] = &mut self.state.signal.as_chunks_mut().0[place];
            let lagged = signal + (*state - *before) * exposure.decay + (*before - signal) * exposure.behind;
            (*state, *before) = (lagged, signal);
            let group = (y * width.div_ceil(GROUP) + x / GROUP) as u32;
            let word = |counter: u64, stream: NoiseStream| {
                let seed = if stream == NoiseStream::Time { self.sensor.seed } else { self.sensor.detector.serial };
                random_words(seed, counter, stream, group)[x % GROUP]
            };
            let shutter = u64::from(exposure.shutter);
            let mut value = lagged;
            if self.sensor.noise.is_some() {
                value += self.constants.noise * normal(word(exposure.counter, NoiseStream::Time));
            }
            if self.sensor.pattern.is_some() {
                value +=
                    self.constants.gain_pattern * normal(word(0, NoiseStream::Gain)) * (value - self.constants.level)
                        + self.constants.offset_pattern * normal(word(shutter, NoiseStream::Offset))
                        + self.constants.drift * exposure.age * normal(word(shutter, NoiseStream::Drift));
            }
            let mut number = self.constants.digital_number(value);
            if self.sensor.detector.bad_pixels > 0.0
                && let Some(most) = stuck(word(0, NoiseStream::Bad), self.constants.bad)
            {
                number = if most { self.constants.most } else { 0.0 };
            }
            // A number at an end of the range tells no temperature.
            let counted = self.guesses.as_ref().filter(|_| number > 0.0 && number < self.constants.most);
            let count = counted.map_or(0.0, |guesses| {
                let radiance = self.constants.radiance(self.constants.signal_of(number), vignette);
                count(&self.constants, &self.table, guesses, radiance)
            });
            readings.push([number as u16, count as u16]);
        }
        self.state.last = Some(time);
        readings
    }

    /// Share of the light that arrives at a pixel.
    fn vignette(&self, x: usize, y: usize) -> f64 {
        match &self.sensor.vignetting {
            None => 1.0,
            Some(Vignetting::Cos4) => cos4(&self.view, x, y),
            Some(Vignetting::Map(map)) => map[y * self.view.size[0] + x],
        }
    }

    pub(crate) fn save(&self) -> SensorState<f64> {
        self.state.clone()
    }

    /// Takes a state. After a state of a scene without a sensor the first image has settled.
    pub(crate) fn restore(&mut self, saved: Option<&SensorState<f64>>) -> Result<(), Misfit> {
        let Some(saved) = saved else {
            self.state.last = None;
            return Ok(());
        };
        check_length("signals of the sensor", &saved.signal, self.state.signal.len())?;
        self.state.clone_from(saved);
        Ok(())
    }
}

/// Fourth power of the cosine between the line of sight of a pixel and the axis.
pub(crate) fn cos4(view: &SensorView, x: usize, y: usize) -> f64 {
    let off = |at: usize, axis: usize| (at as f64 + 0.5 - view.centre[axis]) / view.focal[axis];
    let square = 1.0 + off(x, 0).powi(2) + off(y, 1).powi(2);
    1.0 / (square * square)
}

/// Whether a pixel is stuck at the largest number (`true`) or at 0 (`false`). `None` where it works.
pub(crate) fn stuck(word: u32, share: f64) -> Option<bool> {
    let place = f64::from(word >> 8) / f64::from(1 << 24);
    (place < share).then_some(word & 1 == 1)
}
