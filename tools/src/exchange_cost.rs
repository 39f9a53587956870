//! Measures what radiation between surfaces adds to a step of a scene, pass by pass, over the loads and the network of the same steps without it, and what holding changes.

use std::collections::BTreeMap;
use std::sync::Arc;

use isotherm::Scene;
use isotherm::internals::{
    Context, DeviceEngine, Engine, EngineOrder as Order, EngineStep, ExchangeSettings, Prepared, Samples,
};

use super::AnyError;
use super::one_pass::least;

/// Passes that belong to shadows and to reading, which both runs have alike.
const OTHERS: [&str; 4] = ["solar_", "read ", "cull", "settle "];

/// Prints a row for each pass. The first `steps` steps of the scene are taken `rounds` times, with exchange, without, and with all found in every step, in turns.
pub fn measure(
    context: &Arc<Context>,
    scene: Scene,
    patch_edge: Option<f64>,
    steps: u32,
    rounds: u32,
) -> Result<(), AnyError> {
    let settings = scene.exchange.unwrap_or_default();
    let settings = ExchangeSettings { patch_edge: patch_edge.or(settings.patch_edge), ..settings };
    let with = |exchange| {
        let mut scene = scene.clone();
        scene.exchange = exchange;
        Prepared::from_scene(scene, &mut |_| {})
    };
    let mut runs = [with(Some(settings))?, with(None)?, with(Some(ExchangeSettings { hold: Some(0.0), ..settings }))?];
    // The last run finds everything in every step.
    runs[2].exchange.iter_mut().for_each(|craft| Arc::make_mut(craft).light_angle = 0.0);
    let mut engines = Vec::new();
    for prepared in &runs {
        engines.push(DeviceEngine::new(context, prepared, None)?);
    }
    eprintln!("prepared");
    let length = scene.time.step;
    // Differences of all nodes between the first and the last run: sum of squares, number and largest [K].
    let (mut squares, mut compared, mut most) = (0.0, 0.0f64, 0.0f64);
    for _ in 0..rounds {
        for (engine, prepared) in engines.iter_mut().zip(&runs) {
            engine.settle(&prepared.loads.step_load(0.0, length), 0.0)?;
        }
        for number in 0..steps {
            let start = f64::from(number) * length;
            let mut found = Vec::new();
            for (engine, prepared) in engines.iter_mut().zip(&runs) {
                let load = prepared.loads.step_load(start, start + length);
                engine.submit(Some(EngineStep { load: &load, steps: 1.0, start, length }), Order::default())?;
                engine.deliver()?;
                found.push(engine.network_temperatures()?.unwrap_or_default());
            }
            // At first nodes are far from what exchange makes of them.
            for (held, anew) in found[0].iter().zip(&found[2]).filter(|_| number >= steps / 2) {
                squares += (held - anew).powi(2);
                compared += 1.0;
                most = most.max((held - anew).abs());
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
    let [own, bare, anew] = [0, 1, 2].map(|run| of(&engines[run]));
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
    let passes = |rows: &BTreeMap<String, [f64; 3]>| {
        let own = rows.iter().filter(|(name, _)| name.starts_with("exchange_") || name.ends_with(".exchange"));
        own.map(|(_, row)| row[2]).sum::<f64>()
    };
    let loads: f64 = bare.iter().filter(|(name, _)| name.starts_with("thermal_step")).map(|(_, row)| row[2]).sum();
    println!(
        "\nExchange, with what it adds to the loads: {:.3} of loads and network; {:.3} with all found in every step. Holding infrared for {} s and light for {:.1} deg changes nodes by {:.4} K \
         (rms), at most {most:.3} K, in the second half of the steps.\n",
        (passes(&own) - loads) / bare_ms,
        (passes(&anew) - loads) / bare_ms,
        runs[0].exchange.as_ref().and_then(|craft| craft.settings.hold).unwrap_or_default(),
        runs[0].exchange.as_ref().map_or(0.0, |craft| craft.light_angle.to_degrees()),
        (squares / compared.max(1.0)).sqrt()
    );
    Ok(())
}
