//! How many iterations of a large network's solver are recorded.

use crate::gpu::layout::NetworkSolver;

/// Iterations of conjugate gradients after which a system counts as unsolved.
const MOST_GRADIENTS: u32 = 6_000;
/// Iterations of Newton's method after which a stage counts as unsolved.
const MOST_NEWTONS: u32 = 40;
/// The same of a balance that may start far away.
const MOST_NEWTONS_FAR: u32 = 60;
/// Iterations of Newton's method of one submission towards a steady state.
const STEADY_NEWTONS: u32 = 6;
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
