//! Measures the cost of what a scene's images show besides emission: reflections, also of the craft itself, sky, a planet with a map, emissivity by angle.

use std::sync::Arc;

use isotherm::Scene;
use isotherm::internals::{
    Background, ByAngle, Context, DayLaw, DeviceEngine, Engine, EngineOrder as Order, PlanetPattern, Prepared,
    Reflections, Surrounded, pose_at, surroundings_at,
};

use super::AnyError;

/// Width and height of the image [px].
const SIZE: [u32; 2] = [640, 512];
/// Images of a measurement.
const IMAGES: u32 = 40;
/// The same with rays, which take much longer.
const TRACED_IMAGES: u32 = 2;
/// Rounds over all kinds of images, because other programs may run meanwhile.
const ROUNDS: usize = 5;

/// Prints the time of the passes `radiance` and `traced` of each kind of image, and its share beyond emission alone.
pub fn measure(context: &Arc<Context>, scene: Scene) -> Result<(), AnyError> {
    let mut prepared = Prepared::from_scene(scene, &mut |_| {})?;
    let mut camera = prepared.scene.require_camera()?.clone();
    let shrunk = f64::from(SIZE[0]) / f64::from(camera.width);
    camera.lens.focal = camera.lens.focal.map(|focal| shrunk * focal);
    camera.lens.centre = SIZE.map(|side| 0.5 * f64::from(side));
    [camera.width, camera.height] = SIZE;
    prepared.scene.camera = Some(camera.clone());
    let plain = Surrounded { planet_temperature: 255.0, ..Surrounded::default() };
    let environment = Surrounded { reflections: Reflections::Environment, ..plain.clone() };
    let traced = Surrounded { reflections: Reflections::Traced, ..plain.clone() };
    let sky = Surrounded { background: Background::Planet, ..plain.clone() };
    let both = Surrounded { background: Background::Planet, ..environment.clone() };
    let mapped =
        Surrounded { planet: Some(Arc::new(PlanetPattern::day_night(300.0, 240.0, DayLaw::Cosine))), ..both.clone() };
    let mut engines = Vec::new();
    for (name, surrounded, specular, law) in [
        ("emission alone", &plain, 0.0, false),
        ("emissivity by angle", &plain, 0.0, true),
        ("planet behind", &sky, 0.0, false),
        ("environment, diffuse", &environment, 0.0, false),
        ("environment, mirrors of roughness 0.2", &environment, 0.5, false),
        ("traced, diffuse", &traced, 0.0, false),
        ("traced, mirrors of roughness 0.2", &traced, 0.5, false),
        ("both, with a map", &mapped, 0.5, false),
        ("both, with a map and emissivity by angle", &mapped, 0.5, true),
    ] {
        prepared.scene.surrounded = surrounded.clone();
        for material in &mut prepared.materials {
            for gloss in &mut material.gloss {
                (gloss.specular, gloss.roughness) = (specular, if specular > 0.0 { 0.2 } else { 0.0 });
            }
            for face in &mut material.in_band {
                face.by_angle = law.then_some(ByAngle::Fresnel { n: 1.5, k: 0.1 });
            }
        }
        let mut engine = DeviceEngine::new(context, &prepared, Some(&camera))?;
        engine.settle_at(300.0, prepared.nodes.vertex_of_node.len())?;
        engines.push((name, prepared.scene.surrounded.clone(), engine));
    }
    let joints = prepared.loads.joints_at(0.0).1;
    let mut shown = 0;
    // The first round compiles pipelines.
    for _ in 0..=ROUNDS {
        for (_, surrounded, engine) in &mut engines {
            prepared.scene.surrounded = surrounded.clone();
            let images = if surrounded.reflections == Reflections::Traced { TRACED_IMAGES } else { IMAGES };
            for _ in 0..images {
                let pose = pose_at(&prepared, 0.0);
                let surroundings = pose.and_then(|pose| surroundings_at(&prepared, 0.0, &pose));
                engine.submit(None, Order { pose, joints: &joints, surroundings, ..Order::default() })?;
                let image = engine.deliver()?.image;
                shown = image.iter().flat_map(|image| &image.part).filter(|part| **part > 0).count();
            }
        }
    }
    println!(
        "Image of {} x {} pixels, {shown} of which show the craft; the least of {} images, or {} with rays\n",
        SIZE[0],
        SIZE[1],
        IMAGES as usize * (ROUNDS + 1),
        TRACED_IMAGES as usize * (ROUNDS + 1)
    );
    println!("| image | passes `radiance` and `traced` [ms] | beyond emission alone |");
    println!("|---|---|---|");
    let least = |engine: &DeviceEngine| {
        let of = |pass: &str| {
            let times = engine.pass_times().and_then(|times| times.get(pass));
            times.map(|times| times.iter().copied().fold(f64::INFINITY, f64::min))
        };
        of("radiance").map_or(f64::NAN, |radiance| radiance + of("traced").unwrap_or(0.0))
    };
    let first = least(&engines[0].2);
    for (name, _, engine) in &engines {
        println!("| {name} | {:.2} | {:+.0} % |", least(engine), 100.0 * (least(engine) / first - 1.0));
    }
    Ok(())
}
