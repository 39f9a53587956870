//! Integrates a network on a target, on each path that a device has.

use super::case::worst_of;
use crate::gpu::error::GpuError;
use crate::simulation::stepper::AnyStepper;
use crate::simulation::target::Target;
use crate::thermal::network::Network;
use crate::thermal::network::control::{ControlError, Integrator, Series, Settings, integrate};
use crate::thermal::network::schedule::Schedule;
use crate::thermal::network::stepper::{Method, Stepper};

/// A target and, on a device, its integration path.
#[derive(Clone, Copy)]
pub struct Way<'a> {
    target: &'a Target,
    wide: bool,
}

impl<'a> Way<'a> {
    /// The default path of a target.
    pub fn own(target: &'a Target) -> Self {
        Self { target, wide: false }
    }

    /// Whether each stage is a dispatch of its own.
    pub fn is_wide(self) -> bool {
        self.wide
    }

    /// The largest error of all paths. A device has two: one workgroup does all stages of a dispatch, or each stage is
    /// a dispatch.
    ///
    /// # Errors
    /// The name and the error of the first path that fails.
    pub fn worst(target: &Target, error: impl Fn(Way<'_>) -> Result<f64, String>) -> Result<f64, String> {
        let own = error(Way::own(target))?;
        if target.device().is_none() {
            return Ok(worst_of(0.0, own));
        }
        let wide = error(Way { target, wide: true });
        Ok(worst_of(own, wide.map_err(|reason| format!("with a dispatch a stage: {reason}"))?))
    }

    fn stepper(self, network: &Network, sensors: &[u32]) -> Result<AnyStepper, GpuError> {
        match self.target {
            Target::Device(context) if self.wide => AnyStepper::wide(context, network, sensors),
            target => target.stepper(network, sensors),
        }
    }
}

/// Integrates a network through its schedule.
pub fn integrated(
    way: Way<'_>,
    network: &Network,
    schedule: &Schedule,
    integrator: Integrator,
) -> Result<Series, ControlError<GpuError>> {
    let mut stepper = way.stepper(network, &schedule.sensors()).map_err(ControlError::Stepper)?;
    let floor = stepper.floor();
    integrate(&mut stepper, network, schedule, &Settings { floor, ..Settings::of(integrator) }, |_| true)
}

/// Equal steps of forward Euler with a carried residual, under heat that is constant over each `frame` [s]. Returns the
/// temperatures [K] after every frame.
///
/// # Errors
/// A device error, or a temperature out of range.
pub fn fixed_euler(
    way: Way<'_>,
    network: &Network,
    frames: &mut dyn Iterator<Item = Vec<f64>>,
    frame: f64,
    steps: u32,
) -> Result<Vec<Vec<f64>>, String> {
    let failed = |error: GpuError| error.to_string();
    let mut stepper = way.stepper(network, &[]).map_err(failed)?;
    let still = vec![0.0; network.len()];
    let mut rows = Vec::new();
    for heat in frames {
        stepper.set_heat(&heat, &still).map_err(failed)?;
        let attempt = stepper.attempt(Method::Euler, 0.0, frame / f64::from(steps), steps).map_err(failed)?;
        if attempt.error.is_infinite() {
            return Err(format!("a temperature left its range in frame {}", rows.len()));
        }
        stepper.keep().map_err(failed)?;
        rows.push(stepper.temperatures().map_err(failed)?);
    }
    Ok(rows)
}
