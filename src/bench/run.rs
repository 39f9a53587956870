//! Measures everything that was asked for, device by device.

use std::sync::Arc;

use rayon::prelude::*;

use super::Section;
use super::cases::{self, Case, CaseError, Size};
use super::clock::{Clock, Deadline, OUT_OF_TIME};
use super::hard;
use super::integrators::{Effort, Timed, arithmetic, measure};
use super::record::{Bench, CaseSummary, DriverRow, FrameRow, Integrated, Limits, Measured, Run, load_average};
use super::responses::{self, ResponseError};
use super::schemes::Scheme;
use super::truth::Truth;
use super::{drivers, frames, limits, models};
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::network::{ESTIMATE_FLOOR, NetworkStepper};
use crate::host::ProcessorTime;
use crate::scene::Scene;
use crate::thermal::network::control::FLOOR;
use crate::thermal::network::reference::ReferenceStepper;

/// What keeps measurements from being made at all; what one of them lacks stands in its row.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A case.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// A response.
    #[error(transparent)]
    Response(#[from] ResponseError),
    /// The scene of the choices of a model.
    #[error("model choices: {0}")]
    Models(String),
    /// The reference of a case.
    #[error("case {0}: its f64 reference fails")]
    Reference(&'static str),
}

/// Where to measure.
pub enum Target {
    /// A Vulkan device.
    Device(Arc<Context>),
    /// The f64 reference on the processor: integrators only.
    Reference,
}

/// What to measure, and how thoroughly.
pub struct Plan {
    /// Which parts.
    pub sections: Vec<Section>,
    /// Fewer schemes, nodes and frames.
    pub quick: bool,
    /// Devices.
    pub targets: Vec<Target>,
    /// Scenes whose ticks are measured.
    pub scenes: Vec<Scene>,
    /// Scene whose choices of a model are compared.
    pub model_scene: Option<Scene>,
    /// The command as it was given.
    pub command_line: String,
}

impl Plan {
    fn scale(&self) -> hard::Scale {
        if self.quick { hard::Scale::Quick } else { hard::Scale::Whole }
    }

    fn size(&self) -> Size {
        if self.quick { Size::quick() } else { Size::whole() }
    }

    fn effort(&self) -> Effort {
        if self.quick { Effort { runs: 1, enough: 0.0, most: 2.0 } } else { Effort { runs: 3, enough: 1.0, most: 5.0 } }
    }

    /// Sub-steps a frame of the f64 references: 0.13 s, or 0.26 s.
    fn reference_sub_steps(&self) -> u32 {
        if self.quick { 64 } else { 128 }
    }

    fn nodes(&self) -> &'static [usize] {
        if self.quick { &[10_000, 200_000] } else { &[10_000, 100_000, 1_000_000, 10_000_000] }
    }

    /// Longest edges of the scenes' meshes [m], and how their ticks are measured.
    fn frames(&self) -> (&'static [f64], frames::Effort) {
        if self.quick {
            (&frames::EDGES[..2], frames::Effort { ticks: 20, most_nodes: 500_000 })
        } else {
            (&frames::EDGES, frames::Effort { ticks: 100, most_nodes: usize::MAX })
        }
    }

    fn ticks(&self) -> u32 {
        if self.quick { 6 } else { 30 }
    }

    /// Runs all of it; `says` hears what comes next.
    ///
    /// # Errors
    /// See [`BenchError`].
    pub fn run(&self, says: &dyn Fn(&str)) -> Result<Bench, BenchError> {
        let clock = Clock::start(self.quick, self.targets.len());
        let wanted = |section| self.sections.contains(&section);
        let mut truths = Vec::new();
        if wanted(Section::Integrators) {
            says("f64 references");
            let cases = cases::all(&self.size())?;
            let solved = |case: Case| match Truth::of(&case, self.reference_sub_steps()) {
                Some(truth) => Ok((case, truth)),
                None => Err(BenchError::Reference(case.key)),
            };
            truths = cases.into_par_iter().map(solved).collect::<Result<Vec<_>, _>>()?;
        }
        let cases = if wanted(Section::Hard) { hard::all() } else { Vec::new() };
        let without = hard::without(&cases, self.scale());
        let mut devices = Vec::new();
        for (number, target) in self.targets.iter().enumerate() {
            let deadline = |section| clock.deadline(number, section, &self.sections);
            let started = ProcessorTime::now();
            let mut measured = self.on(target, &truths, &deadline, says)?;
            let says = |case: &str| says(&format!("{}: {case}", measured.name));
            measured.hard = hard::measure(target, &cases, &without, self.scale(), &says);
            measured.load_average[1] = load_average();
            measured.stolen = ProcessorTime::now().zip(started).and_then(|(now, before)| now.stolen_since(before));
            devices.push(measured);
        }
        let drivers = if wanted(Section::Drivers) { self.drivers(says) } else { Vec::new() };
        Ok(Bench {
            drivers,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command_line: self.command_line.clone(),
            release: !cfg!(debug_assertions),
            quick: self.quick,
            processors: std::thread::available_parallelism().map_or(0, usize::from),
            cases: truths.iter().map(summary).collect(),
            devices,
            wall_s: clock.seconds(),
        })
    }

    fn on(
        &self,
        target: &Target,
        truths: &[(Case, Truth)],
        deadline: &dyn Fn(Section) -> Deadline,
        says: &dyn Fn(&str),
    ) -> Result<Measured, BenchError> {
        let before = load_average();
        let (name, info) = match target {
            Target::Device(context) => (context.info.name.clone(), Some(context.info.clone())),
            Target::Reference => ("cpu (f64 reference)".to_owned(), None),
        };
        let mut measured = Measured {
            name,
            info,
            load_average: [before, None],
            stolen: None,
            limits: None,
            responses: vec![],
            frames: vec![],
            models: None,
            integrators: vec![],
            hard: vec![],
        };
        if let Target::Device(context) = target {
            if self.sections.iter().any(|section| matches!(section, Section::Limits | Section::Responses)) {
                says(&format!("{}: limits", measured.name));
                measured.limits = Some(limits::measure(context, self.quick)?);
            }
            if self.sections.contains(&Section::Responses) {
                says(&format!("{}: responses", measured.name));
                let bandwidth = measured.limits.as_ref().and_then(Limits::bandwidth);
                measured.responses = responses::measure(context, self.nodes(), self.ticks(), bandwidth)?;
            }
        }
        if let (Target::Device(context), true) = (target, self.sections.contains(&Section::Frames)) {
            measured.frames = self.whole_ticks(context, &measured.name, deadline(Section::Frames), says);
        }
        if let (Target::Device(context), Some(scene)) = (target, &self.model_scene) {
            let measured_on = models::measure(context, scene, self.quick, deadline(Section::Models), says);
            measured.models = Some(measured_on.map_err(|error| BenchError::Models(error.to_string()))?);
        }
        for (number, (case, truth)) in truths.iter().enumerate() {
            let on = Setting {
                case,
                truth,
                device: &measured.name,
                deadline: deadline(Section::Integrators),
                cases_left: truths.len() - number,
                says,
            };
            let runs = match target {
                Target::Device(context) => self.on_device(context, &on),
                Target::Reference => {
                    let make = || Ok(ReferenceStepper::new(case.network.clone(), &[]));
                    self.schemes(make, &Scheme::all(case, self.quick), FLOOR, &on)
                }
            };
            measured.integrators.push(Integrated { case: case.key.to_owned(), runs });
        }
        measured.load_average[1] = load_average();
        Ok(measured)
    }

    /// Every Vulkan device against the first, where there are several.
    fn drivers(&self, says: &dyn Fn(&str)) -> Vec<DriverRow> {
        let device = |target: &Target| match target {
            Target::Device(context) => Some(context.clone()),
            Target::Reference => None,
        };
        let devices: Vec<Arc<Context>> = self.targets.iter().filter_map(device).collect();
        match self.scenes.last() {
            Some(scene) if devices.len() > 1 => {
                says(&format!("{} on every device", scene.name));
                drivers::measure(&devices, scene)
            }
            _ => Vec::new(),
        }
    }

    fn whole_ticks(
        &self,
        context: &Arc<Context>,
        device: &str,
        deadline: Deadline,
        says: &dyn Fn(&str),
    ) -> Vec<FrameRow> {
        let (edges, effort) = self.frames();
        let mut rows = Vec::new();
        // Coarse ones first: a quick measurement may end before the fine ones.
        for edge in edges {
            for scene in &self.scenes {
                for shadows in [false, true] {
                    says(&format!("{device}: ticks of {}, longest edge {edge} m", scene.name));
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

    /// All schemes, and some of them once more with a dispatch for every stage where one workgroup took all.
    fn on_device(&self, context: &Arc<Context>, on: &Setting<'_>) -> Vec<Run> {
        let own = || NetworkStepper::new(context, &on.case.network, &[]);
        let wide = || NetworkStepper::wide(context, &on.case.network, &[]);
        let mut runs = self.schemes(own, &Scheme::all(on.case, self.quick), ESTIMATE_FLOOR, on);
        if runs.iter().any(|run| run.path == "workgroup") {
            let again = self.schemes(wide, &Scheme::SEPARATE, ESTIMATE_FLOOR, on);
            runs.extend(again.into_iter().map(|run| Run {
                scheme: format!("{}, separate", run.scheme),
                family: format!("{}, separate", run.family),
                ..run
            }));
        }
        runs
    }

    /// A new stepper for each: a stepper may change its ways once it has met a scheme.
    fn schemes<S: Timed>(
        &self,
        make: impl Fn() -> Result<S, GpuError>,
        schemes: &[Scheme],
        floor: f64,
        on: &Setting<'_>,
    ) -> Vec<Run>
    where
        S::Error: std::fmt::Display,
    {
        let one = |(number, scheme): (usize, &Scheme)| {
            (on.says)(&format!("{}: {}, {scheme}", on.device, on.case.key));
            let failed = |reason: String| Run {
                scheme: scheme.to_string(),
                family: scheme.family(),
                failed: Some(reason),
                ..Run::default()
            };
            if on.deadline.is_past() {
                return failed(OUT_OF_TIME.to_owned());
            }
            // The schemes of this case that are left, and as many of each other case.
            let left = schemes.len() - number + (on.cases_left - 1) * schemes.len();
            let effort = self.effort();
            let effort = Effort { most: on.deadline.share(left, effort.most), ..effort };
            match make() {
                Ok(mut stepper) => measure(&mut stepper, floor, on.case, on.truth, *scheme, effort),
                Err(error) => failed(error.to_string()),
            }
        };
        schemes.iter().enumerate().map(one).collect()
    }
}

/// A case on a device, and the time that it has.
struct Setting<'a> {
    case: &'a Case,
    truth: &'a Truth,
    device: &'a str,
    deadline: Deadline,
    /// Cases that are not done, this one among them.
    cases_left: usize,
    says: &'a dyn Fn(&str),
}

fn summary((case, truth): &(Case, Truth)) -> CaseSummary {
    CaseSummary {
        key: case.key.to_owned(),
        title: case.title.clone(),
        nodes: case.network.len(),
        arithmetic: arithmetic(case),
        conductors: case.network.linear.len() + case.network.radiative.len(),
        frames: case.frames.len(),
        frame_s: case.frame,
        stiffness: case.stiffness(),
        published_stiffness: case.published_stiffness,
        reference_sub_steps: truth.sub_steps,
        reference_error: truth.own,
    }
}
