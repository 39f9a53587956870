//! Measures a scene's network in one pass: its cost beside that of a quadratic transition, and its error against the present stepper on all nodes.

use std::sync::Arc;
use std::time::Instant;

use isotherm::Scene;
use isotherm::internals::{
    Context, Density, DeviceData, DeviceEngine, Domain, Edges, Engine, EngineOrder as Order, EngineStep, Function,
    Integrator, Material, Prepared, Profile, Response, Retarget, Transition,
};

use super::AnyError;

/// Bins of the errors: from 1e-7 K, a hundred in a decade.
const BINS: usize = 1000;

/// Absolute errors of all nodes and steps.
struct Errors {
    bins: Vec<u64>,
    squares: f64,
    count: u64,
    most: (f64, usize, u32),
}

impl Errors {
    fn take(&mut self, found: &[f64], truth: &[f64], step: u32) {
        for (node, (found, truth)) in found.iter().zip(truth).enumerate() {
            let error = (found - truth).abs();
            self.bins[(100.0 * (error.max(1e-7) * 1e7).log10()).min(BINS as f64 - 1.0) as usize] += 1;
            self.squares += error * error;
            self.count += 1;
            // A NaN counts as the largest.
            if error > self.most.0 || error.is_nan() {
                self.most = (error, node, step);
            }
        }
    }

    /// Error that 99 % do not exceed [K].
    fn p99(&self) -> f64 {
        let mut left = self.count - self.count / 100;
        let bin = self.bins.iter().position(|bin| {
            left = left.saturating_sub(*bin);
            left == 0
        });
        1e-7 * 10f64.powf(0.01 * (bin.unwrap_or(BINS) + 1) as f64)
    }
}

/// Prints a row for each longest edge [m] and length of step [s]. A run lasts an orbit, but at most `steps` steps.
pub fn measure(
    context: &Arc<Context>,
    scene: &Scene,
    edges: &[f64],
    lengths: &[f64],
    steps: u32,
    tolerance: f64,
) -> Result<(), AnyError> {
    println!(
        "Network in one pass, device time [ns a drawn node and step], the least tenth of the steps; errors of all nodes and steps \
         against sub-steps at a tolerance of {tolerance} K, both from the steady state at time 0. Whole steps are those by the host's clock without shadows and exchange, the least quarter, mostly without timestamps\n"
    );
    println!(
        "| edge [m] | drawn nodes | network nodes | step [s] | steps | one pass: loads | local step and weak conduction | conduction inside blocks | in all | \
         over the transition | transition | error rms [K] | p99 | max | its node | estimate rms [K] | max | passes a step | bytes a node | sub-steps [ns] | whole step [ms] | with the transition [ms] |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for edge in edges {
        for length in lengths {
            let mut scene = scene.clone();
            scene.density =
                Density { model: Edges { max: Some(*edge), min: scene.density.model.min }, ..Density::default() };
            scene.time.step = *length;
            let steps = ((scene.orbit.period() / length).round() as u32).min(steps);
            row(context, &scene, *edge, steps, tolerance)?;
        }
    }
    println!();
    Ok(())
}

fn row(context: &Arc<Context>, scene: &Scene, edge: f64, steps: u32, tolerance: f64) -> Result<(), AnyError> {
    let began = Instant::now();
    // The figures are those of the step that the row states, so it is never halved.
    let one_pass = with(scene, Integrator::OnePass, f64::INFINITY)?;
    let network = one_pass.network.as_ref().ok_or("the scene has no network")?;
    eprintln!("prepared in {:.1} s", began.elapsed().as_secs_f64());
    for (name, value) in network.description() {
        eprintln!("{name}: {value}");
    }
    if network.plan().is_none() {
        println!(
            "| {edge} | {} | {} | {} | the network does not fit |",
            one_pass.nodes.count,
            network.network().len(),
            scene.time.step
        );
        return Ok(());
    }
    let accurate = with(scene, Integrator::Cheap, tolerance)?;
    let transition = with_transitions(scene)?;
    let mut engines = Vec::new();
    for prepared in [&one_pass, &accurate, &transition] {
        let mut engine = DeviceEngine::new(context, prepared, None)?;
        engine.settle(&prepared.loads.step_load(0.0, scene.time.step), 0.0)?;
        // Most frames go without timestamps, as in a run.
        engine.keep_few_times(usize::MAX);
        engines.push(engine);
    }
    let mut errors = Errors { bins: vec![0; BINS], squares: 0.0, count: 0, most: (0.0, 0, 0) };
    let step = scene.time.step;
    for number in 0..steps {
        let (from, to) = (f64::from(number) * step, f64::from(number + 1) * step);
        let mut found = Vec::new();
        for (engine, prepared) in engines.iter_mut().zip([&one_pass, &accurate, &transition]) {
            let load = prepared.loads.step_load(from, to);
            engine.submit(Some(EngineStep { load: &load, steps: 1.0, start: from, length: step }), Order::default())?;
            engine.deliver()?;
            found.push(engine.network_temperatures()?.unwrap_or_default());
        }
        errors.take(&found[0], &found[1], number);
    }
    let [whole, of_transition] = by_the_clock(context, scene, steps)?;
    let count = one_pass.nodes.count as f64;
    let told = engines[0].renderer.network_estimate()?.map(|(told, _)| told).unwrap_or_default();
    let passes_a_step = engines[0].pass_times().into_iter().flatten();
    let passes_a_step =
        passes_a_step.filter(|(name, samples)| name.starts_with("one_pass") && 2 * samples.count() >= u64::from(steps));
    let passes_a_step = passes_a_step.count();
    let device = DeviceData::new(&one_pass);
    let plan = device.scene_data(&one_pass, None).plan();
    let bytes = plan.iter().filter(|planned| format!("{:?}", planned.resource).starts_with("OnePass"));
    let bytes = bytes.map(|planned| planned.bytes).sum::<u64>() as f64 / network.network().len() as f64;
    let loads = ns(&engines[0], "thermal_step.", steps) / count;
    let inside = ["one_pass.conduct", "one_pass_stage"].map(|start| ns(&engines[0], start, steps) / count);
    let inside: f64 = inside.into_iter().sum();
    let local = ns(&engines[0], "one_pass", steps) / count - inside;
    let other = ns(&engines[2], "thermal_step.", steps) / count;
    let mut costs: Vec<f64> = engines[1].network_costs().iter().map(|cost| 1e6 * cost.wall_ms / count).collect();
    costs.sort_by(f64::total_cmp);
    println!(
        "| {edge} | {count} | {} | {step} | {steps} | {loads:.1} | {local:.1} | {inside:.1} | {:.1} | {:.2} | {other:.1} | {:.5} | {:.4} | {:.3} | {} at step {} | {:.5} | {:.3} | {passes_a_step} | {bytes:.0} | {:.0} | {:.2} | {:.2} |",
        network.network().len(),
        loads + local + inside,
        (loads + local + inside) / other,
        (errors.squares / errors.count as f64).sqrt(),
        errors.p99(),
        errors.most.0,
        errors.most.1,
        errors.most.2,
        told.rms,
        told.most,
        costs.get(costs.len() / 2).copied().unwrap_or(f64::NAN),
        whole,
        of_transition
    );
    for (name, samples) in engines[0].pass_times().into_iter().flatten() {
        eprintln!(
            "{name}: {} times, least tenth {:.4} ms, median {:.4} ms",
            samples.len(),
            least(samples, 10),
            least(samples, 2)
        );
    }
    Ok(())
}

/// The scene with its network under an integrator.
fn with(scene: &Scene, integrator: Integrator, tolerance: f64) -> Result<Prepared, AnyError> {
    let mut scene = scene.clone();
    (scene.network.integrator, scene.network.tolerance) = (integrator, Some(tolerance));
    Ok(Prepared::from_scene(scene, &mut |_| {})?)
}

/// The scene with a transition in place of its network. Heaters and contacts are those of networks.
fn with_transitions(scene: &Scene) -> Result<Prepared, AnyError> {
    let mut bare = scene.clone();
    (bare.heaters, bare.contacts) = (Vec::new(), Vec::new());
    Ok(Prepared::with_materials(bare, |materials| materials.iter_mut().for_each(moved), &mut |_| {})?)
}

/// Time of a whole step of the network and of the transition by the host's clock [ms], the least quarter. Shadows and exchange are left out: some steps
/// find them anew and others do not, and the network and the transition share them.
fn by_the_clock(context: &Arc<Context>, scene: &Scene, steps: u32) -> Result<[f64; 2], AnyError> {
    let mut bare = scene.clone();
    (bare.shadows, bare.exchange) = (None, None);
    let step = scene.time.step;
    let mut runs = Vec::new();
    for prepared in [with(&bare, Integrator::OnePass, f64::INFINITY)?, with_transitions(&bare)?] {
        let mut engine = DeviceEngine::new(context, &prepared, None)?;
        engine.settle(&prepared.loads.step_load(0.0, step), 0.0)?;
        engine.keep_few_times(usize::MAX);
        runs.push((engine, prepared, Vec::new()));
    }
    for number in 0..steps {
        let (from, to) = (f64::from(number) * step, f64::from(number + 1) * step);
        for (engine, prepared, walls) in &mut runs {
            let load = prepared.loads.step_load(from, to);
            let began = Instant::now();
            engine.submit(Some(EngineStep { load: &load, steps: 1.0, start: from, length: step }), Order::default())?;
            engine.deliver()?;
            walls.push(began.elapsed().as_secs_f64() * 1e3);
        }
    }
    Ok([least(&runs[0].2, 4), least(&runs[1].2, 4)])
}

/// A quadratic transition in place of a network.
fn moved(material: &mut Material) {
    let profile = |t_max_steps| Profile { function: Function::Quadratic, t_max_steps };
    let (heating, cooling) = (profile(100.0), profile(150.0));
    let domain = Domain::Temperature;
    material.response = Response::Transition(Transition { heating, cooling, retarget: Retarget::Merge, domain });
}

/// What a share of the samples does not exceed. Other programs lengthen short passes more than long ones, so a tenth tells more than a median.
pub(super) fn least(samples: &[f64], of: usize) -> f64 {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / of).copied().unwrap_or(f64::NAN)
}

/// Device time of a step in the passes with names that begin with `start` [ns]. For each pass it is the time that nine tenths of the samples exceed, times
/// the number of such passes in a step. The trial of a first step does not count.
fn ns(engine: &DeviceEngine, start: &str, steps: u32) -> f64 {
    let passes = engine.pass_times().into_iter().flatten();
    let passes = passes.filter(|(name, _)| name.starts_with(start) && !name.contains(".trial"));
    let passes = passes.filter(|(_, samples)| !samples.is_empty());
    passes.map(|(_, samples)| 1e6 * least(samples, 10) * samples.count() as f64 / f64::from(steps)).sum()
}
