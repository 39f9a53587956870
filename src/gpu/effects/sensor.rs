//! The sensor of an image: point spread, halo, lag, noise and digital numbers.

pub(crate) mod state;
pub(crate) mod tables;

use self::tables::{SensorTables, SensorVariant, Vignette};
use crate::gpu::layout;
use crate::gpu::pass::{
    COMPUTE, COMPUTE_READ, COMPUTE_WRITE, COMPUTED, COPIED, COPY_READ, COPY_WRITE, Frame, Pass, barrier, to_host,
};
use crate::gpu::resource::Role::{Readback, Storage, Uniform};
use crate::gpu::resource::{Per, Resource, lent, made, resources};
use crate::gpu::scene_data::SceneData;
use crate::gpu::shaders::Shader;
use crate::thermal::sensor::spread::{FINENESS, Spread};

/// A buffer of a sensor, with its number of elements and perhaps its contents.
macro_rules! buffer {
    ($name:literal, $element:expr, $role:expr, $count:expr) => {
        Resource::new($name, $element, $role, Per::Scene, |data| sensor(data).map_or(0, $count))
    };
    ($name:literal, $element:expr, $role:expr, $count:expr, $contents:expr) => {
        buffer!($name, $element, $role, $count).filled(|data| sensor(data).map_or_else(Default::default, $contents))
    };
}

resources! {
    /// `Sensor`, written by the host.
    SETTINGS = buffer!("Sensor", size_of::<layout::Sensor>(), Uniform, |_| 1).each_slot();
    /// Weights of the point spread along rows.
    ROW_KERNEL =
        buffer!("SensorRowKernel", 16, Uniform, |one| if one.variant.spread { Spread::ROOM } else { 0 }, |one| lent(
            &one.row_kernel
        ));
    /// Weights of the point spread along columns, and of the halo.
    KERNEL =
        buffer!("SensorKernel", 16, Uniform, |one| if one.kernel.is_empty() { 0 } else { Spread::ROOM }, |one| lent(
            &one.kernel
        ));
    /// Copy of the image's radiance that the sensor reads.
    SEEN = buffer!("SensorSeen", 16, Storage, |one| if one.variant.copies() { one.pixels() } else { 0 });
    /// Radiance of the texels in the pixels, before a point spread.
    FINE = buffer!("SensorFine", 16, Storage, |one| if one.variant.spread { FINENESS * one.pixels() } else { 0 });
    /// Radiance of a row of texels at the centres of four pixels after the point spread along rows, for each term.
    ROWS = buffer!("SensorRows", 16, Storage, |one| FINENESS * one.groups() * one.settings.terms as usize);
    /// Mean radiance of each cell of the halo's grid.
    CELLS = buffer!("SensorCells", 4, Storage, SensorTables::cells);
    /// The halo at each cell.
    HALO = buffer!("SensorHalo", 4, Storage, SensorTables::cells);
    /// Share of the light that arrives at four pixels.
    VIGNETTING =
        buffer!("SensorVignetting", 16, Storage,
        |one| one.vignetting.len() / tables::GROUP, |one| lent(&one.vignetting));
    /// State of the bolometer, and its signal at the last image.
    BOLOMETER =
        buffer!("SensorBolometer", 32, Storage, |one| if one.variant.lag { one.groups() } else { 0 }, |one| made(
            &vec![[0.0f32; 8]; if one.variant.lag { one.groups() } else { 0 }]
        ));
    /// Inverse temperatures over a table of radiances, for the radiometric output [1/K].
    GUESSES = buffer!("SensorGuesses", 4, Storage, |one| one.guesses.len(), |one| lent(&one.guesses));
    /// Digital number of each pixel, and its count of temperature in the upper half word.
    READING = buffer!("SensorReading", 16, Storage, SensorTables::groups);
    /// Host copy of `READING`.
    READBACK = buffer!("SensorReadback", 16, Readback, SensorTables::groups).each_slot();
}

/// Name of the copy of an image for the sensor.
pub(crate) const COPIED_FOR_SENSOR: &str = "read radiance for the sensor";
/// Name of the copy of what the sensor reads to the host.
pub(crate) const READ: &str = "read sensor";
/// Groups of a workgroup.
const WORKGROUP: usize = 64;

/// The sensor of an image that is drawn.
fn sensor<'a>(data: &SceneData<'a>) -> Option<&'a SensorTables> {
    data.sensor.filter(|_| data.draws())
}

/// What the passes of a sensor depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sensing {
    /// Its effects.
    pub variant: SensorVariant,
    /// Groups of four pixels.
    pub groups: usize,
    /// Cells of its halo.
    pub cells: usize,
}

impl Sensing {
    /// The passes of a sensor.
    pub(crate) fn of(tables: &SensorTables) -> Self {
        Self { variant: tables.variant, groups: tables.groups(), cells: tables.cells() }
    }
}

/// The passes of a sensor over an image that the passes before have left in `shown` and copied to the host.
pub(crate) fn passes(frame: &mut Frame, Sensing { variant, groups, cells }: Sensing, shown: &'static Resource) {
    let over =
        |name: &str, shader: Shader, count: usize| Pass::dispatch(name, shader, count.div_ceil(WORKGROUP) as u32);
    let free = |resource: &'static Resource| barrier(resource, COMPUTED, COMPUTE_WRITE);
    let done = |resource: &'static Resource| barrier(resource, COMPUTE_WRITE, COMPUTE_READ);
    let (spread, halo, copies) = (variant.spread, variant.halo, variant.copies());
    if copies {
        // The sensor may still read the last image.
        frame.wait([barrier(&SEEN, COMPUTED, COPY_WRITE)]);
        frame.pass(Pass::copy(COPIED_FOR_SENSOR, shown, &SEEN));
    }
    let used = [
        copies.then(|| barrier(&SEEN, COPY_WRITE, COMPUTE_READ)),
        spread.then(|| done(&FINE)),
        spread.then(|| free(&ROWS)),
        halo.then(|| free(&CELLS)),
    ];
    frame.wait(used.into_iter().flatten());
    if spread {
        frame.pass(over("sensor_rows", Shader::plain("sensor_rows.comp"), groups));
    }
    if halo {
        frame.pass(over("sensor_cells", Shader::plain("sensor_cells.comp"), cells));
        frame.wait([done(&CELLS), free(&HALO)]);
        frame.pass(over("sensor_halo", Shader::plain("sensor_halo.comp"), cells));
    }
    let made = [
        spread.then(|| done(&ROWS)),
        halo.then(|| done(&HALO)),
        variant.lag.then(|| barrier(&BOLOMETER, COMPUTE_WRITE, COMPUTE)),
        Some(barrier(&READING, COPIED, COMPUTE_WRITE)),
    ];
    frame.wait(made.into_iter().flatten());
    frame.pass(over("sensor_pixel", variant.shader(), groups));
    frame.wait([barrier(&READING, COMPUTE_WRITE, COPY_READ)]);
    frame.pass(Pass::copy(READ, &READING, &READBACK));
    frame.wait([to_host(&READBACK)]);
}

impl SensorVariant {
    /// Whether the sensor reads the pixels themselves. A point spread reads their texels.
    fn copies(&self) -> bool {
        self.halo || !self.spread
    }

    /// Its shader, such as `sensor_pixel.spread.noise`.
    pub(crate) fn shader(&self) -> Shader {
        let words = [
            (self.spread, "spread"),
            (self.halo, "halo"),
            (self.vignette == Vignette::Cos4, "cos4"),
            (self.vignette == Vignette::Map, "map"),
            (self.lag, "lag"),
            (self.noise, "noise"),
            (self.pattern, "pattern"),
            (self.bad, "bad"),
            (self.kelvin, "kelvin"),
        ];
        Shader::with("sensor_pixel.comp", &words)
    }
}
