//! Newton's method with conjugate gradients over nodes of a large network, as passes and the barriers between them.
//!
//! The conjugate gradients are Jacobi-preconditioned, in the form with one reduction an iteration. The host records as many iterations as the last
//! tries took. The device stops what has converged, so more of them change no result; a try that had too few is recorded again. Where nodes radiate to
//! each other, the matrix takes the geometric mean of each two entries: it stays symmetric and positive definite, and the balances stay exact.

use super::frame::{COMPUTE, Place, pass, present};
use crate::gpu::pass::{Barrier, COMPUTE_READ, COMPUTE_WRITE, NetworkNodes, Resource, Scope, Step, barrier};
use crate::gpu::wide_variant::{WideKind, WideVariant};

/// A system of balances.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solve {
    pub radiative: bool,
    pub tails: bool,
    /// The unknowns.
    pub nodes: NetworkNodes,
    /// Recorded iterations of Newton's method, and of conjugate gradients for each.
    pub iterations: [u32; 2],
}

/// What `SCALARS` of glsl/network_solve.comp decides, and what `UPDATE` is.
pub(super) const GRADIENTS: u32 = 0;
const NEWTON: u32 = 1;
const NEWTON_LAST: u32 = 2;
const LINEAR_LAST: u32 = 3;
const FIRST_UPDATE: u32 = 1;

impl Solve {
    /// Moves the unknowns until they stand still; `kind` makes the right side.
    pub fn newton(&self, kind: WideKind, place: Place) -> Vec<Step> {
        let mut steps = Vec::new();
        for number in 0..self.iterations[0] {
            self.gradients(&mut steps, kind, place);
            steps.push(again([
                (Resource::SolverSolution, COMPUTE_READ),
                (present(place.odd), COMPUTE),
                (Resource::SolverPartials, COMPUTE_WRITE),
            ]));
            steps.push(self.pass(WideKind::Move, place, 0));
            steps.push(again([(Resource::SolverPartials, COMPUTE_READ), (Resource::SolverScalars, COMPUTE)]));
            let last = number + 1 == self.iterations[0];
            steps.push(self.pass(WideKind::Scalars, place, if last { NEWTON_LAST } else { NEWTON }));
        }
        steps
    }

    /// Solves the system of the error's estimate.
    pub fn linear(&self, place: Place) -> Vec<Step> {
        let mut steps = Vec::new();
        self.gradients(&mut steps, WideKind::Residual, place);
        steps.push(again([(Resource::SolverScalars, COMPUTE)]));
        steps.push(self.pass(WideKind::Scalars, place, LINEAR_LAST));
        steps
    }

    /// The right side, and conjugate gradients.
    fn gradients(&self, steps: &mut Vec<Step>, kind: WideKind, place: Place) {
        steps.push(again([
            (present(place.odd), COMPUTE_READ),
            (Resource::SolverConditioned, COMPUTE_WRITE),
            (Resource::SolverDiagonal, COMPUTE_WRITE),
        ]));
        steps.push(self.pass(kind, place, 0));
        steps.push(again([(Resource::SolverDiagonal, COMPUTE_READ)]));
        for number in 0..self.iterations[1] {
            steps.push(again([
                (Resource::SolverConditioned, COMPUTE),
                (Resource::SolverProduct, COMPUTE_WRITE),
                (Resource::SolverPartials, COMPUTE_WRITE),
            ]));
            steps.push(self.pass(WideKind::Product, place, 0));
            steps.push(again([(Resource::SolverPartials, COMPUTE_READ), (Resource::SolverScalars, COMPUTE)]));
            steps.push(self.pass(WideKind::Scalars, place, GRADIENTS));
            steps.push(again([
                (Resource::SolverScalars, COMPUTE_READ),
                (Resource::SolverConditioned, COMPUTE),
                (Resource::SolverProduct, COMPUTE_READ),
                (Resource::SolverDirection, COMPUTE),
                (Resource::SolverProductDirection, COMPUTE),
                (Resource::SolverSolution, COMPUTE),
            ]));
            steps.push(self.pass(WideKind::Update, place, if number == 0 { FIRST_UPDATE } else { 0 }));
        }
    }

    fn pass(&self, kind: WideKind, place: Place, mode: u32) -> Step {
        pass(WideVariant::of(kind, self.radiative, self.tails), self.nodes, place, mode)
    }
}

/// After an earlier pass, resources are used again.
fn again<const N: usize>(next: [(Resource, Scope); N]) -> Step {
    let after = |(resource, scope)| -> Barrier { barrier(resource, COMPUTE_WRITE, scope) };
    Step::Barriers(next.map(after).to_vec())
}
