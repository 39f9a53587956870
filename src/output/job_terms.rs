//! The request for a run into a folder, its outcome, and its errors.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use super::OutputError;
use super::casts_file::CastsOfRun;
use super::folder::Folder;
use super::report::{FrameEntry, PartBudget, PlotEntry, ReportPicture};
use super::run_state::{RunIdentity, RunProgress};
use super::sigma::{RunSigma, SigmaReport};
use crate::simulation::check::Accuracy;
use crate::simulation::energy::EnergyBalance;
use crate::simulation::engine::EngineError;
use crate::simulation::network::StepCost;
use crate::simulation::orbits::Periodic;
use crate::simulation::prepare::Prepared;
use crate::simulation::thermal_state::ThermalState;
use crate::simulation::uncertainty::PixelError;

/// An error that ends a run early.
#[derive(Debug, thiserror::Error)]
pub(crate) enum JobError {
    #[error(transparent)]
    Engine(#[from] EngineError),
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The thread that writes files has ended. The error of that thread says why.
    #[error("the files could not be written")]
    Writer,
    #[error(
        "step {step}: the temperature of node {node} (part {part}, material {material}) is not finite; please report the scene"
    )]
    NotFinite {
        /// The first step with such a temperature.
        step: u32,
        /// The first such node.
        node: u32,
        part: String,
        material: String,
    },
}

/// A unit of progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Done {
    WarmUp,
    Step,
    Picture,
}

/// The results of a run.
pub(crate) struct RunOutcome {
    /// Whether all steps were done.
    pub(crate) complete: bool,
    pub(crate) frames: Vec<FrameEntry>,
    pub(crate) pictures: Vec<ReportPicture>,
    pub(crate) plots: Vec<PlotEntry>,
    /// Error of the device against the f64 reference, if requested.
    pub(crate) accuracy: Option<Accuracy>,
    /// The energy balance, if the scene keeps it.
    pub(crate) energy: Option<EnergyBalance>,
    /// Estimated error of the temperatures between steps [K], where images lie there.
    pub(crate) between: Option<f64>,
    /// Mean budget of each part. Empty where the scene does not ask for it.
    pub(crate) budgets: Vec<PartBudget>,
    /// Uncertainty of the run, where the scene asks for it.
    pub(crate) sigma: Option<SigmaReport>,
    /// Stated error of the pixels, where the scene asks for it.
    pub(crate) pixel_error: Option<PixelError>,
    /// The thermal state that was asked for, where its step was reached.
    pub(crate) state: Option<ThermalState>,
    pub(crate) periodic: Option<Periodic>,
    /// Cost of the network in every step after the warm-up.
    pub(crate) network_costs: Vec<StepCost>,
    /// Wall time of the steps without start-up and pictures [s].
    pub(crate) stepping_s: f64,
    /// Wall time of the earlier parts of the run [s].
    pub(crate) wall_before_s: f64,
}

impl RunOutcome {
    /// Warns of images that show nothing of the craft but an end of the range.
    pub(crate) fn range_warning(&self) -> Option<String> {
        let (at_end, images) = (self.frames.iter().filter(|frame| frame.at_end_of_range).count(), self.frames.len());
        (at_end > 0).then(|| {
            format!("sensor.range: in {at_end} of {images} images all pixels of the craft are at an end of the range")
        })
    }
}

/// How a run is done.
pub(crate) struct Job<'a> {
    /// Number of nodes that the f64 reference also steps.
    pub(crate) check: Option<usize>,
    pub(crate) save_every: SaveEvery,
    /// Scene, files and options of the run, for the command that resumes it.
    pub(crate) identity: &'a RunIdentity,
    /// How far an earlier part of the run went.
    pub(crate) earlier: Option<&'a RunProgress>,
    /// The thermal state at time 0, instead of a warm-up.
    pub(crate) begin: Option<&'a ThermalState>,
    /// The uncertainty of the run, where the scene asks for it.
    pub(crate) sigma: Option<&'a RunSigma>,
    /// The step after which the thermal state is taken.
    pub(crate) take_after: Option<u32>,
}

/// The scene, the folder and the caller of a run.
#[derive(Clone, Copy)]
pub(super) struct RunContext<'a> {
    pub(crate) prepared: &'a Prepared,
    pub(crate) folder: &'a Folder,
    pub(crate) job: &'a Job<'a>,
    pub(crate) stop: &'a AtomicBool,
    pub(crate) progress: &'a (dyn Fn(Done) + Sync),
    pub(crate) began: Instant,
    pub(crate) casts: &'a CastsOfRun,
}

/// How often the state of a run is saved. In any case, the state is saved after the warm-up, after the last step and when the run is stopped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SaveEvery {
    /// After so much wall-clock time. Never where it is 0.
    Time(Duration),
    /// After so many steps.
    Steps(u32),
}
