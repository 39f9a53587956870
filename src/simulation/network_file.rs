//! The thermal network of a scene as a network file, with the heat of every step.

use std::sync::atomic::AtomicBool;

use super::engine::{Engine, EngineError};
use super::parts::Passing;
use super::prepare::Prepared;
use super::reference_engine::ReferenceEngine;
use super::start;
use crate::scene::network::NetworkFile;
use crate::thermal::network::schedule::HeatTable;

/// The network of a scene from time 0, as the f64 reference finds its start. `None` where no material has a network. Radiation between surfaces is not in it.
///
/// A node's label is its part and a number. The heat of a step, or of a part of one, is constant over it, as in a run.
///
/// # Errors
/// A start that is not found, or a stop.
pub fn network_file(
    prepared: &Prepared,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
) -> Result<Option<NetworkFile>, EngineError> {
    let Some(scene) = &prepared.network else { return Ok(None) };
    let mut engine = ReferenceEngine::new(prepared, None);
    start(prepared, &mut engine, None, stop, progress)?;
    let mut network = scene.network().clone();
    network.temperatures = engine.network_temperatures()?.unwrap_or_default();
    let on = engine.network().map(|network| network.on().to_vec()).unwrap_or_default();
    let (steps, step) = (prepared.scene.time.steps, prepared.scene.time.step);
    let time = |number: u32| f64::from(number) * step;
    let mut tables = vec![HeatTable { times: Vec::new(), powers: Vec::new() }; network.len()];
    for number in 0..steps {
        let whole = Passing { start: time(number), end: time(number + 1), steps: 1.0 };
        for Passing { start, end, .. } in whole.parts(&prepared.loads) {
            let heat = engine.network_heat(&prepared.loads.step_load(start, end));
            for (table, power) in tables.iter_mut().zip(heat) {
                // Of steps with the same heat the ends of the first and of the last are kept.
                if table.powers.last() == Some(&power) {
                    table.times.pop();
                    table.times.push(end);
                } else {
                    table.times.extend([start, end]);
                    table.powers.extend([power, power]);
                }
            }
        }
        progress();
    }
    let mut schedule = scene.schedule(vec![0.0; network.len()], &on, 0.0, 0.0);
    schedule.constant = Vec::new();
    let heated = (0..).zip(tables).filter(|(_, table)| table.powers.iter().any(|power| *power != 0.0));
    schedule.heat.extend(heated);
    schedule.times = (0..=steps).map(time).collect();
    let mut counts = vec![0; prepared.parts.len()];
    let label = |part: u32| {
        let count = &mut counts[part as usize];
        *count += 1;
        format!("{}:{count}", prepared.parts[part as usize])
    };
    let labels = scene.parts(&prepared.nodes).into_iter().map(label).collect();
    let times = schedule.times.clone();
    Ok(Some(NetworkFile { labels, network, schedule, times, assumptions: Vec::new() }))
}
