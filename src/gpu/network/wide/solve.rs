//! Balances of a large network's nodes, and how many iterations of its solver are recorded.

use super::Wide;
use super::constants::Constants;
use crate::gpu::error::GpuError;
use crate::gpu::layout::NetworkSolver;
use crate::gpu::pass::NetworkNodes;
use crate::gpu::resource::Resource;

/// Iterations of conjugate gradients after which a system counts as unsolved.
const MOST_GRADIENTS: u32 = 6_000;
/// Iterations of Newton's method after which a stage counts as unsolved.
const MOST_NEWTONS: u32 = 40;
/// The same of a balance that may start far away.
const MOST_NEWTONS_FAR: u32 = 60;
/// Iterations of Newton's method of one submission towards a steady state, and submissions.
const STEADY_NEWTONS: u32 = 6;
const STEADY_SUBMISSIONS: u32 = 60;
/// Largest relative change of a temperature in the last search towards a steady state, and searches that are made in hope of it:
/// where little heat leaves through large conductances, conjugate gradients leave more of an error than of a residual.
const STEADY_MOVE: f32 = 3e-7;
const STEADY_SEARCHES: u32 = 6;
/// Tries in a row that need less before less is recorded.
const PATIENCE: u32 = 8;

/// How many iterations are recorded: as many as the last tries took. More change no result, fewer are recorded again.
#[derive(Debug, Clone, Copy)]
pub(super) struct Budget {
    newtons: u32,
    gradients: u32,
    most_newtons: u32,
    /// Tries in a row that needed less, and the most that they needed.
    idle: u32,
    needed: [u32; 2],
}

impl Budget {
    fn new(newtons: u32, gradients: u32, most_newtons: u32) -> Self {
        Self { newtons, gradients, most_newtons, idle: 0, needed: [0; 2] }
    }

    /// For arithmetic nodes at a stage.
    pub(super) fn balance() -> Self {
        Self::new(2, 8, MOST_NEWTONS_FAR)
    }

    /// For a stage of TR-BDF2.
    pub(super) fn stage() -> Self {
        Self::new(2, 16, MOST_NEWTONS)
    }

    /// For a steady state.
    pub(super) fn steady() -> Self {
        Self::new(STEADY_NEWTONS, 64, STEADY_NEWTONS)
    }

    /// Newton's and conjugate gradients.
    pub(super) fn iterations(&self) -> [u32; 2] {
        [self.newtons, self.gradients]
    }

    /// Whether a try had enough; learns what it needed.
    pub(super) fn was_enough(&mut self, solver: &NetworkSolver) -> bool {
        if solver.short_gradients > 0.0 || solver.short_newtons > 0.0 {
            return false;
        }
        // One iteration more than was taken: the one that finds that nothing is left to gain.
        let took = [solver.most_newtons as u32, solver.most_gradients as u32 + 1];
        self.needed = [0, 1].map(|part| self.needed[part].max(took[part]));
        self.idle += 1;
        if self.idle == PATIENCE {
            [self.newtons, self.gradients] =
                [self.needed[0].clamp(1, self.newtons), self.needed[1].clamp(1, self.gradients)];
            (self.idle, self.needed) = (0, [0; 2]);
        }
        true
    }

    /// Records more next time. Returns whether there is more to record.
    pub(super) fn grow(&mut self, solver: &NetworkSolver) -> bool {
        (self.idle, self.needed) = (0, [0; 2]);
        if solver.short_gradients > 0.0 {
            self.gradients = (self.gradients * 3).div_ceil(2) + 2;
            return self.gradients <= MOST_GRADIENTS;
        }
        self.newtons += if self.newtons < 4 { 1 } else { self.newtons / 2 };
        self.newtons <= self.most_newtons
    }
}

impl Wide {
    /// What the last submission's solver found.
    pub(super) fn solver(&self) -> NetworkSolver {
        self.resources.read(Resource::SolverScalars, 0, 1)[0]
    }

    /// Balances the arithmetic nodes.
    ///
    /// # Errors
    /// A call that fails.
    pub fn balance(&mut self, t: f64) -> Result<bool, GpuError> {
        if !self.plan.lone && !self.plan.coupled {
            return Ok(true);
        }
        self.odd = false;
        self.plan.stages = 1;
        loop {
            self.plan.iterations = self.budgets[0].iterations();
            self.submit(&[self.plan.start(), self.plan.end()], Constants::balance(t))?;
            if !self.plan.coupled {
                break;
            }
            let solver = self.solver();
            self.counts.iterations += solver.iterations as u64;
            if solver.lost > 0.0 {
                return Ok(false);
            }
            if self.budgets[0].was_enough(&solver) {
                break;
            }
            if !self.budgets[0].grow(&solver) {
                self.budgets[0] = Budget::balance();
                return Ok(false);
            }
        }
        let before: Vec<_> = self.state().collect();
        self.keep()?;
        let found = self.state().flatten().all(f32::is_finite);
        if !found {
            self.set_state(&before)?;
        }
        Ok(found)
    }

    /// Balances all nodes that are no boundary.
    ///
    /// # Errors
    /// A call that fails.
    pub fn steady(&mut self, t: f64) -> Result<bool, GpuError> {
        self.make_solver()?;
        self.odd = false;
        self.plan.stages = 0;
        let constants = Constants::balance(t);
        let mut searches = 0;
        for number in 0..STEADY_SUBMISSIONS {
            self.plan.iterations = self.budgets[2].iterations();
            let mut frames = if number == 0 { vec![self.plan.balance_start()] } else { vec![self.plan.clear_solver()] };
            frames.push(self.plan.balance(NetworkNodes::Free));
            frames.push(self.plan.end());
            self.submit(&frames, constants.clone())?;
            let solver = self.solver();
            self.counts.iterations += solver.iterations as u64;
            if solver.lost > 0.0 {
                return Ok(false);
            }
            let short = solver.short_gradients > 0.0;
            let settled = !short && solver.short_newtons == 0.0;
            searches += u32::from(settled);
            let still = solver.most_newtons == 1.0 && solver.largest_move <= STEADY_MOVE;
            if settled && (still || searches == STEADY_SEARCHES) {
                self.keep()?;
                return Ok(self.state().all(|[base, rest]| f64::from(base) + f64::from(rest) >= 0.0));
            }
            if short && !self.budgets[2].grow(&solver) {
                return Ok(false);
            }
        }
        Ok(false)
    }
}
