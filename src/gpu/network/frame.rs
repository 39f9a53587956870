//! Frame lists of a network: passes over its nodes and the barriers between them.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use super::solve_frame::Solve;
use super::uses::{COMPUTE, Moment, pass, present};
use crate::gpu::frame::Frame;
use crate::gpu::pass::{
    CLEAR_WRITE, COMPUTE_READ, COMPUTE_WRITE, COPY_READ, COPY_WRITE, Entry, NetworkNodes, Scope, barrier, clear_pass,
    copy_pass, scope, to_host,
};
use crate::gpu::resource::Resource;
use crate::gpu::wide_variant::{WideKind, WideVariant};

/// Most sub-steps of a submission.
pub(super) const SUB_STEPS_AT_MOST: u32 = 64;

/// Work of an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WidePlan {
    /// Whether nodes exchange heat by radiation.
    pub radiative: bool,
    /// Whether some nodes have more conductors than a row holds.
    pub tails: bool,
    /// Whether there are arithmetic nodes, all without an arithmetic neighbour.
    pub lone: bool,
    /// Whether arithmetic nodes are coupled to each other.
    pub coupled: bool,
    /// Number of groups.
    pub groups: u32,
    /// Number of groups with an arithmetic node.
    pub arithmetic: u32,
    /// Number of groups with a node that is not a boundary.
    pub free: u32,
    /// Number of sensors.
    pub sensors: u32,
    /// Stages of a sub-step; 0 for TR-BDF2.
    pub stages: u32,
    /// Recorded iterations of Newton's method for a stage, and of conjugate gradients for each of them.
    pub iterations: [u32; 2],
}

/// Accesses of earlier submissions.
const EARLIER: Scope = scope(
    S::from_raw(S::COMPUTE_SHADER.as_raw() | S::COPY.as_raw()),
    A::from_raw(A::SHADER_STORAGE_WRITE.as_raw() | A::TRANSFER_WRITE.as_raw()),
);

/// Accesses of earlier submissions and of a clear.
const CLEARED: Scope = scope(
    S::from_raw(S::COMPUTE_SHADER.as_raw() | S::COPY.as_raw() | S::CLEAR.as_raw()),
    A::from_raw(A::SHADER_STORAGE_WRITE.as_raw() | A::TRANSFER_WRITE.as_raw()),
);

/// Number of times that the arithmetic nodes are balanced at the start, each time from the last result.
const BALANCES: u32 = 6;
/// Number of the stage for passes at the start of a sub-step.
pub const AT_START: u32 = u32::MAX;

impl WidePlan {
    /// Copies the accepted state and balances the arithmetic nodes.
    fn copied(&self) -> Vec<Entry> {
        let mut before = vec![
            barrier(Resource::NetworkKept, EARLIER, COPY_READ),
            barrier(Resource::NetworkEven, EARLIER, COPY_WRITE),
            barrier(Resource::NetworkErrors, COMPUTE_WRITE, CLEAR_WRITE),
        ];
        let mut after = vec![barrier(Resource::NetworkEven, COPY_WRITE, COMPUTE)];
        let mut passes = vec![
            Entry::Pass(copy_pass("try", Resource::NetworkKept, Resource::NetworkEven)),
            Entry::Pass(clear_pass("clear errors", Resource::NetworkErrors)),
        ];
        if self.solves() {
            // The products need 0 for a node that is not an unknown.
            for resource in [Resource::SolverScalars, Resource::SolverConditioned] {
                before.push(barrier(resource, CLEARED, CLEAR_WRITE));
                passes.push(Entry::Pass(clear_pass("clear solver", resource)));
                after.push(barrier(resource, CLEAR_WRITE, COMPUTE));
            }
        }
        let mut entries = vec![Entry::Barriers(before)];
        entries.extend(passes);
        entries.push(Entry::Barriers(after));
        let moment = Moment { stage: AT_START, sub_step: 0, odd: false };
        if self.lone {
            for _ in 0..BALANCES {
                entries.push(self.pass(WideKind::Lone, NetworkNodes::Arithmetic, moment));
                entries.push(Entry::Barriers(vec![barrier(Resource::NetworkEven, COMPUTE_WRITE, COMPUTE)]));
            }
        }
        if self.coupled {
            entries.extend(self.solve(NetworkNodes::Arithmetic).newton(WideKind::Balance, moment));
            entries.push(Entry::Barriers(vec![barrier(Resource::NetworkEven, COMPUTE_WRITE, COMPUTE)]));
        }
        entries
    }

    /// Whether an attempt solves a linear system.
    fn solves(&self) -> bool {
        self.coupled || self.stages == 0
    }

    pub(super) fn solve(&self, nodes: NetworkNodes) -> Solve {
        let nodes = (nodes, self.count(nodes));
        Solve { radiative: self.radiative, tails: self.tails, nodes, iterations: self.iterations }
    }

    /// Number of groups or sensors of a pass.
    fn count(&self, nodes: NetworkNodes) -> u32 {
        match nodes {
            NetworkNodes::All => self.groups,
            NetworkNodes::Sensors => self.sensors,
            NetworkNodes::Arithmetic => self.arithmetic,
            NetworkNodes::Free => self.free,
        }
    }

    /// Starts an attempt from the accepted state: copies it, balances the arithmetic nodes and computes the rates.
    pub fn start(&self) -> Frame {
        let mut entries = self.copied();
        if self.stages > 0 {
            entries.push(Entry::Barriers(vec![barrier(Resource::NetworkRates, COMPUTE_WRITE, COMPUTE_WRITE)]));
            let moment = Moment { stage: AT_START, sub_step: 0, odd: false };
            entries.push(self.pass(WideKind::Begin, NetworkNodes::All, moment));
        }
        Frame { entries }
    }

    /// One sub-step. The state is in `NetworkOdd` if `odd`. The second result is `odd` for the new state.
    pub fn sub_step(&self, number: u32, odd: bool) -> (Frame, bool) {
        if self.stages == 0 { self.implicit_sub_step(number, odd) } else { self.explicit_sub_step(number, odd) }
    }

    fn explicit_sub_step(&self, number: u32, odd: bool) -> (Frame, bool) {
        let mut odd = odd;
        let mut entries = vec![
            Entry::Barriers(vec![
                barrier(Resource::NetworkRates, COMPUTE_WRITE, COMPUTE),
                barrier(Resource::NetworkStart, COMPUTE_WRITE, COMPUTE_WRITE),
                barrier(present(!odd), EARLIER, COMPUTE_WRITE),
            ]),
            self.pass(WideKind::First, NetworkNodes::All, Moment { stage: 0, sub_step: number, odd }),
        ];
        odd = !odd;
        for stage in 1..=self.stages {
            let last = stage == self.stages;
            let moment = |stage| Moment { stage, sub_step: number, odd };
            // The last stage balances the arithmetic nodes twice, because a large change leaves a rounding error.
            for _ in 0..if self.lone { 1 + u32::from(last) } else { 0 } {
                entries.push(Entry::Barriers(vec![barrier(present(odd), COMPUTE_WRITE, COMPUTE)]));
                entries.push(self.pass(WideKind::Lone, NetworkNodes::Arithmetic, moment(stage - 1)));
            }
            if self.coupled {
                entries.extend(self.solve(NetworkNodes::Arithmetic).newton(WideKind::Balance, moment(stage - 1)));
            }
            let mut barriers = vec![barrier(present(odd), COMPUTE_WRITE, COMPUTE_READ)];
            if stage == 1 {
                barriers.push(barrier(Resource::NetworkStart, COMPUTE_WRITE, COMPUTE_READ));
            }
            if last {
                barriers.push(barrier(Resource::NetworkRates, COMPUTE_WRITE, COMPUTE_WRITE));
                barriers.push(barrier(Resource::NetworkErrors, CLEARED, COMPUTE));
                entries.push(Entry::Barriers(barriers));
                entries.push(self.pass(WideKind::Last, NetworkNodes::All, moment(stage - 1)));
            } else {
                barriers.push(barrier(present(!odd), COMPUTE_WRITE, COMPUTE_WRITE));
                entries.push(Entry::Barriers(barriers));
                entries.push(self.pass(WideKind::Stage, NetworkNodes::All, moment(stage)));
                odd = !odd;
            }
        }
        self.sense(&mut entries, number, odd);
        (Frame { entries }, odd)
    }

    fn implicit_sub_step(&self, number: u32, odd: bool) -> (Frame, bool) {
        let moment = |stage, odd| Moment { stage, sub_step: number, odd };
        let written = |resource| barrier(resource, COMPUTE_WRITE, COMPUTE);
        let mut entries = vec![
            Entry::Barriers(vec![
                written(present(odd)),
                written(Resource::NetworkRates),
                written(Resource::NetworkStart),
                barrier(present(!odd), EARLIER, COMPUTE_WRITE),
            ]),
            self.pass(WideKind::Start, NetworkNodes::All, moment(0, odd)),
        ];
        // From here on the sub-step changes the copy, and the start state stays.
        let odd = !odd;
        let solve = self.solve(NetworkNodes::Free);
        let stage = |entries: &mut Vec<Entry>, number| {
            entries.push(Entry::Barriers(vec![written(Resource::NetworkRates), written(Resource::NetworkStart)]));
            entries.extend(solve.newton(WideKind::Residual, moment(number, odd)));
        };
        stage(&mut entries, 0);
        entries.push(Entry::Barriers(vec![written(present(odd)), written(Resource::NetworkStart)]));
        entries.push(self.pass(WideKind::Middle, NetworkNodes::Free, moment(0, odd)));
        stage(&mut entries, 1);
        entries.extend(solve.linear(moment(2, odd)));
        entries.push(Entry::Barriers(vec![
            written(Resource::SolverSolution),
            barrier(Resource::NetworkErrors, CLEARED, COMPUTE),
        ]));
        entries.push(self.pass(WideKind::Estimate, NetworkNodes::Free, moment(2, odd)));
        self.sense(&mut entries, number, odd);
        (Frame { entries }, odd)
    }

    fn sense(&self, entries: &mut Vec<Entry>, sub_step: u32, odd: bool) {
        if self.sensors > 0 {
            entries.push(Entry::Barriers(vec![barrier(Resource::NetworkSensed, COMPUTE_WRITE, COMPUTE_WRITE)]));
            entries.push(self.pass(WideKind::Sense, NetworkNodes::Sensors, Moment { stage: 0, sub_step, odd }));
        }
    }

    /// Starts the search for a common balance of all nodes from the accepted state.
    pub fn balance_start(&self) -> Frame {
        let whole = Self { lone: false, coupled: false, stages: 0, ..*self };
        Frame { entries: whole.copied() }
    }

    /// Continues the search from its present state.
    pub fn clear_solver(&self) -> Frame {
        Frame {
            entries: vec![
                Entry::Barriers(vec![barrier(Resource::SolverScalars, COMPUTE_WRITE, CLEAR_WRITE)]),
                Entry::Pass(clear_pass("clear solver", Resource::SolverScalars)),
                Entry::Barriers(vec![barrier(Resource::SolverScalars, CLEAR_WRITE, COMPUTE)]),
            ],
        }
    }

    /// Iterations of the search.
    pub fn balance(&self, nodes: NetworkNodes) -> Frame {
        let moment = Moment { stage: AT_START, sub_step: 0, odd: false };
        Frame { entries: self.solve(nodes).newton(WideKind::Balance, moment) }
    }

    /// Makes the results visible to the host.
    pub fn end(&self) -> Frame {
        let to_host = |resource| barrier(resource, COMPUTE_WRITE, scope(S::HOST, A::HOST_READ));
        let mut barriers = vec![to_host(Resource::NetworkErrors)];
        if self.sensors > 0 {
            barriers.push(to_host(Resource::NetworkSensed));
        }
        if self.solves() {
            barriers.push(to_host(Resource::SolverScalars));
        }
        Frame { entries: vec![Entry::Barriers(barriers)] }
    }

    /// Accepts the state of an attempt.
    pub fn keep(odd: bool) -> Frame {
        Frame {
            entries: vec![
                Entry::Barriers(vec![
                    barrier(present(odd), EARLIER, COPY_READ),
                    barrier(Resource::NetworkKept, EARLIER, COPY_WRITE),
                ]),
                Entry::Pass(copy_pass("keep", present(odd), Resource::NetworkKept)),
                Entry::Barriers(vec![to_host(Resource::NetworkKept)]),
            ],
        }
    }

    fn pass(&self, kind: WideKind, nodes: NetworkNodes, moment: Moment) -> Entry {
        pass(WideVariant::of(kind, self.radiative, self.tails), (nodes, self.count(nodes)), moment, 0)
    }
}
