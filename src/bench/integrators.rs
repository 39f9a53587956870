//! Integrates a case with one scheme, and measures work, time and error.

use std::time::Instant;

use serde::Serialize;

use super::cases::NetworkCase;
use super::schemes::{Fixed, Scheme};
use crate::gpu::error::GpuError;
use crate::output::statistics::Percentiles;
use crate::simulation::network::unfinished;
use crate::simulation::stepper::AnyStepper;
use crate::thermal::network::control::{ControlError, IntegrationSettings, Leg, integrate_leg};
use crate::thermal::network::rkl2::stages_for;
use crate::thermal::network::schedule::{HeatTable, Schedule};
use crate::thermal::network::stepper::{StepMethod, Stepper, WorkCounts};

/// Safety factor on the fastest rate, which changes within a frame. The controller uses the same.
const RATE_MARGIN: f64 = 1.1;

/// The difference of two series of temperatures, over all nodes and frames.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct FrameError {
    /// Root mean square [K].
    #[serde(rename = "rms_k")]
    pub rms: f64,
    /// Largest [K].
    #[serde(rename = "max_k")]
    pub max: f64,
}

impl FrameError {
    /// Compares rows of equal length.
    pub fn between(a: &[Vec<f64>], b: &[Vec<f64>]) -> Self {
        let differences = || a.iter().zip(b).flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs()));
        let count = differences().count().max(1) as f64;
        let squares: f64 = differences().map(|difference| difference * difference).sum();
        Self { rms: (squares / count).sqrt(), max: differences().fold(0.0, f64::max) }
    }
}

/// The runs of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Integrated {
    /// Short name of the case.
    pub case: String,
    /// One run for every scheme.
    pub runs: Vec<IntegratorRun>,
}

/// A scheme on a case.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct IntegratorRun {
    /// Method, with its sub-steps or tolerance.
    pub scheme: String,
    /// Method.
    pub family: String,
    /// `dispatches` on a device, where each stage is one, `f64` on the processor.
    pub path: String,
    /// Work of one run. A slow run has fewer frames than the case.
    pub work: Option<SchemeWork>,
    /// Device time of a frame [ms].
    pub device_ms: Option<Percentiles>,
    /// Host time of a frame [ms].
    pub wall_ms: Option<Percentiles>,
    /// Error at the ends of all frames.
    pub error: Option<FrameError>,
    /// The reason if there are no numbers.
    pub failed: Option<String>,
}

impl IntegratorRun {
    /// Time of a frame [ms], measured by the device if it has a clock.
    pub(crate) fn time(&self) -> Option<Percentiles> {
        self.device_ms.or(self.wall_ms)
    }
}

/// Counts of work, including rejected sub-steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct SchemeWork {
    /// Frames.
    pub frames: u64,
    /// Stages, each an evaluation of all exchanges.
    pub stages: u64,
    /// Sub-steps.
    pub sub_steps: u64,
    /// Dispatches.
    pub dispatches: u64,
    /// Iterations of Newton's method and of conjugate gradients.
    pub(crate) iterations: u64,
}

/// The path of a stepper: see [`IntegratorRun::path`].
fn path(stepper: &AnyStepper) -> &'static str {
    match stepper.device() {
        Some(_) => "dispatches",
        None => "f64",
    }
}

/// The reason why a run ended early.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Ended {
    /// The stepper does not support it.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Smaller sub-steps do not help.
    #[error("{0}")]
    Failed(String),
    /// The caller stopped it.
    #[error("it was stopped")]
    Stopped,
}

/// Integrates all frames. `done` gets the duration [ms] and the temperatures [K] of each frame, and decides whether to
/// continue.
pub(crate) fn in_frames(
    stepper: &mut AnyStepper,
    case: &NetworkCase,
    scheme: Scheme,
    mut done: impl FnMut([Option<f64>; 2], Vec<f64>) -> bool,
) -> Result<(), Ended> {
    let still = vec![0.0; case.network.len()];
    let mut step = f64::INFINITY;
    for (number, heat) in case.frames.iter().enumerate() {
        let (began, before) = (Instant::now(), stepper.device_ms());
        match scheme {
            Scheme::Fixed(method, count) => {
                stepper.set_heat(heat, &still)?;
                if !stepper.balance(0.0)? {
                    return Err(Ended::Failed(format!("the arithmetic nodes of frame {number} do not balance")));
                }
                fixed(stepper, case, method, count, number)?;
            }
            Scheme::Controlled(integrator, tolerance) => {
                let settings = IntegrationSettings { integrator, tolerance, floor: stepper.floor() };
                let heat = (0..).zip(heat).map(|(node, heat)| (node, HeatTable::constant(*heat))).collect();
                let schedule = Schedule { heat, times: vec![case.frame], ..Schedule::default() };
                let horizon = case.frame * case.frames.len() as f64;
                let leg = Leg { horizon, step, tight_switches: false };
                let ended = integrate_leg(stepper, &case.network, &schedule, &settings, leg, |_| true);
                let series = ended.map_err(|error| match error {
                    ControlError::Stepper(error) => Ended::Gpu(error),
                    other => Ended::Failed(format!("frame {number}: {}", unfinished(&other))),
                })?;
                step = series.step;
            }
        }
        let wall = began.elapsed().as_secs_f64() * 1e3;
        let device = stepper.device_ms().map(|now| now - before.unwrap_or(0.0));
        let times = [device, Some(wall)];
        if !done(times, stepper.temperatures()?) {
            return Err(Ended::Stopped);
        }
    }
    Ok(())
}

/// Integrates one frame in equal sub-steps.
fn fixed(stepper: &mut AnyStepper, case: &NetworkCase, method: Fixed, count: u32, number: usize) -> Result<(), Ended> {
    let step = case.frame / f64::from(count);
    let method = match method {
        Fixed::Euler => StepMethod::Euler,
        Fixed::TrBdf2 => StepMethod::TrBdf2,
        Fixed::Rkl2 => {
            let rate = case.network.fastest_rate(&stepper.temperatures()?);
            StepMethod::Rkl2 { stages: stages_for(RATE_MARGIN * rate * step) }
        }
    };
    let attempt = stepper.attempt(method, 0.0, step, count)?;
    if attempt.error.is_infinite() {
        return Err(Ended::Failed(format!("frame {number}: a temperature left its range, or a balance did not close")));
    }
    Ok(stepper.keep()?)
}

/// Limits on the runs of a scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntegratorEffort {
    /// Most runs of the whole case.
    pub runs: u32,
    /// Time [s] after which no further run begins.
    pub enough: f64,
    /// Time after which a run is cut off [s].
    pub most: f64,
}

/// Number of unmeasured frames that compile pipelines.
const WARM_UP: usize = 2;

/// Runs a scheme on a case after some unmeasured frames. `truth` has the reference temperatures at the ends of all
/// frames [K].
pub fn measure_integrator(
    stepper: &mut AnyStepper,
    case: &NetworkCase,
    truth: &[Vec<f64>],
    scheme: Scheme,
    effort: IntegratorEffort,
) -> IntegratorRun {
    let name = scheme.to_string();
    let mut run = IntegratorRun { scheme: name, family: scheme.family(), ..IntegratorRun::default() };
    if let Some(reason) = scheme.refusal(case) {
        run.failed = Some(reason);
        return run;
    }
    match runs(stepper, case, truth, scheme, effort) {
        Ok(measured) => run = IntegratorRun { scheme: run.scheme, family: run.family, ..measured },
        Err(error) => run.failed = Some(error.to_string()),
    }
    run.path = path(stepper).to_owned();
    run
}

fn runs(
    stepper: &mut AnyStepper,
    case: &NetworkCase,
    truth: &[Vec<f64>],
    scheme: Scheme,
    effort: IntegratorEffort,
) -> Result<IntegratorRun, Ended> {
    let restart = |stepper: &mut AnyStepper| stepper.set_temperatures(&case.network.temperatures);
    let began = Instant::now();
    restart(stepper)?;
    let mut frames = 0;
    let warm = in_frames(stepper, case, scheme, |_, _| {
        frames += 1;
        frames < WARM_UP
    });
    match warm {
        Ok(()) | Err(Ended::Stopped) => {}
        Err(error) => return Err(error),
    }
    let (mut device, mut wall) = (Vec::new(), Vec::new());
    let (mut work, mut error) = (None, FrameError::default());
    for _ in 0..effort.runs {
        restart(stepper)?;
        let before = stepper.counts();
        let mut rows = Vec::new();
        let ended = in_frames(stepper, case, scheme, |[on_device, by_wall], temperatures| {
            rows.push(temperatures);
            device.extend(on_device);
            wall.extend(by_wall);
            began.elapsed().as_secs_f64() < effort.most
        });
        if !matches!(ended, Ok(()) | Err(Ended::Stopped)) {
            ended?;
        }
        // A later run that was cut off has less work than the first.
        if work.is_none() {
            work = Some(work_of(before, stepper.counts(), rows.len()));
            error = FrameError::between(&rows, truth);
        }
        if began.elapsed().as_secs_f64() > effort.enough {
            break;
        }
    }
    Ok(IntegratorRun {
        work,
        device_ms: Percentiles::of(&device),
        wall_ms: Percentiles::of(&wall),
        error: Some(error),
        ..IntegratorRun::default()
    })
}

fn work_of(before: WorkCounts, after: WorkCounts, frames: usize) -> SchemeWork {
    SchemeWork {
        frames: frames as u64,
        stages: after.stages - before.stages,
        sub_steps: after.sub_steps - before.sub_steps,
        dispatches: after.dispatches - before.dispatches,
        iterations: after.iterations - before.iterations,
    }
}
