//! Measures the cost of building a scene by number of nodes: seconds, and bytes a node on host and device. Each density
//! runs in its own process, which then has its own peak of memory.

use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

use isotherm::internals::{
    Context, Density, DeviceData, DeviceEngine, Edges, Engine, EngineOrder as Order, EngineStep, Prepared, StepCost,
    camera_from_body, device_bytes,
};
use isotherm::{Scene, internals};

use super::AnyError;

/// Prints a table with a row for each longest edge [m]. This program starts itself with `arguments` for each row.
pub fn measure(edges: &[f64], arguments: &[String]) -> Result<(), AnyError> {
    println!(
        "Building a scene, to where nodes are in the order of the device; then uploading, settling at 300 K and three steps, the last \
         with an image. Peaks are of the whole process.\n"
    );
    println!(
        "| longest edge [m] | nodes | triangles | build [s] | ns a node | host, peak [bytes a node] | on the device [bytes a node] \
         | upload and settle [s] | three steps [s] | process, peak [bytes a node] |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for edge in edges {
        let status =
            Command::new(std::env::current_exe()?).args(arguments).args(["--build-one", &edge.to_string()]).status()?;
        if !status.success() {
            return Err(format!("building with edges of {edge} m ended with {status}").into());
        }
    }
    Ok(())
}

/// Builds and steps one density, and prints its row.
pub fn measure_one(context: &Arc<Context>, mut scene: Scene, edge: f64) -> Result<(), AnyError> {
    scene.density = Density { model: Edges { max: Some(edge), min: scene.density.model.min }, ..Density::default() };
    let before = internals::peak_memory().ok_or("this system does not tell the peak of memory")?;
    let began = Instant::now();
    let prepared = Prepared::from_scene(scene, &mut |_| {})?;
    let build = began.elapsed().as_secs_f64();
    let nodes = prepared.nodes.count as f64;
    let peak = || internals::peak_memory().map_or(f64::NAN, |peak| peak.saturating_sub(before) as f64 / nodes);
    let host = peak();

    let camera = prepared.scene.camera.clone();
    let data = DeviceData::new(&prepared);
    let plan = data.scene_data(&prepared, camera.as_ref()).plan();
    let device = device_bytes(&plan);
    drop(data);
    let step = prepared.scene.time.step;
    let began = Instant::now();
    let mut engine = DeviceEngine::new(context, &prepared, camera.as_ref())?;
    engine.settle_at(300.0, prepared.nodes.vertex_of_node.len())?;
    let settle = began.elapsed().as_secs_f64();
    let began = Instant::now();
    for number in 0..3 {
        let (from, to) = (f64::from(number) * step, f64::from(number + 1) * step);
        let load = prepared.loads.step_load(from, to);
        let pose = camera.as_ref().filter(|_| number == 2);
        let pose = pose.map(|camera| camera_from_body(camera, &prepared.loads.sky_model().sky(to)));
        let advance = EngineStep { load: &load, steps: 1.0, start: from, length: step };
        let joints = prepared.loads.joints_at(to).1;
        engine.submit(Some(advance), Order { pose, joints: &joints, temperatures: true, ..Order::default() })?;
        engine.deliver()?;
    }
    let stepping = began.elapsed().as_secs_f64();
    println!(
        "| {edge} | {nodes} | {} | {build:.2} | {:.0} | {host:.0} | {:.1} | {settle:.2} | {:.2} | {:.0} |",
        prepared.triangles.len(),
        build * 1e9 / nodes,
        device as f64 / nodes,
        stepping,
        peak()
    );
    if let Some(network) = engine.network() {
        let ms = |cost: &StepCost| format!("{:.0}", cost.wall_ms);
        let steps: Vec<String> = network.costs().iter().map(ms).collect();
        println!("\nTicks of the network of {} nodes [ms]: {}", network.scene().network().len(), steps.join(", "));
        for (name, value) in network.description() {
            println!("- {name}: {value}");
        }
        println!();
    }
    Ok(())
}
