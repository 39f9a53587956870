//! Solves the cubes of the paper's figures 2 to 4 in f64 on the processor.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use super::error::CliError;
use super::progress::{progress_bar, stop_flag};
use crate::paper::cube::{Cube, CubeProblem, PERIOD, STEP, STEPS};
use crate::paper::orbits::{CASES, Orbits};
use crate::thermal::network::control::{ControlError, IntegrationSettings, Integrator, integrate};
use crate::thermal::network::periodic::{self, PeriodicState};
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::schedule::{HeatTable, Schedule};
use crate::thermal::network::stepper::WorkCounts;

/// Target error of an orbit [K]. Figure 2 shows a signal of 1 K.
const TOLERANCE: f64 = 5e-4;
/// Tolerance of a periodic state [K].
const PERIODIC_TOLERANCE: f64 = 1e-3;

/// The periodic states of all cubes, and their work. After Ctrl-C the error names `output`.
pub(super) fn compute(output: &Path) -> Result<(Orbits, String), CliError> {
    let stop = stop_flag();
    let bar = progress_bar(CASES, "figures 2-4");
    let (mut orbits, mut total) = (0, WorkCounts::default());
    let solved = Orbits::compute(|case: &Cube, problem: &CubeProblem| {
        let mut stepper = ReferenceStepper::new(problem.network.clone(), &[]);
        let settled = settle(&mut stepper, case, problem, &stop, output)?;
        let counts = stepper.counts();
        orbits += settled.orbits;
        total.stages += counts.stages;
        total.sub_steps += counts.sub_steps;
        bar.inc(1);
        let faces = |row: Vec<f64>| std::array::from_fn(|face| row.get(face).copied().unwrap_or(f64::NAN));
        Ok::<_, CliError>(settled.orbit.into_iter().map(faces).collect())
    });
    bar.finish_and_clear();
    let WorkCounts { stages, sub_steps, .. } = total;
    let work = format!(
        "figures 2 to 4, in f64 on the processor: {CASES} periodic states to {PERIODIC_TOLERANCE} K in {orbits} orbits, tolerance {TOLERANCE} K: \
         {sub_steps} sub-steps, {stages} stages"
    );
    Ok((solved?, work))
}

/// The error of a failed integration.
fn told(error: ControlError, case: &Cube, output: &Path) -> CliError {
    match error {
        ControlError::Stopped => CliError::Stopped(output.to_path_buf()),
        ControlError::Unbalanced { time, .. } => {
            CliError::Solver(format!("{case}: the faces have no balance at {time} s"))
        }
        ControlError::NoStep { time, .. }
        | ControlError::Stiff { time, .. }
        | ControlError::TooLong { time, .. }
        | ControlError::Chatter { time, .. } => {
            CliError::Solver(format!("{case}: no sub-step is short enough at {time} s"))
        }
    }
}

/// One cube's periodic state.
fn settle(
    stepper: &mut ReferenceStepper,
    case: &Cube,
    problem: &CubeProblem,
    stop: &AtomicBool,
    output: &Path,
) -> Result<PeriodicState, CliError> {
    let table = |face: usize| {
        let (times, powers) = problem.table(face).into_iter().map(|[time, power]| (time, power)).unzip();
        (face as u32, HeatTable { times, powers })
    };
    let schedule = Schedule {
        heat: (0..problem.network.len()).map(table).collect(),
        times: (0..=STEPS).map(|step| step as f64 * STEP).collect(),
        ..Schedule::default()
    };
    let settings = IntegrationSettings { tolerance: TOLERANCE, ..IntegrationSettings::of(Integrator::Default) };
    let mut balance = ReferenceStepper::new(problem.network.clone(), &[]);
    let orbit = |start: &[f64]| {
        stepper.set_temperatures(start);
        let series = integrate(stepper, &problem.network, &schedule, &settings, |_| !stop.load(Ordering::Relaxed));
        Ok::<_, CliError>(series.map_err(|error| told(error, case, output))?.rows)
    };
    let settled = periodic::settle(&problem.network, PERIOD, PERIODIC_TOLERANCE, &mut balance, orbit)?;
    settled.ok_or_else(|| CliError::Solver(format!("{case}: no periodic state was found")))
}
