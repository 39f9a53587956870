//! What happens to a large network, as a frame: passes over its nodes, and the barriers between them.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use super::solve_frame::Solve;
use super::uses::{Target, uses};
use crate::gpu::frame::Frame;
use crate::gpu::pass::{
    Access, CLEAR_WRITE, COMPUTE_READ, COMPUTE_WRITE, COPY_READ, COPY_WRITE, NetworkNodes, NetworkWork, Pass, Resource,
    Scope, Step, Work, access, barrier, clear_pass, copy_pass, scope,
};
use crate::gpu::wide_variant::{WideKind, WideVariant};

/// What a try takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WidePlan {
    /// Whether nodes exchange heat by radiation.
    pub radiative: bool,
    /// Whether some nodes have more conductors than a row holds.
    pub tails: bool,
    /// Whether there are arithmetic nodes, none coupled to another.
    pub lone: bool,
    /// Whether there are arithmetic nodes that are coupled.
    pub coupled: bool,
    /// Whether there are sensors.
    pub sensors: bool,
    /// Stages of a sub-step; 0 of TR-BDF2.
    pub stages: u32,
    /// Iterations that are recorded of Newton's method for a stage, and of conjugate gradients for each of these.
    pub iterations: [u32; 2],
}

/// A compute pass reads and writes.
pub(super) const COMPUTE: Scope =
    scope(S::COMPUTE_SHADER, A::from_raw(A::SHADER_STORAGE_READ.as_raw() | A::SHADER_STORAGE_WRITE.as_raw()));

/// Whatever a pass or a copy of an earlier submission did.
const EARLIER: Scope = scope(
    S::from_raw(S::COMPUTE_SHADER.as_raw() | S::COPY.as_raw()),
    A::from_raw(A::SHADER_STORAGE_WRITE.as_raw() | A::TRANSFER_WRITE.as_raw()),
);

/// The same and a clear.
const CLEARED: Scope = scope(
    S::from_raw(S::COMPUTE_SHADER.as_raw() | S::COPY.as_raw() | S::CLEAR.as_raw()),
    A::from_raw(A::SHADER_STORAGE_WRITE.as_raw() | A::TRANSFER_WRITE.as_raw()),
);

/// Times that the arithmetic nodes are balanced at the start, each time from where the last one left them.
const BALANCES: u32 = 6;
/// In place of a stage: at the start of the sub-step, where the first stage's rates are found.
pub const AT_START: u32 = u32::MAX;

/// Where the present stage is.
pub(super) fn present(odd: bool) -> Resource {
    if odd { Resource::NetworkOdd } else { Resource::NetworkEven }
}

/// Where a pass belongs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Stage whose time and weights it has.
    pub stage: u32,
    pub sub_step: u32,
    /// Whether the present stage is in `NetworkOdd`.
    pub odd: bool,
}

impl WidePlan {
    /// Starts a try from the kept state: copies it, and balances arithmetic nodes.
    fn copied(&self) -> Vec<Step> {
        let mut before = vec![
            barrier(Resource::NetworkKept, EARLIER, COPY_READ),
            barrier(Resource::NetworkEven, EARLIER, COPY_WRITE),
            barrier(Resource::NetworkErrors, COMPUTE_WRITE, CLEAR_WRITE),
        ];
        let mut after = vec![barrier(Resource::NetworkEven, COPY_WRITE, COMPUTE)];
        let mut passes = vec![
            Step::Pass(copy_pass("try", Resource::NetworkKept, Resource::NetworkEven)),
            Step::Pass(clear_pass("clear errors", Resource::NetworkErrors)),
        ];
        if self.solves() {
            // What is no unknown is 0 in the products.
            for resource in [Resource::SolverScalars, Resource::SolverConditioned] {
                before.push(barrier(resource, CLEARED, CLEAR_WRITE));
                passes.push(Step::Pass(clear_pass("clear solver", resource)));
                after.push(barrier(resource, CLEAR_WRITE, COMPUTE));
            }
        }
        let mut steps = vec![Step::Barriers(before)];
        steps.extend(passes);
        steps.push(Step::Barriers(after));
        let place = Place { stage: AT_START, sub_step: 0, odd: false };
        if self.lone {
            for _ in 0..BALANCES {
                steps.push(self.pass(WideKind::Lone, NetworkNodes::Lone, place));
                steps.push(Step::Barriers(vec![barrier(Resource::NetworkEven, COMPUTE_WRITE, COMPUTE)]));
            }
        }
        if self.coupled {
            steps.extend(self.solve(NetworkNodes::Arithmetic).newton(WideKind::Balance, place));
            steps.push(Step::Barriers(vec![barrier(Resource::NetworkEven, COMPUTE_WRITE, COMPUTE)]));
        }
        steps
    }

    /// Whether any try solves a system.
    fn solves(&self) -> bool {
        self.coupled || self.stages == 0
    }

    pub(super) fn solve(&self, nodes: NetworkNodes) -> Solve {
        Solve { radiative: self.radiative, tails: self.tails, nodes, iterations: self.iterations }
    }

    /// Starts a try from the kept state: copies it, balances arithmetic nodes, and finds the rates.
    pub fn start(&self) -> Frame {
        let mut steps = self.copied();
        if self.stages > 0 {
            steps.push(Step::Barriers(vec![barrier(Resource::NetworkRates, COMPUTE_WRITE, COMPUTE_WRITE)]));
            let place = Place { stage: AT_START, sub_step: 0, odd: false };
            steps.push(self.pass(WideKind::Begin, NetworkNodes::All, place));
        }
        Frame { steps }
    }

    /// One sub-step, from the state in `NetworkOdd` if `odd`. Returns where it leaves it, too.
    pub fn sub_step(&self, number: u32, odd: bool) -> (Frame, bool) {
        if self.stages == 0 { self.implicit_sub_step(number, odd) } else { self.explicit_sub_step(number, odd) }
    }

    fn explicit_sub_step(&self, number: u32, odd: bool) -> (Frame, bool) {
        let mut odd = odd;
        let mut steps = vec![
            Step::Barriers(vec![
                barrier(Resource::NetworkRates, COMPUTE_WRITE, COMPUTE),
                barrier(Resource::NetworkStart, COMPUTE_WRITE, COMPUTE_WRITE),
                barrier(present(!odd), EARLIER, COMPUTE_WRITE),
            ]),
            self.pass(WideKind::First, NetworkNodes::All, Place { stage: 0, sub_step: number, odd }),
        ];
        odd = !odd;
        for stage in 1..=self.stages {
            let last = stage == self.stages;
            let place = |stage| Place { stage, sub_step: number, odd };
            // What a sub-step leaves is seen again from where it came to: a large change leaves its rounding.
            for _ in 0..if self.lone { 1 + u32::from(last) } else { 0 } {
                steps.push(Step::Barriers(vec![barrier(present(odd), COMPUTE_WRITE, COMPUTE)]));
                steps.push(self.pass(WideKind::Lone, NetworkNodes::Lone, place(stage - 1)));
            }
            if self.coupled {
                steps.extend(self.solve(NetworkNodes::Arithmetic).newton(WideKind::Balance, place(stage - 1)));
            }
            let mut barriers = vec![barrier(present(odd), COMPUTE_WRITE, COMPUTE_READ)];
            if stage == 1 {
                barriers.push(barrier(Resource::NetworkStart, COMPUTE_WRITE, COMPUTE_READ));
            }
            if last {
                barriers.push(barrier(Resource::NetworkRates, COMPUTE_WRITE, COMPUTE_WRITE));
                barriers.push(barrier(Resource::NetworkErrors, CLEARED, COMPUTE));
                steps.push(Step::Barriers(barriers));
                steps.push(self.pass(WideKind::Last, NetworkNodes::All, place(stage - 1)));
            } else {
                barriers.push(barrier(present(!odd), COMPUTE_WRITE, COMPUTE_WRITE));
                steps.push(Step::Barriers(barriers));
                steps.push(self.pass(WideKind::Stage, NetworkNodes::All, place(stage)));
                odd = !odd;
            }
        }
        self.sense(&mut steps, number, odd);
        (Frame { steps }, odd)
    }

    fn implicit_sub_step(&self, number: u32, odd: bool) -> (Frame, bool) {
        let place = |stage, odd| Place { stage, sub_step: number, odd };
        let written = |resource| barrier(resource, COMPUTE_WRITE, COMPUTE);
        let mut steps = vec![
            Step::Barriers(vec![
                written(present(odd)),
                written(Resource::NetworkRates),
                written(Resource::NetworkStart),
                barrier(present(!odd), EARLIER, COMPUTE_WRITE),
            ]),
            self.pass(WideKind::Start, NetworkNodes::All, place(0, odd)),
        ];
        // From here on the state moves where the copy is, and the start stays where it was.
        let odd = !odd;
        let solve = self.solve(NetworkNodes::Free);
        let stage = |steps: &mut Vec<Step>, number| {
            steps.push(Step::Barriers(vec![written(Resource::NetworkRates), written(Resource::NetworkStart)]));
            steps.extend(solve.newton(WideKind::Residual, place(number, odd)));
        };
        stage(&mut steps, 0);
        steps.push(Step::Barriers(vec![written(present(odd)), written(Resource::NetworkStart)]));
        steps.push(self.pass(WideKind::Middle, NetworkNodes::Free, place(0, odd)));
        stage(&mut steps, 1);
        steps.extend(solve.linear(place(2, odd)));
        steps.push(Step::Barriers(vec![
            written(Resource::SolverSolution),
            barrier(Resource::NetworkErrors, CLEARED, COMPUTE),
        ]));
        steps.push(self.pass(WideKind::Estimate, NetworkNodes::Free, place(2, odd)));
        self.sense(&mut steps, number, odd);
        (Frame { steps }, odd)
    }

    fn sense(&self, steps: &mut Vec<Step>, sub_step: u32, odd: bool) {
        if self.sensors {
            steps.push(Step::Barriers(vec![barrier(Resource::NetworkSensed, COMPUTE_WRITE, COMPUTE_WRITE)]));
            steps.push(self.pass(WideKind::Sense, NetworkNodes::Sensors, Place { stage: 0, sub_step, odd }));
        }
    }

    /// Starts the search for a balance of nodes together from the kept state.
    pub fn balance_start(&self) -> Frame {
        let whole = Self { lone: false, coupled: false, stages: 0, ..*self };
        Frame { steps: whole.copied() }
    }

    /// Goes on with that search where it stands.
    pub fn clear_solver(&self) -> Frame {
        Frame {
            steps: vec![
                Step::Barriers(vec![barrier(Resource::SolverScalars, COMPUTE_WRITE, CLEAR_WRITE)]),
                Step::Pass(clear_pass("clear solver", Resource::SolverScalars)),
                Step::Barriers(vec![barrier(Resource::SolverScalars, CLEAR_WRITE, COMPUTE)]),
            ],
        }
    }

    /// Some iterations of that search.
    pub fn balance(&self, nodes: NetworkNodes) -> Frame {
        let place = Place { stage: AT_START, sub_step: 0, odd: false };
        Frame { steps: self.solve(nodes).newton(WideKind::Balance, place) }
    }

    /// Shows the host what a submission found.
    pub fn end(&self) -> Frame {
        let to_host = |resource| barrier(resource, COMPUTE_WRITE, scope(S::HOST, A::HOST_READ));
        let mut barriers = vec![to_host(Resource::NetworkErrors)];
        if self.sensors {
            barriers.push(to_host(Resource::NetworkSensed));
        }
        if self.solves() {
            barriers.push(to_host(Resource::SolverScalars));
        }
        Frame { steps: vec![Step::Barriers(barriers)] }
    }

    /// Keeps the state that a try left.
    pub fn keep(odd: bool) -> Frame {
        Frame {
            steps: vec![
                Step::Barriers(vec![
                    barrier(present(odd), EARLIER, COPY_READ),
                    barrier(Resource::NetworkKept, EARLIER, COPY_WRITE),
                ]),
                Step::Pass(copy_pass("keep", present(odd), Resource::NetworkKept)),
                Step::Barriers(vec![barrier(Resource::NetworkKept, COPY_WRITE, scope(S::HOST, A::HOST_READ))]),
            ],
        }
    }

    fn pass(&self, kind: WideKind, nodes: NetworkNodes, place: Place) -> Step {
        pass(WideVariant::of(kind, self.radiative, self.tails), nodes, place, 0)
    }
}

/// A pass with everything that it touches.
pub(super) fn pass(variant: WideVariant, nodes: NetworkNodes, place: Place, mode: u32) -> Step {
    let mut accesses = Vec::new();
    for used in uses(variant) {
        let resource = match used.target {
            Target::Table | Target::List => continue,
            Target::Present => present(place.odd),
            Target::Next => present(!place.odd),
            Target::Of(resource) => resource,
        };
        let scopes = [(used.reads, COMPUTE_READ), (used.writes, COMPUTE_WRITE)];
        for (_, scope) in scopes.into_iter().filter(|(is, _)| *is) {
            accesses.push(Access { binding: Some(used.binding), ..access(resource, scope) });
        }
    }
    let Place { stage, sub_step, odd } = place;
    let work = Work::Network(NetworkWork { variant, nodes, stage, sub_step, odd, mode });
    Step::Pass(Pass { name: variant.shader().name(), work, accesses })
}
