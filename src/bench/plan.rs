//! The plan of a measurement: which parts, on which devices, and how thoroughly.

use super::cases::Size;
use super::frames;
use super::hard::CaseScale;
use super::integrators::IntegratorEffort;
use crate::scene::Scene;
use crate::simulation::target::Target;

/// A part of the measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Measurement {
    /// Copies and an empty dispatch.
    Limits,
    /// Nanoseconds a node and step of each response.
    Responses,
    /// Whole steps of scenes with images, pass by pass.
    Frames,
    /// Cost and effect of each model choice.
    Models,
    /// The same scene on every device.
    Drivers,
    /// Every integrator on the cases of docs/numerics.md 3.
    Integrators,
    /// The hard cases with and without their remedies.
    Hard,
}

impl Measurement {
    /// All parts in order of execution.
    pub(crate) const ALL: [Self; 7] =
        [Self::Limits, Self::Responses, Self::Frames, Self::Models, Self::Drivers, Self::Integrators, Self::Hard];

    /// Name on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Limits => "limits",
            Self::Responses => "responses",
            Self::Frames => "frames",
            Self::Models => "models",
            Self::Drivers => "drivers",
            Self::Integrators => "integrators",
            Self::Hard => "hard",
        }
    }

    /// The part with this name.
    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.name() == name)
    }
}

pub(crate) struct BenchPlan {
    pub(crate) measurements: Vec<Measurement>,
    /// Whether to use fewer schemes, nodes and frames.
    pub(crate) quick: bool,
    pub(crate) targets: Vec<Target>,
    /// Scenes for whole steps.
    pub(crate) scenes: Vec<Scene>,
    pub(crate) model_scene: Option<Scene>,
    pub(crate) command_line: String,
}

impl BenchPlan {
    pub(super) fn scale(&self) -> CaseScale {
        if self.quick { CaseScale::Quick } else { CaseScale::Whole }
    }

    pub(super) fn size(&self) -> Size {
        if self.quick { Size::quick() } else { Size::whole() }
    }

    pub(super) fn effort(&self) -> IntegratorEffort {
        if self.quick {
            IntegratorEffort { runs: 1, enough: 0.0, most: 2.0 }
        } else {
            IntegratorEffort { runs: 3, enough: 1.0, most: 5.0 }
        }
    }

    /// Sub-steps a frame of the f64 references: 0.13 s each, or 0.26 s in a quick run.
    pub(super) fn reference_sub_steps(&self) -> u32 {
        if self.quick { 64 } else { 128 }
    }

    pub(super) fn nodes(&self) -> &'static [usize] {
        if self.quick { &[10_000, 200_000] } else { &[10_000, 100_000, 1_000_000, 10_000_000] }
    }

    /// Longest edges of the scenes' meshes [m], and the amount of measurement.
    pub(super) fn frames(&self) -> (&'static [f64], frames::FrameEffort) {
        if self.quick {
            (&frames::EDGES[..2], frames::FrameEffort { steps: 20, most_nodes: 500_000 })
        } else {
            (&frames::EDGES, frames::FrameEffort { steps: 100, most_nodes: usize::MAX })
        }
    }

    pub(super) fn steps(&self) -> u32 {
        if self.quick { 6 } else { 30 }
    }
}
