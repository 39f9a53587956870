//! Measures figures of docs/benchmarks.md: the thermal pass, whole steps, start-up, and
//! errors.

mod build_cost;
#[path = "peers/clock.rs"]
mod clock;
mod exchange_cost;
mod light_cost;
mod one_pass;
mod sensor_cost;
mod start_up;
mod surroundings_cost;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use clap::Parser;
use isotherm::internals::{
    Context, Curve, DeviceData, DeviceEngine, Domain, Engine, EngineOrder as Order, EngineStep, Function, PassTime,
    Prepared, Profile, Response, Retarget, Shapes, StepKind, StepLoad, TemperatureSample, ThermalVariant, Transition,
    camera_from_body,
};
use isotherm::{Reach, Scene, internals};

use isotherm_tools::exit_code;

type AnyError = Box<dyn std::error::Error>;

/// Measure the thermal pass and whole steps; prints Markdown tables.
///
/// Example: target/release/measure --scene models/iss.toml
#[derive(Parser)]
struct Arguments {
    /// Scene whose loads and steps are measured
    #[arg(long, default_value = "models/iss.toml")]
    scene: PathBuf,
    /// Numbers of nodes of the thermal pass
    #[arg(long, value_delimiter = ',', default_values_t = [100_000, 1_000_000, 10_000_000])]
    nodes: Vec<usize>,
    /// Longest edges of the scene's model [m]
    #[arg(long, value_delimiter = ',', default_values_t = [2.0, 1.0, 0.5])]
    edges: Vec<f64>,
    /// Measure the sensor on the scene's image alone
    #[arg(long)]
    sensor: bool,
    /// Measure reflections, sky and emissivity by angle on the scene's image alone
    #[arg(long)]
    surroundings: bool,
    /// Leave out the whole steps
    #[arg(long)]
    nodes_only: bool,
    /// Measure only the cost of response functions relative to a quadratic one
    #[arg(long)]
    functions_only: bool,
    /// Measure only the network of the scene in one pass, at --one-pass-edges
    #[arg(long)]
    one_pass: bool,
    /// Longest edges of --one-pass [m]
    #[arg(long, value_delimiter = ',', default_values_t = [6.0])]
    one_pass_edges: Vec<f64>,
    /// Lengths of a step of --one-pass [s]
    #[arg(long, value_delimiter = ',', default_values_t = [1.0, 15.43, 60.0])]
    one_pass_lengths: Vec<f64>,
    /// Most steps of a run of --one-pass
    #[arg(long, default_value_t = 360)]
    one_pass_steps: u32,
    /// Tolerance of the integrator that --one-pass compares with [K]
    #[arg(long, default_value_t = 0.01)]
    one_pass_tolerance: f64,
    /// Measure only what radiation between surfaces adds to a step of the scene
    #[arg(long)]
    exchange: bool,
    /// Size of the patches of --exchange [m]; the scene's own without
    #[arg(long)]
    patch_edge: Option<f64>,
    /// Steps of --exchange from time 0
    #[arg(long, default_value_t = 50)]
    exchange_steps: u32,
    /// How often --exchange takes them
    #[arg(long, default_value_t = 4)]
    exchange_rounds: u32,
    /// Measure only the building of the scene, at --build-edges
    #[arg(long)]
    build: bool,
    /// Longest edges of --build [m]; the defaults give 1e5, 1e6 and 1e7 nodes of the station
    #[arg(long, value_delimiter = ',', default_values_t = [1.5, 0.35, 0.09])]
    build_edges: Vec<f64>,
    /// Measure only how long finding sunlight on areas takes, at --light-edges
    #[arg(long)]
    light: bool,
    /// Longest edges of --light [m]
    #[arg(long, value_delimiter = ',', default_values_t = [4.0, 1.0, 0.5])]
    light_edges: Vec<f64>,
    /// Measure only the start of the scene and of the `isotherm` beside this program
    #[arg(long)]
    start_up: bool,
    /// Another build of `isotherm` that takes turns with it
    #[arg(long, value_name = "FILE", requires = "start_up")]
    before: Option<PathBuf>,
    /// Build only this longest edge, in this process
    #[arg(long, hide = true)]
    build_one: Option<f64>,
    /// Steps of each measurement
    #[arg(long, default_value_t = 30)]
    steps: u32,
    /// Device whose name contains NAME
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
}

fn main() -> ExitCode {
    exit_code(measure(&Arguments::parse()))
}

fn measure(arguments: &Arguments) -> Result<(), AnyError> {
    let context = Context::open(arguments.device.as_deref(), false)?;
    if let Some(edge) = arguments.build_one {
        return build_cost::measure_one(&context, Scene::load_within(&arguments.scene, Reach::Anywhere)?, edge);
    }
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    println!("Device: {}, {}; load average {}\n", context.info.name, context.info.driver, load.trim());
    if arguments.build {
        let mut same = vec!["--scene".to_owned(), arguments.scene.display().to_string()];
        same.extend(arguments.device.iter().flat_map(|device| ["--device".to_owned(), device.clone()]));
        return build_cost::measure(&arguments.build_edges, &same);
    }
    if arguments.start_up {
        let (device, before) = (arguments.device.as_deref(), arguments.before.as_deref());
        return start_up::measure(&arguments.scene, device, before, arguments.steps as usize);
    }
    let scene = Scene::load_within(&arguments.scene, Reach::Anywhere)?;
    if arguments.sensor {
        return sensor_cost::measure(&context, scene);
    }
    if arguments.surroundings {
        return surroundings_cost::measure(&context, scene);
    }
    if arguments.light {
        return light_cost::measure(&scene, &arguments.light_edges);
    }
    if arguments.exchange {
        let (steps, rounds) = (arguments.exchange_steps, arguments.exchange_rounds);
        return exchange_cost::measure(&context, scene, arguments.patch_edge, steps, rounds);
    }
    if arguments.one_pass {
        let (edges, lengths) = (&arguments.one_pass_edges, &arguments.one_pass_lengths);
        let (steps, tolerance) = (arguments.one_pass_steps, arguments.one_pass_tolerance);
        return one_pass::measure(&context, &scene, edges, lengths, steps, tolerance);
    }
    if arguments.functions_only {
        return functions(arguments, &context, &scene);
    }
    thermal_pass(arguments, &context, &scene)?;
    functions(arguments, &context, &scene)?;
    if arguments.nodes_only { Ok(()) } else { whole_ticks(arguments, &context, &scene) }
}

/// Time a node and step [ns] while only time passes, and with loads, balance and a target that moves every step.
fn thermal_pass(arguments: &Arguments, context: &Arc<Context>, scene: &Scene) -> Result<(), AnyError> {
    println!("Thermal pass, quadratic transition, nanoseconds a node and step: median (10 to 90 %)\n");
    println!(
        "| nodes | constant target | moving target: Sun | Sun, infrared | Sun, albedo | all three | all three, mean of an orbit \
         | bytes a node |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let loads = isotherm::internals::StepLoads::new(&scene.orbit, &scene.attitude, &scene.environment)?;
    let step = scene.time.step;
    let count = f64::from(arguments.steps);
    let load = |start: f64| loads.step_load(start, start + step);
    let lit: Vec<StepLoad> = (0..arguments.steps).map(|i| load(f64::from(i) * step)).collect();
    let orbit: Vec<StepLoad> =
        (0..arguments.steps).map(|i| load(f64::from(i) / count * scene.orbit.period())).collect();
    for &nodes in &arguments.nodes {
        let nodes = nodes.next_multiple_of(256);
        let variant = |kind, sun, planet_ir, albedo| ThermalVariant {
            sun,
            planet_ir,
            albedo,
            ..ThermalVariant::bare(kind, Curve::Power)
        };
        let mut row = Vec::new();
        let mut bytes = 0.0;
        for variant in [
            variant(StepKind::Advance, false, false, false),
            variant(StepKind::Merge, true, false, false),
            variant(StepKind::Merge, true, true, false),
            variant(StepKind::Merge, true, false, true),
            variant(StepKind::Merge, true, true, true),
        ] {
            let (times, bytes_a_node) = time_pass(context, variant, &Shapes::default(), nodes, &lit)?;
            let time = times.first().ok_or("the device has no timestamps")?;
            let [median, low, high] = [time.median_ms, time.p10_ms, time.p90_ms].map(|ms| ms * 1e6 / nodes as f64);
            row.push(format!("{median:.2} ({low:.2} to {high:.2})"));
            bytes = bytes_a_node;
        }
        let (times, _) =
            time_pass(context, variant(StepKind::Merge, true, true, true), &Shapes::default(), nodes, &orbit)?;
        let sum: f64 = times.iter().map(|time| time.median_ms * time.count as f64).sum();
        let ticks: f64 = times.iter().map(|time| time.count as f64).sum();
        row.push(format!("{:.2}", sum / ticks * 1e6 / nodes as f64));
        println!("| {nodes} | {} | {bytes:.1} |", row.join(" | "));
    }
    println!(
        "\nA moving target has its load and balance worked out anew. Bytes a node of the last column: state, temperature, normals \
         and tables; positions and triangles come with an image.\n"
    );
    Ok(())
}

/// Cost of a node with each kind of function relative to a quadratic one, and cost of a function that no node uses.
fn functions(arguments: &Arguments, context: &Arc<Context>, scene: &Scene) -> Result<(), AnyError> {
    const NODES: usize = 1 << 18;
    println!(
        "Response functions: processor time of a step of the thermal pass over that of a quadratic transition in the same round, \
         {NODES} nodes, target moving every step: median of {ROUNDS} rounds (least to most)\n"
    );
    println!("| function | merge: Sun | all three loads | restart: Sun | all three loads |");
    println!("|---|---|---|---|---|");
    let loads = isotherm::internals::StepLoads::new(&scene.orbit, &scene.attitude, &scene.environment)?;
    let step = scene.time.step;
    let steps: Vec<StepLoad> =
        (0..arguments.steps).map(|i| loads.step_load(f64::from(i) * step, f64::from(i + 1) * step)).collect();
    let columns = [Retarget::Merge, Retarget::Restart].into_iter().flat_map(|rule| [(rule, false), (rule, true)]);
    let columns: Vec<(Retarget, bool)> = columns.collect();
    let time = |function: &Function, (retarget, all): (Retarget, bool)| -> Result<f64, AnyError> {
        let profile = Profile { function: function.clone(), t_max_steps: 1000.0 };
        let domain = Domain::Temperature;
        let transition = Transition { heating: profile.clone(), cooling: profile, retarget, domain };
        let (kind, curve) = internals::curve(&transition);
        let variant = ThermalVariant { sun: true, planet_ir: all, albedo: all, ..ThermalVariant::bare(kind, curve) };
        // Processor time does not depend on other programs. The difference of few steps is mostly the pipeline's
        // creation.
        let processor_ms = |steps: &[StepLoad]| -> Result<f64, AnyError> {
            let clock = clock::Clock::start();
            time_pass(context, variant, &Shapes::one(&transition), NODES, steps)?;
            Ok(clock.stop()[1])
        };
        let few = processor_ms(&steps[..1])?;
        Ok((processor_ms(&steps)? - few) / (2.0 * (steps.len() as f64 - 1.0)))
    };
    for function in measured_functions()? {
        let mut cells = Vec::new();
        for &setting in &columns {
            let mut ratios = Vec::new();
            for _ in 0..ROUNDS {
                let before = time(&Function::Quadratic, setting)?;
                ratios.push(time(&function, setting)? / before);
            }
            ratios.sort_by(f64::total_cmp);
            cells.push(format!("{:.2} ({:.2} to {:.2})", ratios[ROUNDS / 2], ratios[0], ratios[ROUNDS - 1]));
        }
        println!("| {function} | {} |", cells.join(" | "));
    }
    unused_function(context, scene)
}

/// Rounds of the comparison of functions.
const ROUNDS: usize = 3;

/// One function of every kind.
fn measured_functions() -> Result<Vec<Function>, AnyError> {
    let points = [(0.0, 300.0), (1.0, 280.0), (2.0, 261.0), (4.0, 235.0), (7.0, 211.0), (9.0, 203.0), (12.0, 200.0)];
    let samples: Vec<_> = points.iter().map(|&(time, temperature)| TemperatureSample { time, temperature }).collect();
    let long: Vec<_> = (0..=100)
        .map(|i| TemperatureSample {
            time: f64::from(i),
            temperature: 300.0 - 100.0 * (1.0 - (-0.03 * f64::from(i)).exp()),
        })
        .collect();
    Ok(vec![
        Function::expression("s*(2.0-s)")?,
        Function::expression("s*s*(3.0-2.0*s)")?,
        Function::expression("(1.0 - exp(-2.0*s)) / (1.0 - exp(-2.0))")?,
        Function::table(&samples, None)?,
        Function::table(&long, None)?,
        Function::polynomial(&[0.0, 0.0, 3.0, -2.0])?,
        Function::exponential(3.0)?,
        Function::logarithmic(1.0)?,
        Function::logarithmic(9.0)?,
    ])
}

/// Compares the scene with and without an unused material whose response is an expression.
fn unused_function(context: &Arc<Context>, scene: &Scene) -> Result<(), AnyError> {
    let plain = Prepared::from_scene(scene.clone(), &mut |_| {})?;
    let mut with = Prepared::from_scene(scene.clone(), &mut |_| {})?;
    let mut unused = with.materials[0].clone();
    unused.name = "unused".to_owned();
    let profile = Profile { function: Function::expression("s*s*(3.0-2.0*s)")?, t_max_steps: 100.0 };
    let (retarget, domain) = (Retarget::Merge, Domain::Temperature);
    unused.response = Response::Transition(Transition { heating: profile.clone(), cooling: profile, retarget, domain });
    with.materials.push(unused);
    let thermal = |prepared: &Prepared| -> Result<(f64, usize, u64), AnyError> {
        let mut engine = DeviceEngine::new(context, prepared, None)?;
        let step = prepared.scene.time.step;
        engine.settle(&prepared.loads.step_load(0.0, step), 0.0)?;
        for number in 0..60 {
            let start = f64::from(number) * step;
            let load = prepared.loads.step_load(start, start + step);
            engine.submit(Some(EngineStep { load: &load, steps: 1.0, start, length: step }), Order::default())?;
            engine.deliver()?;
        }
        let times = engine.pass_times().ok_or("no pass times")?;
        let steps = times.iter().filter(|(name, _)| name.starts_with("thermal_step"));
        let medians = steps.filter_map(|(name, all)| PassTime::from_samples(name, &all[all.len() / 2..]));
        let data = DeviceData::new(prepared);
        let bytes = data.scene_data(prepared, None).plan().iter().map(|planned| planned.bytes).sum();
        Ok((medians.map(|time| time.median_ms).sum(), prepared.step_ranges().len(), bytes))
    };
    let mut ratios = Vec::new();
    let mut sizes = None;
    for _ in 0..ROUNDS {
        let (before, after) = (thermal(&plain)?, thermal(&with)?);
        ratios.push(after.0 / before.0);
        sizes = Some(((before.1, before.2), (after.1, after.2)));
    }
    ratios.sort_by(f64::total_cmp);
    let ((pipelines, bytes), (pipelines_with, bytes_with)) = sizes.ok_or("no rounds")?;
    println!(
        "\nScene '{}' with a material that no node has, whose response is an expression: {pipelines} ranges before and \
         {pipelines_with} after, {bytes} and {bytes_with} bytes on the device, thermal pass {:.2} times as long (least {:.2}, \
         most {:.2})\n",
        scene.name,
        ratios[ROUNDS / 2],
        ratios[0],
        ratios[ROUNDS - 1]
    );
    Ok(())
}

/// Times of the variants that ran, and bytes a node.
fn time_pass(
    context: &Arc<Context>,
    variant: ThermalVariant,
    shapes: &Shapes,
    nodes: usize,
    steps: &[StepLoad],
) -> Result<(Vec<PassTime>, f64), AnyError> {
    // Pieces of the one function begin at 0.
    let power = if shapes.values.is_empty() { 2.0 } else { 0.0 };
    let pass = internals::time_pass(context, variant, power, shapes, nodes, steps, false)?;
    Ok((pass.times, pass.bytes_a_node))
}

/// Time of a whole step with its image in host memory [ms], without files.
fn whole_ticks(arguments: &Arguments, context: &Arc<Context>, scene: &Scene) -> Result<(), AnyError> {
    println!(
        "Whole step of scene '{}' (step, image, images and temperatures on the host), milliseconds: median\n",
        scene.name
    );
    println!(
        "| longest edge [m] | nodes | triangles | bytes a node | start-up [s] | image | thermal | cull | radiance | copies | step | images a second |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for &edge in &arguments.edges {
        for [width, height] in [[640, 512], [1024, 1024]] {
            let mut scene = scene.clone();
            scene.density.model.max = Some(edge);
            if let Some(camera) = &mut scene.camera {
                let scale = f64::from(width) / f64::from(camera.width);
                camera.lens.focal = camera.lens.focal.map(|focal| focal * scale);
                (camera.width, camera.height) = (width, height);
                camera.lens.centre = [f64::from(width) / 2.0, f64::from(height) / 2.0];
            }
            println!("{}", measure_steps(arguments.steps, context, scene, edge)?);
        }
    }
    Ok(())
}

fn measure_steps(steps: u32, context: &Arc<Context>, scene: Scene, edge: f64) -> Result<String, AnyError> {
    let began = Instant::now();
    let prepared = Prepared::from_scene(scene, &mut |_| {})?;
    let camera = prepared.scene.require_camera()?.clone();
    let mut engine = DeviceEngine::new(context, &prepared, Some(&camera))?;
    let step = prepared.scene.time.step;
    engine.settle(&prepared.loads.step_load(0.0, step), 0.0)?;
    let start_up = began.elapsed().as_secs_f64();

    let mut whole = Vec::new();
    // The first steps compile the passes.
    for number in 0..steps + 3 {
        let began = Instant::now();
        let (from, to) = (f64::from(number) * step, f64::from(number + 1) * step);
        let load = prepared.loads.step_load(from, to);
        let pose = camera_from_body(&camera, &prepared.loads.sky_model().sky(to));
        let joints = prepared.loads.joints_at(to).1;
        let order = Order { pose: Some(pose), joints: &joints, temperatures: true, ..Order::default() };
        engine.submit(Some(EngineStep { load: &load, steps: 1.0, start: from, length: step }), order)?;
        engine.deliver()?;
        if number >= 3 {
            whole.push(began.elapsed().as_secs_f64() * 1e3);
        }
    }
    let median = |samples: &[f64]| PassTime::from_samples("", samples).map_or(f64::NAN, |time| time.median_ms);
    let times = engine.pass_times().ok_or("no pass times")?;
    let sum = |prefix: &str| -> f64 {
        let of_kind = times.iter().filter(|(name, _)| name.starts_with(prefix));
        of_kind.map(|(_, samples)| median(samples) * samples.len() as f64).sum::<f64>() / f64::from(steps + 3)
    };
    let device_data = DeviceData::new(&prepared);
    let plan = device_data.scene_data(&prepared, Some(&camera)).plan();
    let bytes: u64 = plan.iter().filter(|planned| planned.resource.grows_with_nodes()).map(|p| p.bytes).sum();
    let whole_step = median(&whole);
    Ok(format!(
        "| {edge} | {} | {} | {:.1} | {start_up:.2} | {} x {} | {:.2} | {:.1} | {:.1} | {:.1} | {whole_step:.1} | {:.1} |",
        prepared.nodes.count,
        prepared.triangles.len(),
        bytes as f64 / prepared.nodes.count as f64,
        camera.width,
        camera.height,
        sum("thermal_step"),
        sum("cull"),
        sum("radiance"),
        sum("read"),
        1e3 / whole_step,
    ))
}
