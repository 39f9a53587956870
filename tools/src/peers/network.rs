//! Solves a network file on the device as `isotherm network --device NAME` does, and times the solution alone.

use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};

use isotherm::internals::{
    Context, ESTIMATE_FLOOR, IntegrationSettings, Integrator, NetworkFile, NetworkStepper, Stepper, integrate,
};

use super::AnyError;
use super::clock::Clock;

/// Solves it `runs` times after an untimed first time that compiles the kernels. Reading and uploading are not timed.
pub fn measure(
    context: &Arc<Context>,
    file: &Path,
    output: &Path,
    tolerance: f64,
    runs: usize,
) -> Result<Value, AnyError> {
    let file = NetworkFile::load(file)?;
    let mut stepper = NetworkStepper::new(context, &file.network, &file.schedule.sensors())?;
    let settings = IntegrationSettings { integrator: Integrator::Default, tolerance, floor: ESTIMATE_FLOOR };
    let (mut clocks, mut device) = (Vec::new(), Vec::new());
    let (mut rows, mut counts) = (Vec::new(), None);
    for run in 0..=runs {
        stepper.set_temperatures(&file.network.temperatures)?;
        let (before, before_ms) = (stepper.counts(), stepper.device_ms().unwrap_or(f64::NAN));
        let clock = Clock::start();
        let series = integrate(&mut stepper, &file.network, &file.schedule, &settings, |_| true);
        let time = clock.stop();
        rows = series.map_err(|error| format!("{error:?}"))?.rows;
        if run > 0 {
            clocks.push(time);
            device.push(stepper.device_ms().unwrap_or(f64::NAN) - before_ms);
        }
        let after = stepper.counts();
        counts = Some([after.stages - before.stages, after.sub_steps - before.sub_steps]);
    }
    std::fs::write(output, rows.iter().flatten().flat_map(|kelvin| kelvin.to_le_bytes()).collect::<Vec<u8>>())?;
    let [stages, sub_steps] = counts.unwrap_or_default();
    Ok(json!({
        "nodes": file.network.len(), "rows": rows.len(), "stages": stages, "sub_steps": sub_steps,
        "clock_ms": clocks, "device_ms": device,
    }))
}
