//! A network and a transition on whichever target.

use super::worst_of;
use crate::bench::run::Target;
use crate::gpu::network::{ESTIMATE_FLOOR, NetworkStepper};
use crate::gpu::response::{Run, respond};
use crate::thermal::material::Transition;
use crate::thermal::network::Network;
use crate::thermal::network::control::{ControlError, FLOOR, Integrator, Series, Settings, integrate};
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::schedule::Schedule;
use crate::thermal::network::stepper::{Attempt, Method, Stepper, WorkCounts};
use crate::thermal::transition::{TransitionState, transition_step};

/// Temperatures [K] after every step of a node that starts at rest and is commanded one target a step.
///
/// # Errors
/// What the device says.
pub fn response(target: &Target, transition: &Transition, initial: f32, targets: &[f32]) -> Result<Vec<f64>, String> {
    match target {
        Target::Device(context) => {
            let run = Run { initial, targets: targets.to_vec() };
            let found = respond(context, transition, std::slice::from_ref(&run)).map_err(|error| error.to_string())?;
            Ok(found.into_iter().flatten().map(f64::from).collect())
        }
        Target::Reference => Ok(response_f64(transition, initial, targets)),
    }
}

/// The same in f64.
pub fn response_f64(transition: &Transition, initial: f32, targets: &[f32]) -> Vec<f64> {
    let mut state = TransitionState::settled(f64::from(initial), transition);
    let step = |target: &f32| {
        let (next, temperature) = transition_step(state, f64::from(*target), 1.0, transition);
        state = next;
        temperature
    };
    targets.iter().map(step).collect()
}

/// A way to integrate networks: a target and, on a device, its path.
#[derive(Clone, Copy)]
pub struct Place<'a> {
    target: &'a Target,
    wide: bool,
}

impl<'a> Place<'a> {
    /// The path that a target takes by itself.
    pub fn own(target: &'a Target) -> Self {
        Self { target, wide: false }
    }

    /// Whether every stage is a dispatch.
    pub fn is_wide(self) -> bool {
        self.wide
    }

    /// All ways: of a device what one workgroup does in a dispatch, and a dispatch for every stage.
    pub fn all(target: &'a Target) -> Vec<Self> {
        match target {
            Target::Device(_) => vec![Self::own(target), Self { target, wide: true }],
            Target::Reference => vec![Self::own(target)],
        }
    }

    /// The largest error of all ways.
    ///
    /// # Errors
    /// Of the first way that fails, and which.
    pub fn worst(target: &Target, error: impl Fn(Place<'_>) -> Result<f64, String>) -> Result<f64, String> {
        Place::all(target).into_iter().try_fold(0.0, |worst, place| {
            let found = error(place);
            let named = |reason| if place.wide { format!("with a dispatch a stage: {reason}") } else { reason };
            Ok(worst_of(worst, found.map_err(named)?))
        })
    }
}

/// A stepper of either kind.
pub enum AnyStepper {
    /// On a device.
    Device(Box<NetworkStepper>),
    /// In f64.
    Reference(Box<ReferenceStepper>),
}

impl AnyStepper {
    /// The network at a place.
    ///
    /// # Errors
    /// What the device refuses.
    pub fn new(place: Place<'_>, network: &Network, sensors: &[u32]) -> Result<Self, String> {
        Ok(match place.target {
            Target::Device(context) => {
                let make = if place.wide { NetworkStepper::wide } else { NetworkStepper::new };
                Self::Device(Box::new(make(context, network, sensors).map_err(|error| error.to_string())?))
            }
            Target::Reference => Self::Reference(Box::new(ReferenceStepper::new(network.clone(), sensors))),
        })
    }

    /// Where its estimates of an error are rounding [K].
    pub fn floor(&self) -> f64 {
        match self {
            Self::Device(_) => ESTIMATE_FLOOR,
            Self::Reference(_) => FLOOR,
        }
    }

    fn each<T>(
        &mut self,
        device: impl FnOnce(&mut NetworkStepper) -> Result<T, crate::gpu::error::GpuError>,
        reference: impl FnOnce(&mut ReferenceStepper) -> Result<T, std::convert::Infallible>,
    ) -> Result<T, String> {
        match self {
            Self::Device(stepper) => device(stepper).map_err(|error| error.to_string()),
            Self::Reference(stepper) => reference(stepper).map_err(|never| match never {}),
        }
    }
}

impl Stepper for AnyStepper {
    type Error = String;

    fn set_heat(&mut self, power: &[f64], slope: &[f64]) -> Result<(), String> {
        self.each(|device| device.set_heat(power, slope), |reference| reference.set_heat(power, slope))
    }

    fn balance(&mut self, t: f64) -> Result<bool, String> {
        self.each(|device| device.balance(t), |reference| reference.balance(t))
    }

    fn attempt(&mut self, method: Method, t: f64, step: f64, count: u32) -> Result<Attempt, String> {
        self.each(
            |device| device.attempt(method, t, step, count),
            |reference| reference.attempt(method, t, step, count),
        )
    }

    fn keep(&mut self) -> Result<(), String> {
        self.each(Stepper::keep, Stepper::keep)
    }

    fn temperatures(&mut self) -> Result<Vec<f64>, String> {
        self.each(Stepper::temperatures, Stepper::temperatures)
    }

    fn set_temperatures(&mut self, temperatures: &[f64]) -> Result<(), String> {
        self.each(|device| device.set_temperatures(temperatures), |reference| reference.set_temperatures(temperatures))
    }

    fn steady(&mut self, t: f64) -> Result<bool, String> {
        self.each(|device| device.steady(t), |reference| reference.steady(t))
    }

    fn hottest(&self) -> f64 {
        match self {
            Self::Device(stepper) => stepper.hottest(),
            Self::Reference(stepper) => stepper.hottest(),
        }
    }

    fn counts(&self) -> WorkCounts {
        match self {
            Self::Device(stepper) => stepper.counts(),
            Self::Reference(stepper) => stepper.counts(),
        }
    }
}

/// Integrates a network through its schedule at a place.
///
/// # Errors
/// As of [`integrate`].
pub fn integrated(
    place: Place<'_>,
    network: &Network,
    schedule: &Schedule,
    integrator: Integrator,
) -> Result<Series, ControlError<String>> {
    let mut stepper = AnyStepper::new(place, network, &schedule.sensors())?;
    let floor = stepper.floor();
    integrate(&mut stepper, network, schedule, &Settings { floor, ..Settings::of(integrator) }, |_| true)
}

/// Equal steps of forward Euler with the residual carried, under heat that is constant over `frame` [s] each; the
/// temperatures [K] after every frame.
///
/// # Errors
/// What the device says, and a temperature that leaves its range.
pub fn fixed_euler(
    place: Place<'_>,
    network: &Network,
    frames: &mut dyn Iterator<Item = Vec<f64>>,
    frame: f64,
    steps: u32,
) -> Result<Vec<Vec<f64>>, String> {
    let mut stepper = AnyStepper::new(place, network, &[])?;
    let still = vec![0.0; network.len()];
    let mut rows = Vec::new();
    for heat in frames {
        stepper.set_heat(&heat, &still)?;
        let attempt = stepper.attempt(Method::Euler, 0.0, frame / f64::from(steps), steps)?;
        if attempt.error.is_infinite() {
            return Err(format!("a temperature left its range in frame {}", rows.len()));
        }
        stepper.keep()?;
        rows.push(stepper.temperatures()?);
    }
    Ok(rows)
}
