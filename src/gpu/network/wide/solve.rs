//! Balancing of a network's nodes: the arithmetic ones, or all.

use super::Wide;
use super::budget::Budget;
use super::constants::Constants;
use crate::gpu::error::GpuError;
use crate::gpu::layout::NetworkSolver;
use crate::gpu::pass::NetworkNodes;
use crate::gpu::resource::Resource;

/// Most submissions for a steady state.
const STEADY_SUBMISSIONS: u32 = 60;
/// Largest relative temperature change in the last search for a steady state, and the most searches. Several searches
/// help if little heat flows through large conductances, because the error of conjugate gradients then exceeds their
/// residual.
const STEADY_MOVE: f32 = 3e-7;
const STEADY_SEARCHES: u32 = 6;

impl Wide {
    /// State of the solver after the last submission.
    pub(super) fn solver(&self) -> NetworkSolver {
        self.resources.read(Resource::SolverScalars, 0, 1)[0]
    }

    /// Balances the arithmetic nodes. Returns whether they converged.
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

    /// Balances all nodes that are not a boundary. Returns whether they converged.
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
