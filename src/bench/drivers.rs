//! Compares temperatures and images of one scene between all devices.

use std::sync::Arc;

use serde::Serialize;

use super::frames::{IMAGE, resize};
use crate::gpu::context::Context;
use crate::scene::Scene;
use crate::simulation::device_engine::DeviceEngine;
use crate::simulation::engine::{Engine, EngineStep, Order};
use crate::simulation::image::Image;
use crate::simulation::pose_at;
use crate::simulation::prepare::Prepared;
use crate::simulation::surroundings::surroundings_at;

/// Number of steps before the image.
const STEPS: u32 = 40;

/// The comparison of two devices on one scene.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct DriverRow {
    /// The reference device and the compared device.
    pub(crate) devices: [String; 2],
    pub(crate) scene: String,
    /// Number of nodes, including padding.
    pub(crate) nodes: usize,
    /// Root mean square over nodes [K].
    pub(crate) rms_k: f64,
    /// Largest [K].
    pub(crate) max_k: f64,
    /// Pixels with a surface in either image.
    pub(crate) pixels: usize,
    /// Pixels with different parts or materials.
    pub(crate) other_part: usize,
    /// Largest relative difference of radiance in pixels with the same part.
    pub(crate) radiance_relative: f64,
    /// The reason if a device could not be compared.
    pub(crate) failed: Option<String>,
}

/// The results of a device.
struct DriverResults {
    device: String,
    temperatures: Vec<f32>,
    image: Option<Image>,
}

/// Compares every device with the first. A row states the reason if a comparison failed.
pub(crate) fn measure(devices: &[Arc<Context>], scene: &Scene) -> Vec<DriverRow> {
    let mut left = Vec::new();
    let mut rows = Vec::new();
    for context in devices {
        match run(context, scene) {
            Ok(one) => left.push(one),
            Err(reason) => rows.push(DriverRow {
                devices: [context.info.name.clone(), String::new()],
                scene: scene.name.clone(),
                failed: Some(reason.to_string()),
                ..DriverRow::default()
            }),
        }
    }
    if let Some((first, others)) = left.split_first() {
        rows.extend(others.iter().map(|other| compared(first, other, &scene.name)));
    }
    rows
}

fn run(context: &Arc<Context>, scene: &Scene) -> Result<DriverResults, Box<dyn std::error::Error>> {
    let mut scene = scene.clone();
    scene.sensor = None;
    if let Some(camera) = &mut scene.camera {
        resize(camera, IMAGE);
    }
    let prepared = Prepared::from_scene(scene, &mut |_| {})?;
    let camera = prepared.scene.require_camera()?.clone();
    let mut engine = DeviceEngine::new(context, &prepared, Some(&camera))?;
    let step = prepared.scene.time.step;
    engine.settle(&prepared.loads.step_load(0.0, step), 0.0)?;
    let mut delivered = Default::default();
    for number in 0..STEPS {
        let (start, end) = (f64::from(number) * step, f64::from(number + 1) * step);
        let load = prepared.loads.step_load(start, end);
        let last = number + 1 == STEPS;
        let joints = prepared.loads.joints_at(end).1;
        let pose = if last { pose_at(&prepared, end) } else { None };
        let surroundings = pose.and_then(|pose| surroundings_at(&prepared, end, &pose));
        let order = Order { pose, joints: &joints, temperatures: last, surroundings, ..Order::default() };
        engine.submit(Some(EngineStep { load: &load, steps: 1.0, start, length: step }), order)?;
        delivered = engine.deliver()?;
    }
    Ok(DriverResults {
        device: context.info.name.clone(),
        temperatures: delivered.temperatures.unwrap_or_default(),
        image: delivered.image,
    })
}

fn compared(first: &DriverResults, other: &DriverResults, scene: &str) -> DriverRow {
    let kelvins = || first.temperatures.iter().zip(&other.temperatures).map(|(a, b)| f64::from((a - b).abs()));
    let squares: f64 = kelvins().map(|kelvin| kelvin * kelvin).sum();
    let images = first.image.as_ref().zip(other.image.as_ref());
    let pixels = || images.into_iter().flat_map(|(a, b)| (0..a.part.len()).map(move |pixel| (pixel, a, b)));
    let drawn = pixels().filter(|(pixel, a, b)| a.part[*pixel] > 0 || b.part[*pixel] > 0).count();
    let differs = |(pixel, a, b): &(usize, &Image, &Image)| a.labels(*pixel) != b.labels(*pixel);
    let other_part = pixels().filter(differs).count();
    let same_part = pixels().filter(|one| !differs(one) && one.1.part[one.0] > 0);
    let radiances = same_part.map(|(pixel, a, b)| (a.radiance[pixel], b.radiance[pixel]));
    // A visible surface has a positive radiance, unless it is too small for f32.
    let relative = radiances.map(|(a, b)| f64::from((a - b).abs() / a.max(f32::MIN_POSITIVE)));
    DriverRow {
        devices: [first.device.clone(), other.device.clone()],
        scene: scene.to_owned(),
        nodes: first.temperatures.len(),
        rms_k: (squares / first.temperatures.len().max(1) as f64).sqrt(),
        max_k: kelvins().fold(0.0, f64::max),
        pixels: drawn,
        other_part,
        radiance_relative: relative.fold(0.0, f64::max),
        failed: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::frame::tests::sphere;

    #[test]
    fn what_differs_between_devices_is_counted() {
        let left = |temperature, radiance, part| DriverResults {
            device: String::new(),
            temperatures: vec![300.0, temperature],
            image: Some(Image {
                radiance: vec![radiance, 5.0, 0.0],
                part: vec![1, part, 0],
                material: vec![1, 1, 0],
                ..sphere(3, 1, 0)
            }),
        };
        let row = compared(&left(300.0, 10.0, 2), &left(303.0, 11.0, 3), "scene");
        assert_eq!((row.pixels, row.other_part, row.max_k), (2, 1, 3.0));
        assert!((row.radiance_relative - 0.1).abs() < 1e-6 && (row.rms_k - 4.5f64.sqrt()).abs() < 1e-6, "{row:?}");
    }
}
