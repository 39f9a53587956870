//! Number of recorded iterations of a network's solver.

use crate::gpu::layout::NetworkSolver;

/// Iterations of conjugate gradients after which a system has failed.
const MOST_GRADIENTS: u32 = 6_000;
/// Iterations of Newton's method after which a stage has failed.
const MOST_NEWTONS: u32 = 40;
/// Iterations of Newton's method after which a balance far from its start has failed.
const MOST_NEWTONS_FAR: u32 = 60;
/// Iterations of Newton's method in one submission for a steady state.
const STEADY_NEWTONS: u32 = 6;
/// Number of consecutive attempts that need fewer iterations before fewer are recorded.
const PATIENCE: u32 = 8;

/// Recorded iterations, learned from the last attempts. Extra iterations change no result. If there are too few, the
/// attempt is recorded again.
#[derive(Debug, Clone, Copy)]
pub(super) struct Budget {
    newtons: u32,
    gradients: u32,
    most_newtons: u32,
    /// Number of consecutive attempts that needed fewer iterations, and the most that they needed.
    idle: u32,
    needed: [u32; 2],
}

impl Budget {
    fn new(newtons: u32, gradients: u32, most_newtons: u32) -> Self {
        Self { newtons, gradients, most_newtons, idle: 0, needed: [0; 2] }
    }

    /// All numbers as words.
    pub(super) fn words(self) -> [u32; 6] {
        [self.newtons, self.gradients, self.most_newtons, self.idle, self.needed[0], self.needed[1]]
    }

    /// From its words.
    pub(super) fn from_words([newtons, gradients, most_newtons, idle, a, b]: [u32; 6]) -> Self {
        Self { newtons, gradients, most_newtons, idle, needed: [a, b] }
    }

    /// For the arithmetic nodes at a stage.
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

    /// Recorded iterations of Newton's method and of conjugate gradients.
    pub(super) fn iterations(&self) -> [u32; 2] {
        [self.newtons, self.gradients]
    }

    /// Whether an attempt had enough iterations. It also learns how many it needed.
    pub(super) fn was_enough(&mut self, solver: &NetworkSolver) -> bool {
        if solver.short_gradients > 0.0 || solver.short_newtons > 0.0 {
            return false;
        }
        // One more iteration is needed to detect convergence.
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

    /// Records more next time. Returns whether the limit allows it.
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
