//! Saves the state of a warm-up.

use std::time::Instant;

use super::folder::STATE;
use super::job_terms::{JobError, RunContext, SaveEvery};
use super::run_state::{RunProgress, RunState};
use super::state_file;
use crate::simulation::check::Check;
use crate::simulation::engine::Engine;
use crate::simulation::keep::Keep;
use crate::simulation::orbits::Orbits;
use crate::simulation::state::BetweenSteps;
use crate::simulation::warm_up::WarmUpState;

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
        state_file::write(
            self.run.folder.guarded()?,
            STATE,
            &RunState { identity: self.run.job.identity.clone(), progress },
        )?;
        self.run.casts.save(self.run.folder, self.run.prepared);
        self.saved = (done, Instant::now());
        Ok(())
    }
}
