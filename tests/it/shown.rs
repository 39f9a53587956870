//! The temperatures that images of a scene show, on a device and on the f64 reference.

use isotherm::EngineError;
use isotherm::internals::{DeviceEngine, Engine, Prepared, ReferenceEngine, run, start};

use super::craft::never;
use super::device::{assert_silent, context};

/// What an image shows.
pub struct Shown {
    /// Time since the start [s].
    pub time: f64,
    /// Number of the part and temperature [K] of every pixel with a surface.
    pub pixels: Vec<(usize, f64)>,
}

/// The images of a run on a device, and those of the reference.
pub fn images(prepared: &Prepared) -> [Vec<Shown>; 2] {
    let context = context();
    let camera = prepared.scene.camera.as_ref();
    let device = DeviceEngine::new(&context, prepared, camera).expect("a device");
    let engines: [Box<dyn Engine>; 2] = [Box::new(device), Box::new(ReferenceEngine::new(prepared, camera))];
    let found = engines.map(|mut engine| {
        let mut images = Vec::new();
        start(prepared, &mut *engine, None, &never(), &mut || ()).expect("it starts");
        run::<EngineError>(prepared, &mut *engine, None, &never(), &mut |result| {
            let Some(image) = result.delivered.image else { return Ok(()) };
            let all = image.temperature.iter().zip(&image.part);
            let surface = |(kelvin, part): (&f32, &u32)| Some(((*part as usize).checked_sub(1)?, f64::from(*kelvin)));
            images.push(Shown { time: result.time, pixels: all.filter_map(surface).collect() });
            Ok(())
        })
        .expect("it runs");
        images
    });
    assert_silent(&context);
    found
}
