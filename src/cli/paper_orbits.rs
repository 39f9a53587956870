//! The cubes of the paper's figures 2 to 4, solved as thermal networks on the chosen device.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use super::{Chosen, CliError, progress_bar, stop_flag};
use crate::environment::sky::SkyError;
use crate::gpu::network::{ESTIMATE_FLOOR, NetworkStepper};
use crate::paper::cube::{Case, PERIOD, Problem, STEP, STEPS};
use crate::paper::orbits::{CASES, Orbits};
use crate::simulation::prepare_error::PrepareError;
use crate::thermal::network::control::{ControlError, Integrator, Settings, integrate};
use crate::thermal::network::periodic::{self, Settled};
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::schedule::{HeatTable, Schedule};
use crate::thermal::network::stepper::{Stepper, WorkCounts};

/// Error that an orbit is aimed at [K]: figure 2 shows a signal of 1 K.
const TOLERANCE: f64 = 5e-4;
/// Error at which a periodic state is found [K].
const PERIODIC_TOLERANCE: f64 = 1e-3;

impl From<SkyError> for CliError {
    fn from(source: SkyError) -> Self {
        PrepareError::Sky { path: PathBuf::from("the paper's scenario"), source }.into()
    }
}

/// The periodic states of all cubes, and what they took. `output` is what is left behind where Ctrl-C comes first.
pub(super) fn compute(chosen: &Chosen, output: &Path) -> Result<(Orbits, String), CliError> {
    let stop = stop_flag();
    let bar = progress_bar(CASES, "figures 2-4");
    let goes_on = || !stop.load(Ordering::Relaxed);
    let (mut orbits, mut total) = (0, WorkCounts::default());
    let solved = Orbits::compute(|case: &Case, problem: &Problem| {
        let (settled, counts) = match chosen {
            Chosen::Device(context) => {
                let mut stepper = NetworkStepper::new(context, &problem.network, &[])?;
                settle(&mut stepper, ESTIMATE_FLOOR, problem, &goes_on).map_err(|failure| failure.told(case, output))?
            }
            Chosen::Reference => {
                let mut stepper = ReferenceStepper::new(problem.network.clone(), &[]);
                settle(&mut stepper, 0.0, problem, &goes_on).map_err(|failure| failure.told(case, output))?
            }
        };
        orbits += settled.orbits;
        total.dispatches += counts.dispatches;
        total.stages += counts.stages;
        total.sub_steps += counts.sub_steps;
        bar.inc(1);
        let faces = |row: Vec<f64>| std::array::from_fn(|face| row.get(face).copied().unwrap_or(f64::NAN));
        Ok::<_, CliError>(settled.orbit.into_iter().map(faces).collect())
    });
    bar.finish_and_clear();
    let WorkCounts { dispatches, stages, sub_steps, .. } = total;
    let work = format!(
        "figures 2 to 4: {CASES} periodic states to {PERIODIC_TOLERANCE} K in {orbits} orbits, tolerance {TOLERANCE} K: \
         {sub_steps} sub-steps, {stages} stages, {dispatches} dispatches"
    );
    Ok((solved?, work))
}

/// Why a periodic state was not found.
enum Failure<E> {
    Control(ControlError<E>),
    Periodic,
}

impl<E> Failure<E>
where
    CliError: From<E>,
{
    fn told(self, case: &Case, output: &Path) -> CliError {
        match self {
            Self::Control(ControlError::Stepper(error)) => error.into(),
            Self::Control(ControlError::Stopped) => CliError::Stopped(output.to_path_buf()),
            Self::Control(ControlError::Unbalanced { time, .. }) => {
                CliError::Solver(format!("{case}: the faces have no balance at {time} s"))
            }
            Self::Control(
                ControlError::NoStep { time, .. }
                | ControlError::Stiff { time, .. }
                | ControlError::TooHot { time, .. }
                | ControlError::Chatter { time, .. },
            ) => CliError::Solver(format!("{case}: no sub-step is short enough at {time} s")),
            Self::Periodic => CliError::Solver(format!("{case}: no periodic state was found")),
        }
    }
}

impl<E> From<std::convert::Infallible> for Failure<E> {
    fn from(never: std::convert::Infallible) -> Self {
        match never {}
    }
}

/// One cube's periodic state on a stepper whose estimates of the error are noise below `floor` [K].
fn settle<S: Stepper>(
    stepper: &mut S,
    floor: f64,
    problem: &Problem,
    goes_on: &impl Fn() -> bool,
) -> Result<(Settled, WorkCounts), Failure<S::Error>> {
    let table = |face: usize| {
        let (times, powers) = problem.table(face).into_iter().map(|[time, power]| (time, power)).unzip();
        (face as u32, HeatTable { times, powers })
    };
    let schedule = Schedule {
        heat: (0..problem.network.len()).map(table).collect(),
        times: (0..=STEPS).map(|step| step as f64 * STEP).collect(),
        ..Schedule::default()
    };
    let settings = Settings { tolerance: TOLERANCE, floor, ..Settings::of(Integrator::Default) };
    let mut balance = ReferenceStepper::new(problem.network.clone(), &[]);
    let orbit = |start: &[f64]| {
        stepper.set_temperatures(start).map_err(|error| Failure::Control(ControlError::Stepper(error)))?;
        let series = integrate(stepper, &problem.network, &schedule, &settings, |_| goes_on());
        Ok::<_, Failure<S::Error>>(series.map_err(Failure::Control)?.rows)
    };
    let settled = periodic::settle(&problem.network, PERIOD, PERIODIC_TOLERANCE, &mut balance, orbit)?;
    Ok((settled.ok_or(Failure::Periodic)?, stepper.counts()))
}
