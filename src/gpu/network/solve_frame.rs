//! Frame lists of the linear solver of a network: Newton's method with conjugate gradients.
//!
//! The conjugate gradients use Jacobi's preconditioner and one reduction for each iteration. The host records as many
//! iterations as the last attempts needed, and records more if an attempt had too few. The device stops after
//! convergence, so more iterations do not change the result. If nodes radiate to each other, the matrix is not
//! symmetric. The solver then uses the geometric mean of each pair of entries, which makes the matrix symmetric and
//! positive definite. Newton's method still uses the exact balances.

use super::uses::{COMPUTE, Moment, pass, present};
use crate::gpu::pass::{Barrier, COMPUTE_READ, COMPUTE_WRITE, Entry, NetworkNodes, Scope, barrier};
use crate::gpu::resource::Resource;
use crate::gpu::wide_variant::{WideKind, WideVariant};

/// A system of balances to solve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solve {
    pub radiative: bool,
    pub tails: bool,
    /// Unknowns, and the number of groups that have any.
    pub nodes: (NetworkNodes, u32),
    /// Recorded iterations of Newton's method, and of conjugate gradients for each of them.
    pub iterations: [u32; 2],
}

/// Modes of `SCALARS` and `UPDATE` in glsl/network_solve.comp.
pub(super) const GRADIENTS: u32 = 0;
const NEWTON: u32 = 1;
const NEWTON_LAST: u32 = 2;
const LINEAR_LAST: u32 = 3;
const FIRST_UPDATE: u32 = 1;

impl Solve {
    /// Newton's method. `kind` is the pass that computes the right-hand side.
    pub fn newton(&self, kind: WideKind, moment: Moment) -> Vec<Entry> {
        let mut entries = Vec::new();
        for number in 0..self.iterations[0] {
            self.gradients(&mut entries, kind, moment);
            entries.push(again([
                (Resource::SolverSolution, COMPUTE_READ),
                (present(moment.odd), COMPUTE),
                (Resource::SolverPartials, COMPUTE_WRITE),
            ]));
            entries.push(self.pass(WideKind::Move, moment, 0));
            entries.push(again([(Resource::SolverPartials, COMPUTE_READ), (Resource::SolverScalars, COMPUTE)]));
            let last = number + 1 == self.iterations[0];
            entries.push(self.pass(WideKind::Scalars, moment, if last { NEWTON_LAST } else { NEWTON }));
        }
        entries
    }

    /// Solves the system of the error estimate.
    pub fn linear(&self, moment: Moment) -> Vec<Entry> {
        let mut entries = Vec::new();
        self.gradients(&mut entries, WideKind::Residual, moment);
        entries.push(again([(Resource::SolverScalars, COMPUTE)]));
        entries.push(self.pass(WideKind::Scalars, moment, LINEAR_LAST));
        entries
    }

    /// Right-hand side and conjugate gradients.
    fn gradients(&self, entries: &mut Vec<Entry>, kind: WideKind, moment: Moment) {
        entries.push(again([
            (present(moment.odd), COMPUTE_READ),
            (Resource::SolverConditioned, COMPUTE_WRITE),
            (Resource::SolverDiagonal, COMPUTE_WRITE),
        ]));
        entries.push(self.pass(kind, moment, 0));
        entries.push(again([(Resource::SolverDiagonal, COMPUTE_READ)]));
        for number in 0..self.iterations[1] {
            entries.push(again([
                (Resource::SolverConditioned, COMPUTE),
                (Resource::SolverProduct, COMPUTE_WRITE),
                (Resource::SolverPartials, COMPUTE_WRITE),
            ]));
            entries.push(self.pass(WideKind::Product, moment, 0));
            entries.push(again([(Resource::SolverPartials, COMPUTE_READ), (Resource::SolverScalars, COMPUTE)]));
            entries.push(self.pass(WideKind::Scalars, moment, GRADIENTS));
            entries.push(again([
                (Resource::SolverScalars, COMPUTE_READ),
                (Resource::SolverConditioned, COMPUTE),
                (Resource::SolverProduct, COMPUTE_READ),
                (Resource::SolverDirection, COMPUTE),
                (Resource::SolverProductDirection, COMPUTE),
                (Resource::SolverSolution, COMPUTE),
            ]));
            entries.push(self.pass(WideKind::Update, moment, if number == 0 { FIRST_UPDATE } else { 0 }));
        }
    }

    fn pass(&self, kind: WideKind, moment: Moment, mode: u32) -> Entry {
        pass(WideVariant::of(kind, self.radiative, self.tails), self.nodes, moment, mode)
    }
}

/// Barriers between an earlier compute pass and the given accesses.
fn again<const N: usize>(next: [(Resource, Scope); N]) -> Entry {
    let after = |(resource, scope)| -> Barrier { barrier(resource, COMPUTE_WRITE, scope) };
    Entry::Barriers(next.map(after).to_vec())
}
