//! Measures the cost of a scene's sensor: images with it, with each effect alone, and without it.

use std::sync::Arc;
use std::time::Instant;

use isotherm::Scene;
use isotherm::internals::{
    Context, Detector, DeviceEngine, Engine, EngineOrder as Order, Prepared, Sensor, SensorOptics, pose_at,
};

use super::AnyError;

/// Images of a measurement.
const IMAGES: u32 = 60;
/// Rounds over all sensors, because other programs may run meanwhile.
const ROUNDS: usize = 5;

/// Prints the time of an image with each sensor beyond that without one.
pub fn measure(context: &Arc<Context>, scene: Scene) -> Result<(), AnyError> {
    let mut prepared = Prepared::from_scene(scene, &mut |_| {})?;
    let whole = prepared.scene.sensor.clone().ok_or("the scene has no [sensor]")?;
    let camera = prepared.scene.require_camera()?.clone();
    let optics = SensorOptics { transmission: 1.0, lens: None, housing: None };
    let plain = Sensor {
        spread: None,
        halo: None,
        vignetting: None,
        optics,
        time_constant: None,
        noise: None,
        pattern: None,
        detector: Detector { bad_pixels: 0.0, ..whole.detector },
        kelvin_per_count: None,
        ..whole.clone()
    };
    let sensors = [
        ("none", None),
        ("digital numbers", Some(plain.clone())),
        ("point spread", Some(Sensor { spread: whole.spread.clone(), ..plain.clone() })),
        ("stray light", Some(Sensor { halo: whole.halo, ..plain.clone() })),
        ("vignetting", Some(Sensor { vignetting: whole.vignetting.clone(), ..plain.clone() })),
        ("lag", Some(Sensor { time_constant: whole.time_constant, ..plain.clone() })),
        ("noise", Some(Sensor { noise: whole.noise, ..plain.clone() })),
        ("pattern", Some(Sensor { pattern: whole.pattern, ..plain.clone() })),
        ("bad pixels", Some(Sensor { detector: whole.detector, ..plain.clone() })),
        ("temperatures", Some(Sensor { kelvin_per_count: whole.kelvin_per_count, ..plain })),
        ("all", Some(whole)),
    ];
    let mut engines = Vec::new();
    for (name, sensor) in sensors {
        prepared.scene.sensor = sensor;
        let mut engine = DeviceEngine::new(context, &prepared, Some(&camera))?;
        engine.settle_at(300.0, prepared.nodes.vertex_of_node.len())?;
        engines.push((name, engine, f64::INFINITY, f64::INFINITY));
    }
    let joints = prepared.loads.joints_at(0.0).1;
    let mut time = 0.0;
    // The first round compiles pipelines.
    for round in 0..=ROUNDS {
        for (_, engine, wall, busy) in &mut engines {
            let (mut least, before) = (f64::INFINITY, processor_seconds());
            for _ in 0..IMAGES {
                time += 0.1;
                let began = Instant::now();
                engine
                    .submit(None, Order { pose: pose_at(&prepared, 0.0), joints: &joints, time, ..Order::default() })?;
                engine.deliver()?;
                least = least.min(began.elapsed().as_secs_f64() * 1e3);
            }
            if round > 0 {
                *wall = wall.min(least);
                *busy = busy.min((processor_seconds() - before) * 1e3 / f64::from(IMAGES));
            }
        }
    }
    println!(
        "Image of {} x {} pixels; {ROUNDS} rounds of {IMAGES} images, the least of each\n",
        camera.width, camera.height
    );
    println!("| sensor | wall [ms] | beyond none [ms] | processor [ms] | beyond none [ms] |");
    println!("|---|---|---|---|---|");
    let (wall_0, busy_0) = (engines[0].2, engines[0].3);
    for (name, _, wall, busy) in &engines {
        println!("| {name} | {wall:.2} | {:.2} | {busy:.2} | {:.2} |", wall - wall_0, busy - busy_0);
    }
    Ok(())
}

/// Processor time of this program [s], which does not depend on other programs (proc(5), `/proc/self/stat`: fields 14
/// and 15, in units of 1/100 s). NaN if there is no such file.
fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<f64> = stat.rsplit(')').next().unwrap_or_default().split(' ').flat_map(str::parse).collect();
    // The state, the third field, is not a number.
    fields.get(10).zip(fields.get(11)).map_or(f64::NAN, |(user, system)| (user + system) / 100.0)
}
