//! Runs all planned measurements, device by device.

use std::sync::Arc;

use rayon::prelude::*;

use super::cases::{self, CaseError, NetworkCase};
use super::clock::{BenchClock, Deadline, OUT_OF_TIME};
use super::drivers::{self, DriverRow};
use super::frames::{self, FrameRow};
use super::integrators::{Integrated, IntegratorEffort, IntegratorRun, measure_integrator};
use super::limits::{self, Limits};
use super::plan::{BenchPlan, Measurement};
use super::record::{Bench, DeviceMeasurements, load_average};
use super::responses::{self, ResponseError};
use super::schemes::Scheme;
use super::truth::{CaseSummary, Truth};
use super::{frontier, hard, models};
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::host::ProcessorTime;
use crate::simulation::target::Target;
use crate::thermal::network::reference::ReferenceStepper;

/// An error that stops all measurements. The error of a single measurement is in its row.
#[derive(Debug, thiserror::Error)]
pub(crate) enum BenchError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Case(#[from] CaseError),
    #[error(transparent)]
    Response(#[from] ResponseError),
    /// The scene of the choices of a model.
    #[error("model choices: {0}")]
    Models(String),
    /// The reference of a case.
    #[error("case {0}: its f64 reference fails")]
    Reference(&'static str),
}

/// Runs the plan. `says` gets the name of each measurement beforehand.
pub(crate) fn run(plan: &BenchPlan, says: &dyn Fn(&str)) -> Result<Bench, BenchError> {
    let clock = BenchClock::start(plan.quick, plan.targets.len());
    let wanted = |one| plan.measurements.contains(&one);
    let mut truths = Vec::new();
    if wanted(Measurement::Integrators) {
        says("f64 references");
        let cases = cases::all_cases(&plan.size())?;
        let solved = |case: NetworkCase| match Truth::of(&case, plan.reference_sub_steps()) {
            Some(truth) => Ok((case, truth)),
            None => Err(BenchError::Reference(case.key)),
        };
        truths = cases.into_par_iter().map(solved).collect::<Result<Vec<_>, _>>()?;
    }
    let cases = if wanted(Measurement::Hard) { hard::all_hard_cases() } else { Vec::new() };
    let without = hard::without(&cases, plan.scale());
    let mut devices = Vec::new();
    for (number, target) in plan.targets.iter().enumerate() {
        let deadline = |one| clock.deadline(number, one, &plan.measurements);
        let started = ProcessorTime::now();
        // The processor integrates in f64, whatever the device.
        let truths = if number == 0 { &truths[..] } else { &[] };
        let mut measured = on(plan, target, truths, &deadline, says)?;
        let says = |case: &str| says(&format!("{}: {case}", measured.name));
        measured.hard = hard::measure_hard_case(target, &cases, &without, plan.scale(), &says);
        measured.load_average[1] = load_average();
        measured.stolen = ProcessorTime::now().zip(started).and_then(|(now, before)| now.stolen_since(before));
        devices.push(measured);
    }
    let drivers = if wanted(Measurement::Drivers) { drivers(plan, says) } else { Vec::new() };
    Ok(Bench {
        drivers,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        command_line: plan.command_line.clone(),
        release: !cfg!(debug_assertions),
        quick: plan.quick,
        processors: std::thread::available_parallelism().map_or(0, usize::from),
        cases: truths.iter().map(CaseSummary::of).collect(),
        devices,
        wall_s: clock.seconds(),
    })
}

fn on(
    plan: &BenchPlan,
    target: &Target,
    truths: &[(NetworkCase, Truth)],
    deadline: &dyn Fn(Measurement) -> Deadline,
    says: &dyn Fn(&str),
) -> Result<DeviceMeasurements, BenchError> {
    let wanted = |one| plan.measurements.contains(&one);
    let mut measured = DeviceMeasurements {
        name: target.name(),
        info: target.device().map(|context| context.info.clone()),
        load_average: [load_average(), None],
        ..DeviceMeasurements::default()
    };
    let name = &measured.name;
    if let Some(context) = target.device() {
        if wanted(Measurement::Limits) || wanted(Measurement::Responses) {
            says(&format!("{name}: limits"));
            measured.limits = Some(limits::measure(context, plan.quick)?);
        }
        if wanted(Measurement::Responses) {
            says(&format!("{name}: responses"));
            let bandwidth = measured.limits.as_ref().and_then(Limits::bandwidth);
            measured.responses = responses::measure(context, plan.nodes(), plan.steps(), bandwidth)?;
        }
        if wanted(Measurement::Frames) {
            measured.frames = whole_ticks(plan, context, deadline(Measurement::Frames), says);
        }
        if let Some(scene) = &plan.model_scene {
            let basis = models::Basis::new(context, scene, plan.quick, says);
            let basis = basis.map_err(|error| BenchError::Models(error.to_string()))?;
            let deadline = deadline(Measurement::Models);
            measured.models = Some(models::measure(context, &basis, plan.quick, deadline, says));
            measured.frontier = frontier::measure(context, &basis, plan.quick, deadline, says);
        }
    }
    let deadline = deadline(Measurement::Integrators);
    for (number, (case, truth)) in truths.iter().enumerate() {
        let on = CaseSetting { plan, case, truth, deadline, cases_left: truths.len() - number, says };
        measured.integrators.push(Integrated { case: case.key.to_owned(), runs: on.all_schemes() });
    }
    measured.load_average[1] = load_average();
    Ok(measured)
}

/// Compares every Vulkan device with the first, if there are several.
fn drivers(plan: &BenchPlan, says: &dyn Fn(&str)) -> Vec<DriverRow> {
    let devices: Vec<Arc<Context>> = plan.targets.iter().filter_map(|target| target.device().cloned()).collect();
    match plan.scenes.last() {
        Some(scene) if devices.len() > 1 => {
            says(&format!("{} on every device", scene.name));
            drivers::measure(&devices, scene)
        }
        _ => Vec::new(),
    }
}

fn whole_ticks(plan: &BenchPlan, context: &Arc<Context>, deadline: Deadline, says: &dyn Fn(&str)) -> Vec<FrameRow> {
    let (edges, effort) = plan.frames();
    let device = &context.info.name;
    let mut rows = Vec::new();
    // Coarse edges come first, because a quick measurement may end before the fine ones.
    for edge in edges {
        for scene in &plan.scenes {
            for shadows in [false, true] {
                says(&format!("{device}: steps of {}, longest edge {edge} m", scene.name));
                rows.push(if deadline.is_past() {
                    frames::left_out(scene, *edge, shadows, OUT_OF_TIME)
                } else {
                    frames::measure(context, scene, *edge, shadows, effort)
                });
            }
        }
    }
    rows
}

/// A case with its deadline.
struct CaseSetting<'a> {
    plan: &'a BenchPlan,
    case: &'a NetworkCase,
    truth: &'a Truth,
    deadline: Deadline,
    /// Number of remaining cases, including this one.
    cases_left: usize,
    says: &'a dyn Fn(&str),
}

impl CaseSetting<'_> {
    /// Makes a new stepper for each scheme, because a stepper may keep state from earlier schemes.
    fn all_schemes(&self) -> Vec<IntegratorRun> {
        let schemes = Scheme::all(self.case, self.plan.quick);
        let one = |(number, scheme): (usize, &Scheme)| {
            (self.says)(&format!("{}, {scheme}", self.case.key));
            let failed = |reason: String| IntegratorRun {
                scheme: scheme.to_string(),
                family: scheme.family(),
                failed: Some(reason),
                ..IntegratorRun::default()
            };
            if self.deadline.is_past() {
                return failed(OUT_OF_TIME.to_owned());
            }
            // The remaining schemes of this case, and the same number for each remaining case.
            let left = schemes.len() - number + (self.cases_left - 1) * schemes.len();
            let effort = self.plan.effort();
            let effort = IntegratorEffort { most: self.deadline.share(left, effort.most), ..effort };
            let mut stepper = ReferenceStepper::new(self.case.network.clone(), &[]);
            measure_integrator(&mut stepper, self.case, &self.truth.rows, *scheme, effort)
        };
        schemes.iter().enumerate().map(one).collect()
    }
}
