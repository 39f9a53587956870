//! Measures what radiation between surfaces adds to a step of a scene, pass by pass, over the loads and the network of the same steps without it.

use std::collections::BTreeMap;
use std::sync::Arc;

use isotherm::exchange::step::Settings;
use isotherm::gpu::context::Context;
use isotherm::gpu::samples::Samples;
use isotherm::scene::Scene;
use isotherm::simulation::device_engine::DeviceEngine;
use isotherm::simulation::engine::{Engine, Order, Step};
use isotherm::simulation::prepare::Prepared;

use super::AnyError;
use super::one_pass::least;

/// Passes that belong to shadows and to reading, which both runs have alike.
const OTHERS: [&str; 4] = ["solar_", "read ", "cull", "settle "];

/// Prints a row for each pass. The first `steps` steps of the scene are taken `rounds` times, with exchange and without in turns.
pub fn measure(
    context: &Arc<Context>,
    scene: Scene,
    patch_edge: Option<f64>,
    steps: u32,
    rounds: u32,
) -> Result<(), AnyError> {
    let settings = scene.exchange.unwrap_or_default();
    let settings = Settings { patch_edge: patch_edge.or(settings.patch_edge), ..settings };
    let with = |exchange| Prepared::from_scene(Scene { exchange, ..scene.clone() }, &mut |_| {});
    let runs = [with(Some(settings))?, with(None)?];
    let mut engines = Vec::new();
    for prepared in &runs {
        engines.push(DeviceEngine::new(context, prepared, None)?);
    }
    eprintln!("prepared");
    let length = scene.time.step;
    for _ in 0..rounds {
        for (engine, prepared) in engines.iter_mut().zip(&runs) {
            engine.settle(&prepared.loads.step_load(0.0, length), 0.0)?;
        }
        for number in 0..steps {
            let start = f64::from(number) * length;
            for (engine, prepared) in engines.iter_mut().zip(&runs) {
                let load = prepared.loads.step_load(start, start + length);
                engine.submit(Some(Step { load: &load, steps: 1.0, start, length }), Order::default())?;
                engine.deliver()?;
            }
        }
    }
    let count = f64::from(steps * rounds);
    // For each pass the time that nine tenths of the samples exceed, times the number of such passes in a step [ms].
    let of = |engine: &DeviceEngine| -> BTreeMap<String, [f64; 3]> {
        let passes = engine.pass_times().into_iter().flatten();
        let passes =
            passes.filter(|(name, _)| !name.contains(".trial") && OTHERS.iter().all(|other| !name.starts_with(other)));
        let row = |(name, samples): (&String, &Samples<f64>)| {
            let (time, often): (f64, f64) = (least(samples, 10), samples.len() as f64 / count);
            (name.clone(), [time, often, time * often])
        };
        passes.map(row).collect()
    };
    let [own, bare] = [of(&engines[0]), of(&engines[1])];
    let whole = |rows: &BTreeMap<String, [f64; 3]>| rows.values().map(|row| row[2]).sum::<f64>();
    let bare_ms = whole(&bare);
    for (name, value) in engines[0].exchange_description() {
        println!("{name}: {value}");
    }
    println!(
        "\n{} nodes, {} steps of {length} s, {rounds} times; the least tenth of each pass; loads and network without exchange take \
         {bare_ms:.3} ms a step, {:.1} ns a node\n",
        runs[0].nodes.count,
        steps,
        1e6 * bare_ms / runs[0].nodes.count as f64
    );
    println!("| pass | ms | in a step | ms a step | over loads and network |");
    println!("|---|---|---|---|---|");
    for (name, [time, often, sum]) in &own {
        println!("| {name} | {time:.3} | {often:.2} | {sum:.3} | {:.3} |", sum / bare_ms);
    }
    for (name, [time, often, sum]) in bare.iter().filter(|(name, _)| name.starts_with("thermal_step")) {
        println!("| {name}, without exchange | {time:.3} | {often:.2} | {sum:.3} | {:.3} |", sum / bare_ms);
    }
    let passes: f64 = own.iter().filter(|(name, _)| name.starts_with("exchange_")).map(|(_, row)| row[2]).sum();
    println!(
        "\nPasses of exchange: {:.3} of loads and network. With what it adds to the loads: {:.3}.\n",
        passes / bare_ms,
        (whole(&own) - bare_ms) / bare_ms
    );
    Ok(())
}
