//! The saved state of a run into a folder, and when a warm-up is saved.

use std::time::Instant;

use super::between::Between;
use super::job_terms::{JobError, RunContext, SaveEvery};
use super::run_pictures::WrittenFrame;
use super::state_file;
use crate::simulation::check::Check;
use crate::simulation::energy::EnergySums;
use crate::simulation::engine::Engine;
use crate::simulation::keep::Keep;
use crate::simulation::periodic::{Orbits, Periodic};
use crate::simulation::state::BetweenSteps;
use crate::simulation::warm_up::WarmUpState;

/// The saved state of a run into a folder.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct RunState {
    pub(crate) identity: RunIdentity,
    pub(crate) progress: RunProgress,
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
    /// Lengths of the tables [bytes].
    pub(crate) tables: [u64; 2],
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

/// Saves the state of the warm-up.
pub(super) struct Keeper<'a> {
    pub(crate) run: RunContext<'a>,
    /// The state that was taken last.
    pub(crate) state: Option<WarmUpState>,
    /// Steps before the last state that was saved, and when it was saved.
    pub(crate) saved: (u32, Instant),
    pub(crate) before: [f64; 2],
}

impl Keep<JobError> for Keeper<'_> {
    fn take(
        &mut self,
        done: u32,
        orbits: Option<&Orbits>,
        engine: &mut dyn Engine,
        check: Option<&mut Check>,
    ) -> Result<(), JobError> {
        self.state = Some(WarmUpState { state: BetweenSteps::capture(done, engine, check)?, orbits: orbits.cloned() });
        Ok(())
    }

    fn wants(&self, done: u32) -> bool {
        let (steps, time) = self.saved;
        match self.run.job.save_every {
            SaveEvery::Time(every) => !every.is_zero() && time.elapsed() >= every,
            SaveEvery::Steps(every) => done - steps >= every,
        }
    }

    fn save(&mut self) -> Result<(), JobError> {
        let Some(state) = &self.state else { return Ok(()) };
        let done = state.state.next;
        let [wall, stepping] = self.before;
        let seconds = [wall + self.run.began.elapsed().as_secs_f64(), stepping];
        let progress = RunProgress::WarmUp(Box::new(state.clone()), seconds);
        state_file::write(&self.run.folder.state(), &RunState { identity: self.run.job.identity.clone(), progress })?;
        self.saved = (done, Instant::now());
        Ok(())
    }
}
