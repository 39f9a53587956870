//! Measures the start of a scene: device, shaders, pipelines, and the whole program next to another build.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use isotherm::internals::{
    Context, DeviceEngine, Engine, EngineOrder as Order, EngineStep, Prepared, camera_from_body,
};
use isotherm::{Reach, Scene};

use super::AnyError;

/// Prints median and minimum of a number of rounds. `before` is another build of `isotherm` that takes turns with the
/// one beside this program.
pub fn measure(scene: &Path, device: Option<&str>, before: Option<&Path>, rounds: usize) -> Result<(), AnyError> {
    let prepared = Prepared::from_scene(Scene::load_within(scene, Reach::Anywhere)?, &mut |_| {})?;
    let camera = prepared.scene.require_camera()?.clone();
    let step = prepared.scene.time.step;
    let load = prepared.loads.step_load(0.0, step);
    let shaders: BTreeSet<_> = prepared.step_ranges().iter().map(|range| range.variant.shader()).collect();
    let names = ["open the device", "all of the scene on it, first time", "second time, shaders known", "first image"];
    let mut parts = names.map(|name| (name, Vec::new()));
    let mut compiled = Vec::new();
    for _ in 0..rounds {
        let mut clock = Instant::now();
        let mut passed = || std::mem::replace(&mut clock, Instant::now()).elapsed().as_secs_f64() * 1e3;
        let context = Context::open(device, false)?;
        parts[0].1.push(passed());
        drop(DeviceEngine::new(&context, &prepared, Some(&camera))?);
        parts[1].1.push(passed());
        let mut engine = DeviceEngine::new(&context, &prepared, Some(&camera))?;
        parts[2].1.push(passed());
        engine.settle(&load, 0.0)?;
        let pose = Some(camera_from_body(&camera, &prepared.loads.sky_model().sky(step)));
        let order = Order { pose, joints: &prepared.loads.joints_at(step).1, temperatures: true, ..Order::default() };
        engine.submit(Some(EngineStep { load: &load, steps: 1.0, start: 0.0, length: step }), order)?;
        engine.deliver()?;
        parts[3].1.push(passed());
        for shader in &shaders {
            shader.compile()?;
        }
        compiled.push(passed() / shaders.len() as f64);
    }
    println!("Start of scene '{}', {rounds} rounds [ms]: median (least)\n", prepared.scene.name);
    for (name, times) in &mut parts {
        println!("- {name}: {}", told(times));
    }
    println!("- one of the {} shaders of its nodes by naga: {}", shaders.len(), told(&mut compiled));
    let Some(before) = before else { return Ok(()) };

    // A warm-up would hide the start, so the copy of the scene has none.
    let folder = std::env::temp_dir().join(format!("isotherm_start_up_{}", std::process::id()));
    std::fs::create_dir(&folder)?;
    let beside = scene.canonicalize()?;
    for file in std::fs::read_dir(beside.parent().ok_or("a scene is in a folder")?)? {
        let file = file?;
        if file.file_type()?.is_file() {
            std::fs::copy(file.path(), folder.join(file.file_name()))?;
        }
    }
    let text = std::fs::read_to_string(scene)?;
    let cold: Vec<_> = text.lines().filter(|line| !line.starts_with("warm_up")).collect();
    std::fs::write(folder.join("start_up.toml"), cold.join("\n"))?;
    let this = std::env::current_exe()?.with_file_name("isotherm");
    let mut times = [Vec::new(), Vec::new()];
    for round in 0..2 * rounds {
        // Each program is first in every other round.
        let which = (round + round / 2) % 2;
        let mut command = Command::new([before, &this][which]);
        command.arg("render").arg(folder.join("start_up.toml")).args(["--time", "0", "-o"]).arg(folder.join("out.exr"));
        command.args(device.iter().flat_map(|name| ["--device", name])).stdout(Stdio::null()).stderr(Stdio::null());
        let began = Instant::now();
        let status = command.status()?;
        times[which].push(began.elapsed().as_secs_f64() * 1e3);
        if !status.success() {
            return Err(format!("{command:?} ended with {status}").into());
        }
    }
    std::fs::remove_dir_all(&folder)?;
    println!("\nWhole `isotherm render` of time 0 without a warm-up, builds in turns [ms]: median (least)\n");
    let mut differences: Vec<f64> = times[1].iter().zip(&times[0]).map(|(after, before)| after - before).collect();
    println!("- {}: {}\n- {}: {}", before.display(), told(&mut times[0]), this.display(), told(&mut times[1]));
    println!("- difference of each round: {}", told(&mut differences));
    Ok(())
}

fn told(times: &mut [f64]) -> String {
    times.sort_by(f64::total_cmp);
    format!("{:.1} ({:.1})", times[times.len() / 2], times[0])
}
