//! Integrates a case with one scheme, and measures work, time and error.

use std::time::Instant;

use serde::Serialize;

use super::cases::NetworkCase;
use super::schemes::{Fixed, Scheme};
use crate::output::statistics::Percentiles;
use crate::simulation::network::unfinished;
use crate::thermal::network::control::{IntegrationSettings, Leg, integrate_leg};
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::rkl2::stages_for;
use crate::thermal::network::schedule::{HeatTable, Schedule};
use crate::thermal::network::stepper::{StepMethod, WorkCounts};

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
    /// Work of one run. A slow run has fewer frames than the case.
    pub work: Option<SchemeWork>,
    /// Time of a frame [ms].
    pub wall_ms: Option<Percentiles>,
    /// Error at the ends of all frames.
    pub error: Option<FrameError>,
    /// The reason if there are no numbers.
    pub failed: Option<String>,
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
    /// Iterations of Newton's method and of conjugate gradients.
    pub(crate) iterations: u64,
}

/// The reason why a run ended early.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Ended {
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
    stepper: &mut ReferenceStepper,
    case: &NetworkCase,
    scheme: Scheme,
    mut done: impl FnMut(f64, Vec<f64>) -> bool,
) -> Result<(), Ended> {
    let still = vec![0.0; case.network.len()];
    let mut step = f64::INFINITY;
    for (number, heat) in case.frames.iter().enumerate() {
        let began = Instant::now();
        match scheme {
            Scheme::Fixed(method, count) => {
                stepper.set_heat(heat, &still);
                if !stepper.balance(0.0) {
                    return Err(Ended::Failed(format!("the arithmetic nodes of frame {number} do not balance")));
                }
                fixed(stepper, case, method, count, number)?;
            }
            Scheme::Controlled(integrator, tolerance) => {
                let settings = IntegrationSettings { integrator, tolerance };
                let heat = (0..).zip(heat).map(|(node, heat)| (node, HeatTable::constant(*heat))).collect();
                let schedule = Schedule { heat, times: vec![case.frame], ..Schedule::default() };
                let horizon = case.frame * case.frames.len() as f64;
                let leg = Leg { horizon, step, tight_switches: false };
                let (series, ended) = integrate_leg(stepper, &case.network, &schedule, &settings, leg, |_| true);
                ended.map_err(|error| Ended::Failed(format!("frame {number}: {}", unfinished(&error))))?;
                step = series.step;
            }
        }
        if !done(began.elapsed().as_secs_f64() * 1e3, stepper.temperatures()) {
            return Err(Ended::Stopped);
        }
    }
    Ok(())
}

/// Integrates one frame in equal sub-steps.
fn fixed(
    stepper: &mut ReferenceStepper,
    case: &NetworkCase,
    method: Fixed,
    count: u32,
    number: usize,
) -> Result<(), Ended> {
    let step = case.frame / f64::from(count);
    let method = match method {
        Fixed::Euler => StepMethod::Euler,
        Fixed::TrBdf2 => StepMethod::TrBdf2,
        Fixed::Rkl2 => {
            let rate = case.network.fastest_rate(&stepper.temperatures());
            StepMethod::Rkl2 { stages: stages_for(RATE_MARGIN * rate * step) }
        }
    };
    let attempt = stepper.attempt(method, 0.0, step, count);
    if attempt.error.is_infinite() {
        return Err(Ended::Failed(format!("frame {number}: a temperature left its range, or a balance did not close")));
    }
    stepper.keep();
    Ok(())
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

/// Number of unmeasured frames.
const WARM_UP: usize = 2;

/// Runs a scheme on a case after some unmeasured frames. `truth` has the reference temperatures at the ends of all
/// frames [K].
pub fn measure_integrator(
    stepper: &mut ReferenceStepper,
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
    run
}

fn runs(
    stepper: &mut ReferenceStepper,
    case: &NetworkCase,
    truth: &[Vec<f64>],
    scheme: Scheme,
    effort: IntegratorEffort,
) -> Result<IntegratorRun, Ended> {
    let restart = |stepper: &mut ReferenceStepper| stepper.set_temperatures(&case.network.temperatures);
    let began = Instant::now();
    restart(stepper);
    let mut frames = 0;
    let warm = in_frames(stepper, case, scheme, |_, _| {
        frames += 1;
        frames < WARM_UP
    });
    match warm {
        Ok(()) | Err(Ended::Stopped) => {}
        Err(error) => return Err(error),
    }
    let mut wall = Vec::new();
    let (mut work, mut error) = (None, FrameError::default());
    for _ in 0..effort.runs {
        restart(stepper);
        let before = stepper.counts();
        let mut rows = Vec::new();
        let ended = in_frames(stepper, case, scheme, |time, temperatures| {
            rows.push(temperatures);
            wall.push(time);
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
    Ok(IntegratorRun { work, wall_ms: Percentiles::of(&wall), error: Some(error), ..IntegratorRun::default() })
}

fn work_of(before: WorkCounts, after: WorkCounts, frames: usize) -> SchemeWork {
    SchemeWork {
        frames: frames as u64,
        stages: after.stages - before.stages,
        sub_steps: after.sub_steps - before.sub_steps,
        iterations: after.iterations - before.iterations,
    }
}
