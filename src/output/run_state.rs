//! The saved state of a run into a folder.

use super::between::Between;
use super::run_pictures::WrittenFrame;
use super::state_file::SavedState;
use crate::simulation::energy::EnergySums;
use crate::simulation::orbits::Periodic;
use crate::simulation::state::BetweenSteps;
use crate::simulation::uncertainty::UncertaintyState;
use crate::simulation::warm_up::WarmUpState;

/// The saved state of a run into a folder.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct RunState {
    pub(crate) identity: RunIdentity,
    pub(crate) progress: RunProgress,
}

impl RunState {
    /// Whether the run was saved in its warm-up.
    pub fn is_in_warm_up(&self) -> bool {
        matches!(self.progress, RunProgress::WarmUp(..))
    }
}

impl SavedState for RunState {
    const KIND: &str = "state of a run into a folder";
}

/// What a run was begun with. Only a run with the same goes on.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct RunIdentity {
    pub(crate) device: String,
    pub(crate) driver: String,
    /// The scene file, as seen from the directory.
    pub(crate) scene: String,
    pub(crate) directory: String,
    pub(crate) command_line: String,
    /// Files that the run reads, each with its SHA-256.
    pub(crate) files: Vec<(String, String)>,
    /// Whether `--allow-outside` was given.
    pub(crate) allow_outside: bool,
    /// Nodes that the f64 reference also steps.
    pub(crate) check: Option<usize>,
}

/// How far a run is. Seconds are wall time of the whole run and of its steps [s].
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) enum RunProgress {
    /// Nothing was computed.
    Begun,
    /// In the warm-up.
    WarmUp(Box<WarmUpState>, [f64; 2]),
    /// Between two steps.
    Steps(Box<StepsState>),
}

/// The saved state of a run between two steps.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct StepsState {
    pub(crate) state: BetweenSteps,
    pub(crate) periodic: Option<Periodic>,
    /// Absent where the scene keeps no energy balance.
    pub(crate) energy: Option<EnergySums>,
    /// Absent where images state no error.
    pub(crate) uncertainty: Option<UncertaintyState>,
    /// Lengths of the tables [bytes].
    pub(crate) tables: [u64; 3],
    pub(crate) done: EarlierResults,
}

/// The results of an earlier part of a run.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct EarlierResults {
    pub(crate) frames: Vec<WrittenFrame>,
    /// Wall time of the whole run and of its steps [s].
    pub(crate) seconds: [f64; 2],
    pub(crate) between: Between,
}

impl RunProgress {
    /// Image files of the frames that were written.
    pub(crate) fn frames(&self) -> impl Iterator<Item = String> + '_ {
        let frames = match self {
            Self::Steps(steps) => steps.done.frames.as_slice(),
            _ => &[],
        };
        frames.iter().map(|frame| frame.file("exr"))
    }
}
