//! Takes the results of the steps of a run to its tables and its writer, and saves the state between steps.

use std::sync::Mutex;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::Instant;

use rayon::prelude::*;

use super::between::Between;
use super::folder::STATE;
use super::frame_maker::FrameMaker;
use super::frame_writer::{WriterWork, lock};
use super::job_terms::{Done, JobError, RunContext, SaveEvery};
use super::run_pictures::WrittenFrame;
use super::run_state::{EarlierResults, RunProgress, RunState, StepsState};
use super::state_file;
use super::tables::Tables;
use crate::model::nodes::GROUP;
use crate::simulation::check::Check;
use crate::simulation::energy::Account;
use crate::simulation::engine::Engine;
use crate::simulation::orbits::Periodic;
use crate::simulation::prepare::Prepared;
use crate::simulation::state::BetweenSteps;
use crate::simulation::thermal_state::ThermalState;
use crate::simulation::uncertainty::Uncertainty;
use crate::simulation::{Consumer, StepResult};
use crate::trace::span;

/// Takes the results of the steps to the files, and saves the state.
pub(super) struct StepRecorder<'a, 'b> {
    pub(crate) run: RunContext<'a>,
    pub(crate) maker: Option<&'a FrameMaker<'a>>,
    pub(crate) tables: &'a mut Tables<'b>,
    pub(crate) account: Option<&'a mut Account>,
    /// The errors of the temperatures, where the images state them.
    pub(crate) uncertainty: Option<Uncertainty<'a>>,
    /// The last step that was taken.
    pub(crate) steps: u32,
    pub(crate) frames: SyncSender<WriterWork>,
    pub(crate) written: &'a Mutex<Vec<WrittenFrame>>,
    pub(crate) periodic: Option<Periodic>,
    pub(crate) between: Between,
    pub(crate) state: Option<ThermalState>,
    pub(crate) saves: bool,
    pub(crate) saved: Instant,
    pub(crate) stepping_began: Instant,
    pub(crate) before: [f64; 2],
}

impl Consumer<JobError> for StepRecorder<'_, '_> {
    fn take(&mut self, mut result: StepResult) -> Result<(), JobError> {
        let adds = span("adding to the series");
        if let Some(uncertainty) = &mut self.uncertainty {
            uncertainty.follow(&mut result);
        }
        if let Some(temperatures) = result.delivered.temperatures.take() {
            check_finite(self.run.prepared, result.step, &temperatures)?;
            self.tables.add(self.run.prepared, result.time, &temperatures)?;
            if let Some(account) = &mut self.account {
                account.take(&temperatures, result.delivered.absorbed.as_deref());
            }
            if let Some(budgets) = &result.budgets {
                self.tables.add_budgets(self.run.prepared, result.time, budgets)?;
            }
            if self.run.prepared.scene.time.draw.is_between_steps() {
                self.between.take(self.run.prepared, result.step, temperatures);
            }
        }
        drop(adds);
        let makes = span("making the frame");
        self.steps = result.step;
        let is_step = result.image.is_none();
        let frame = self.maker.map(|maker| maker.frame(result)).transpose()?.flatten();
        drop(makes);
        if let Some(mut frame) = frame {
            if let Some(sigma) = self.run.job.sigma {
                sigma.add_to(&mut frame.0, &frame.1);
            }
            let _waits = span("waiting for the files");
            self.frames.send(WriterWork::Frame(Box::new(frame))).map_err(|_| JobError::Writer)?;
        }
        if is_step {
            (self.run.progress)(Done::Step);
        }
        Ok(())
    }

    fn wants_state(&self, next: u32) -> bool {
        if self.run.job.take_after.is_some_and(|step| step + 1 == next) {
            return true;
        }
        match self.run.job.save_every {
            SaveEvery::Time(time) => !time.is_zero() && self.saved.elapsed() >= time,
            SaveEvery::Steps(steps) => next.is_multiple_of(steps.max(1)),
        }
    }

    fn save(&mut self, next: u32, engine: &mut dyn Engine, check: Option<&mut Check>) -> Result<(), JobError> {
        if !self.saves {
            return Ok(());
        }
        let _saves = span("saving the state");
        let mut check = check;
        if let Some(step) = self.run.job.take_after.filter(|step| step + 1 == next) {
            let time = f64::from(step) * self.run.prepared.scene.time.step;
            let state = ThermalState::take(self.run.prepared, engine, check.as_deref_mut(), time)?;
            self.state = Some(state.with_errors(self.uncertainty.as_ref().map(Uncertainty::save)));
        }
        let state = BetweenSteps::capture(next, engine, check)?;
        let tables = self.tables.sync()?;
        // The state names the frames before it, so they are written first.
        let (tell, told) = sync_channel(1);
        self.frames.send(WriterWork::Tell(tell)).map_err(|_| JobError::Writer)?;
        told.recv().map_err(|_| JobError::Writer)?;
        let [wall, stepping] = self.before;
        let wall = wall + self.run.began.elapsed().as_secs_f64();
        let steps = StepsState {
            state,
            periodic: self.periodic,
            energy: self.account.as_ref().map(|account| account.sums.clone()),
            uncertainty: self.uncertainty.as_ref().map(Uncertainty::save),
            tables,
            done: EarlierResults {
                frames: lock(self.written).clone(),
                seconds: [wall, stepping + self.stepping_began.elapsed().as_secs_f64()],
                between: self.between.clone(),
            },
        };
        let progress = RunProgress::Steps(Box::new(steps));
        state_file::write(
            self.run.folder.guarded()?,
            STATE,
            &RunState { identity: self.run.job.identity.clone(), progress },
        )?;
        self.run.casts.save(self.run.folder, self.run.prepared);
        self.saved = Instant::now();
        Ok(())
    }
}

/// Refuses temperatures that are not finite. The error names the first such node.
pub(crate) fn check_finite(prepared: &Prepared, step: u32, temperatures: &[f32]) -> Result<(), JobError> {
    let nodes = &prepared.nodes;
    let broken = nodes.node_of_vertex.par_iter().find_first(|node| !temperatures[**node as usize].is_finite());
    match broken {
        None => Ok(()),
        Some(node) => {
            let group = *node as usize / GROUP;
            Err(JobError::NotFinite {
                step,
                node: *node,
                part: prepared.parts[nodes.group_part[group] as usize].clone(),
                material: prepared.materials[nodes.group_material[group] as usize].name.clone(),
            })
        }
    }
}
