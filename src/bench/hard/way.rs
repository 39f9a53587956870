//! Integrates a network on a target.

use crate::gpu::error::GpuError;
use crate::simulation::target::Target;
use crate::thermal::network::Network;
use crate::thermal::network::control::{ControlError, IntegrationSettings, Integrator, Series, integrate};
use crate::thermal::network::schedule::Schedule;
use crate::thermal::network::stepper::{StepMethod, Stepper};

/// Integrates a network through its schedule.
pub(crate) fn integrated(
    target: &Target,
    network: &Network,
    schedule: &Schedule,
    integrator: Integrator,
) -> Result<Series, ControlError<GpuError>> {
    let mut stepper = target.stepper(network, &schedule.sensors()).map_err(ControlError::Stepper)?;
    let floor = stepper.floor();
    integrate(
        &mut stepper,
        network,
        schedule,
        &IntegrationSettings { floor, ..IntegrationSettings::of(integrator) },
        |_| true,
    )
}

/// Equal steps of forward Euler with a carried residual, under heat that is constant over each `frame` [s]. Returns the
/// temperatures [K] after every frame.
///
/// # Errors
/// A device error, or a temperature out of range.
pub(crate) fn fixed_euler(
    target: &Target,
    network: &Network,
    frames: &mut dyn Iterator<Item = Vec<f64>>,
    frame: f64,
    steps: u32,
) -> Result<Vec<Vec<f64>>, String> {
    let failed = |error: GpuError| error.to_string();
    let mut stepper = target.stepper(network, &[]).map_err(failed)?;
    let still = vec![0.0; network.len()];
    let mut rows = Vec::new();
    for heat in frames {
        stepper.set_heat(&heat, &still).map_err(failed)?;
        let attempt = stepper.attempt(StepMethod::Euler, 0.0, frame / f64::from(steps), steps).map_err(failed)?;
        if attempt.error.is_infinite() {
            return Err(format!("a temperature left its range in frame {}", rows.len()));
        }
        stepper.keep().map_err(failed)?;
        rows.push(stepper.temperatures().map_err(failed)?);
    }
    Ok(rows)
}
