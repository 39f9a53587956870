//! Solves a network file as `isotherm network` does, and times the solution alone.

use std::path::Path;

use serde_json::{Value, json};

use isotherm::scene::network::NetworkFile;
use isotherm::thermal::network::control::{Integrator, Settings, integrate};
use isotherm::thermal::network::reference::ReferenceStepper;

use super::AnyError;
use super::clock::Clock;

/// Solves it `runs` times after an untimed first time. Reading is not timed.
pub fn measure(file: &Path, output: &Path, tolerance: f64, runs: usize) -> Result<Value, AnyError> {
    let file = NetworkFile::load(file)?;
    let mut stepper = ReferenceStepper::new(file.network.clone(), &file.schedule.sensors());
    let settings = Settings { integrator: Integrator::Default, tolerance };
    let mut clocks = Vec::new();
    let (mut rows, mut counts) = (Vec::new(), None);
    for run in 0..=runs {
        stepper.set_temperatures(&file.network.temperatures);
        let before = stepper.counts();
        let clock = Clock::start();
        let series = integrate(&mut stepper, &file.network, &file.schedule, &settings, |_| true);
        let time = clock.stop();
        rows = series.map_err(|error| format!("{error:?}"))?.rows;
        if run > 0 {
            clocks.push(time);
        }
        let after = stepper.counts();
        counts = Some([after.stages - before.stages, after.sub_steps - before.sub_steps]);
    }
    std::fs::write(output, rows.iter().flatten().flat_map(|kelvin| kelvin.to_le_bytes()).collect::<Vec<u8>>())?;
    let [stages, sub_steps] = counts.unwrap_or_default();
    Ok(json!({
        "nodes": file.network.len(), "rows": rows.len(), "stages": stages, "sub_steps": sub_steps,
        "clock_ms": clocks,
    }))
}
