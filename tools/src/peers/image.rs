//! Times images of a scene at time 0, each waiting for the last. Also writes the triangles with their corner
//! temperatures, for a renderer without thermal model.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use glam::DAffine3;
use serde_json::{Value, json};

use isotherm::internals::{
    Camera, Context, DeviceEngine, Engine, EngineOrder as Order, Optics, Prepared, Sides, pose_at,
};
use isotherm::{Lens, Reach, Scene};

use super::AnyError;
use super::clock::Clock;

/// Number of unmeasured images that compile the passes.
const WARM_UP: usize = 3;
/// Camera motion between images [m]. It prevents reuse of the last image.
const MOVE: f64 = 1e-4;

/// Draws the scene at each scale of its width and height.
pub fn measure(
    context: &Arc<Context>,
    scene: &Path,
    output: &Path,
    scales: &[u32],
    frames: usize,
) -> Result<Value, AnyError> {
    let prepared = Prepared::from_scene(Scene::load_within(scene, Reach::Anywhere)?, &mut |_| {})?;
    let own = prepared.scene.require_camera()?.clone();
    let pose = pose_at(&prepared, 0.0).ok_or("the scene has no camera")?;
    std::fs::create_dir_all(output)?;
    let mut rows = Vec::new();
    for scale in scales {
        let camera = scaled(&own, *scale);
        let mut engine = DeviceEngine::new(context, &prepared, Some(&camera))?;
        engine.settle(&prepared.loads.step_load(0.0, 0.0), 0.0)?;
        if rows.is_empty() {
            dump(&prepared, &mut engine, output)?;
        }
        rows.push(timed(&mut engine, &camera, &pose, *scale, frames, output)?);
    }
    let rotation = pose.matrix3.to_cols_array_2d();
    let band = prepared.scene.band;
    Ok(json!({
        "triangles": prepared.triangles.len(), "nodes": prepared.nodes.count, "rows": rows,
        "camera": {
            "width": own.width, "height": own.height, "focal_px": own.lens.focal, "centre_px": own.lens.centre,
            "camera_from_body_columns": rotation, "camera_from_body_translation": pose.translation.to_array(),
        },
        "band_m": [band.lower, band.upper],
    }))
}

fn scaled(camera: &Camera, scale: u32) -> Camera {
    let factor = f64::from(scale);
    Camera {
        width: camera.width * scale,
        height: camera.height * scale,
        samples: 1,
        lens: Lens {
            focal: camera.lens.focal.map(|focal| focal * factor),
            centre: camera.lens.centre.map(|centre| centre * factor),
            ..camera.lens
        },
        ..camera.clone()
    }
}

/// Time of each image until its pixels are on the host, and of its passes on the device [ms].
fn timed(
    engine: &mut dyn Engine,
    camera: &Camera,
    pose: &DAffine3,
    scale: u32,
    frames: usize,
    output: &Path,
) -> Result<Value, AnyError> {
    let (mut clocks, mut device) = (Vec::new(), Vec::new());
    let mut last = None;
    for number in (0..frames + WARM_UP).rev() {
        let mut pose = *pose;
        // The camera moves back after the last image.
        pose.translation.z += MOVE * number as f64;
        let before = device_ms(engine);
        let clock = Clock::start();
        engine.submit(None, Order { pose: Some(pose), ..Order::default() })?;
        last = engine.deliver()?.image;
        let time = clock.stop();
        if number < frames {
            clocks.push(time);
            device.push(device_ms(engine) - before);
        }
    }
    let image = last.ok_or("no image came")?;
    let each: BTreeMap<&str, f64> =
        pass_ms(engine).into_iter().map(|(name, all)| (name, all / (frames + WARM_UP) as f64)).collect();
    let passes = json!(each);
    let radiance = image.radiance;
    let file = format!("radiance_{scale}.f32");
    write(&output.join(&file), &radiance)?;
    Ok(json!({
        "scale": scale, "width": camera.width, "height": camera.height, "clock_ms": clocks, "device_ms": device,
        "radiance": file, "passes_ms": passes,
    }))
}

fn device_ms(engine: &dyn Engine) -> f64 {
    pass_ms(engine).values().sum()
}

/// Device time of every pass so far [ms].
fn pass_ms(engine: &dyn Engine) -> BTreeMap<&str, f64> {
    let passes = engine.pass_times().into_iter().flatten();
    passes.map(|(name, samples)| (name.as_str(), samples.iter().sum())).collect()
}

/// Corners, their temperatures, and the emissivities of both faces of every triangle.
fn dump(prepared: &Prepared, engine: &mut dyn Engine, output: &Path) -> Result<(), AnyError> {
    engine.submit(None, Order { temperatures: true, ..Order::default() })?;
    let temperatures = engine.deliver()?.temperatures.ok_or("no temperatures came")?;
    let (mut corners, mut kelvins, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    for triangle in &prepared.triangles {
        for node in triangle.map(|node| node as usize) {
            corners.extend(prepared.nodes.positions[node].to_array());
            kelvins.push(temperatures[node]);
        }
        let material = &prepared.materials[prepared.nodes.group_material[triangle[0] as usize / 4] as usize];
        let emissivity = |optics: Optics| optics.emissivity as f32;
        // A face that exchanges no heat lies inside a body, so no camera sees it.
        let back = if let Sides::Both { back } = material.sides { emissivity(back) } else { 0.0 };
        faces.extend([emissivity(material.front), back]);
    }
    write(&output.join("corners.f32"), &corners)?;
    write(&output.join("temperatures.f32"), &kelvins)?;
    write(&output.join("emissivities.f32"), &faces)
}

fn write(path: &Path, values: &[f32]) -> Result<(), AnyError> {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    Ok(std::fs::write(path, bytes)?)
}
