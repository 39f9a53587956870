//! What happens to a large network, as a frame: passes over its nodes, and the barriers between them.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use crate::gpu::frame::Frame;
use crate::gpu::pass::{
    Access, Barrier, CLEAR_WRITE, COMPUTE_READ, COMPUTE_WRITE, COPY_READ, COPY_WRITE, NetworkWork, Pass, Resource,
    Scope, Step, Work, access, barrier, clear_pass, copy_pass, scope,
};
use crate::gpu::variant::{WideKind, WideVariant};

/// What a try takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WidePlan {
    /// Whether nodes exchange heat by radiation.
    pub radiative: bool,
    /// Whether there are arithmetic nodes.
    pub lone: bool,
    /// Whether there are sensors.
    pub sensors: bool,
    /// Stages of a sub-step.
    pub stages: u32,
}

/// A compute pass reads and writes.
const COMPUTE: Scope =
    scope(S::COMPUTE_SHADER, A::from_raw(A::SHADER_STORAGE_READ.as_raw() | A::SHADER_STORAGE_WRITE.as_raw()));

/// Whatever a pass or a copy of an earlier submission did.
const EARLIER: Scope = scope(
    S::from_raw(S::COMPUTE_SHADER.as_raw() | S::COPY.as_raw()),
    A::from_raw(A::SHADER_STORAGE_WRITE.as_raw() | A::TRANSFER_WRITE.as_raw()),
);

/// Times that the arithmetic nodes are balanced at the start, each time from where the last one left them.
const BALANCES: u32 = 6;
/// In place of a stage: at the start of the sub-step, where the first stage's rates are found.
pub const AT_START: u32 = u32::MAX;

impl WidePlan {
    /// Starts a try from the kept state: copies it, balances arithmetic nodes, and finds the rates.
    pub fn start(&self) -> Frame {
        let mut steps = vec![
            Step::Barriers(vec![
                barrier(Resource::NetworkKeptBase, EARLIER, COPY_READ),
                barrier(Resource::NetworkKeptRest, EARLIER, COPY_READ),
                barrier(Resource::NetworkBase, EARLIER, COPY_WRITE),
                barrier(Resource::NetworkRestEven, EARLIER, COPY_WRITE),
                barrier(Resource::NetworkErrors, COMPUTE_WRITE, CLEAR_WRITE),
            ]),
            Step::Pass(copy_pass("try base", Resource::NetworkKeptBase, Resource::NetworkBase)),
            Step::Pass(copy_pass("try rest", Resource::NetworkKeptRest, Resource::NetworkRestEven)),
            Step::Pass(clear_pass("clear errors", Resource::NetworkErrors)),
            Step::Barriers(vec![
                barrier(Resource::NetworkBase, COPY_WRITE, COMPUTE_READ),
                barrier(Resource::NetworkRestEven, COPY_WRITE, COMPUTE),
                barrier(Resource::NetworkErrors, CLEAR_WRITE, COMPUTE),
                barrier(Resource::NetworkWork, COMPUTE_WRITE, COMPUTE_WRITE),
            ]),
        ];
        if self.lone {
            for _ in 0..BALANCES {
                steps.push(self.pass(WideKind::Lone, AT_START, 0, false));
                steps.push(Step::Barriers(vec![barrier(Resource::NetworkRestEven, COMPUTE_WRITE, COMPUTE)]));
            }
        }
        steps.push(self.pass(WideKind::Begin, AT_START, 0, false));
        Frame { steps }
    }

    /// One sub-step, from rests in `NetworkRestOdd` if `odd`. Returns where it leaves them, too.
    pub fn sub_step(&self, number: u32, odd: bool) -> (Frame, bool) {
        let mut odd = odd;
        let next = |odd: bool| if odd { Resource::NetworkRestEven } else { Resource::NetworkRestOdd };
        let written = |resource| barrier(resource, COMPUTE_WRITE, COMPUTE_READ);
        let mut steps = vec![
            Step::Barriers(vec![
                barrier(Resource::NetworkWork, COMPUTE_WRITE, COMPUTE),
                barrier(Resource::NetworkBase, EARLIER, COMPUTE),
                barrier(next(odd), EARLIER, COMPUTE_WRITE),
            ]),
            self.pass(WideKind::First, 0, number, odd),
        ];
        // The bases stay as they are from here on.
        steps.push(Step::Barriers(vec![written(Resource::NetworkBase)]));
        odd = !odd;
        for stage in 1..=self.stages {
            let last = stage == self.stages;
            if self.lone {
                steps.push(Step::Barriers(vec![barrier(next(!odd), COMPUTE_WRITE, COMPUTE)]));
                steps.push(self.pass(WideKind::Lone, stage - 1, number, odd));
            }
            let mut barriers = vec![written(next(!odd)), barrier(Resource::NetworkWork, COMPUTE_WRITE, COMPUTE)];
            if !last {
                barriers.push(barrier(next(odd), COMPUTE_WRITE, COMPUTE_WRITE));
            }
            steps.push(Step::Barriers(barriers));
            if last {
                steps.push(self.pass(WideKind::Last, stage - 1, number, odd));
            } else {
                steps.push(self.pass(WideKind::Stage, stage, number, odd));
                odd = !odd;
            }
        }
        steps.push(Step::Barriers(vec![
            barrier(Resource::NetworkWork, COMPUTE_WRITE, COMPUTE_READ),
            barrier(Resource::NetworkErrors, COMPUTE_WRITE, COMPUTE),
        ]));
        steps.push(self.pass(WideKind::Reduce, 0, number, odd));
        if self.sensors {
            steps.push(Step::Barriers(vec![barrier(Resource::NetworkSensed, COMPUTE_WRITE, COMPUTE_WRITE)]));
            steps.push(self.pass(WideKind::Sense, 0, number, odd));
        }
        (Frame { steps }, odd)
    }

    /// Shows the host what a submission found.
    pub fn end(&self) -> Frame {
        let to_host = |resource| barrier(resource, COMPUTE_WRITE, scope(S::HOST, A::HOST_READ));
        let mut barriers = vec![to_host(Resource::NetworkErrors)];
        if self.sensors {
            barriers.push(to_host(Resource::NetworkSensed));
        }
        Frame { steps: vec![Step::Barriers(barriers)] }
    }

    /// Keeps the state that a try left.
    pub fn keep(odd: bool) -> Frame {
        let rest = if odd { Resource::NetworkRestOdd } else { Resource::NetworkRestEven };
        let copied = |resource: Resource| -> Barrier { barrier(resource, EARLIER, COPY_READ) };
        Frame {
            steps: vec![
                Step::Barriers(vec![
                    copied(Resource::NetworkBase),
                    copied(rest),
                    barrier(Resource::NetworkKeptBase, EARLIER, COPY_WRITE),
                    barrier(Resource::NetworkKeptRest, EARLIER, COPY_WRITE),
                ]),
                Step::Pass(copy_pass("keep base", Resource::NetworkBase, Resource::NetworkKeptBase)),
                Step::Pass(copy_pass("keep rest", rest, Resource::NetworkKeptRest)),
            ],
        }
    }

    fn pass(&self, kind: WideKind, stage: u32, sub_step: u32, odd: bool) -> Step {
        let variant = WideVariant::of(kind, self.radiative);
        let (present, next) = if odd {
            (Resource::NetworkRestOdd, Resource::NetworkRestEven)
        } else {
            (Resource::NetworkRestEven, Resource::NetworkRestOdd)
        };
        let mut accesses = Vec::new();
        let mut bind = |binding: u32, resource: Resource, scopes: &[Scope]| {
            let bound = |scope: &Scope| Access { binding: Some(binding), ..access(resource, *scope) };
            accesses.extend(scopes.iter().map(bound));
        };
        const READ: &[Scope] = &[COMPUTE_READ];
        const WRITE: &[Scope] = &[COMPUTE_WRITE];
        const BOTH: &[Scope] = &[COMPUTE_READ, COMPUTE_WRITE];
        match kind {
            WideKind::Begin => {
                bind(3, Resource::NetworkBase, READ);
                bind(4, present, READ);
                bind(6, Resource::NetworkWork, WRITE);
            }
            WideKind::First => {
                bind(3, Resource::NetworkBase, BOTH);
                bind(4, present, READ);
                bind(5, next, WRITE);
                bind(6, Resource::NetworkWork, BOTH);
            }
            WideKind::Stage => {
                bind(3, Resource::NetworkBase, READ);
                bind(4, present, READ);
                bind(5, next, WRITE);
                bind(6, Resource::NetworkWork, BOTH);
            }
            WideKind::Lone => {
                bind(3, Resource::NetworkBase, READ);
                bind(4, present, BOTH);
            }
            WideKind::Last => {
                bind(3, Resource::NetworkBase, READ);
                bind(4, present, READ);
                bind(6, Resource::NetworkWork, BOTH);
            }
            WideKind::Reduce => {
                bind(6, Resource::NetworkWork, READ);
                bind(8, Resource::NetworkErrors, BOTH);
            }
            WideKind::Sense => {
                bind(3, Resource::NetworkBase, READ);
                bind(4, present, READ);
                bind(9, Resource::NetworkSensed, WRITE);
            }
        }
        let work = Work::Network(NetworkWork { variant, stage, sub_step, odd });
        Step::Pass(Pass { name: variant.name(), work, accesses })
    }
}
