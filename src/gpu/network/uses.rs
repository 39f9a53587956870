//! Bindings of each pass over a network, as numbered in glsl/network_wide.comp and glsl/network_solve.comp.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use crate::gpu::pass::{
    Access, COMPUTE_READ, COMPUTE_WRITE, Entry, Kernel, NetworkNodes, NetworkWork, Pass, Said, Scope, Work, access,
    scope,
};
use crate::gpu::resource::Resource;
use crate::gpu::wide_variant::{WideKind, WideVariant};

/// Invocations of a workgroup.
pub(super) const WORKGROUP: usize = 64;

/// Resource of a binding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// State of the present stage.
    Present,
    /// State of the next stage.
    Next,
    /// A fixed resource.
    Of(Resource),
    /// List of groups of nodes, or of sensors.
    List,
}

/// A binding of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Use {
    /// Number of the binding.
    pub binding: u32,
    /// Resource.
    pub target: Target,
    /// Whether the pass reads it.
    pub reads: bool,
    /// Whether the pass writes it.
    pub writes: bool,
}

/// Tables of a network, in order of binding.
const TABLES: [Resource; 8] = [
    Resource::NetworkRows,
    Resource::NetworkSlices,
    Resource::NetworkNeighbours,
    Resource::NetworkConductances,
    Resource::NetworkRadiators,
    Resource::NetworkTails,
    Resource::NetworkLinks,
    Resource::NetworkHeat,
];

/// The bindings of a pass.
pub fn uses(variant: WideVariant) -> Vec<Use> {
    use Resource as R;
    let read = |binding, target| Use { binding, target, reads: true, writes: false };
    let write = |binding, target| Use { binding, target, reads: false, writes: true };
    let both = |binding, target| Use { binding, target, reads: true, writes: true };
    let of = |how: fn(u32, Target) -> Use, binding, resource| how(binding, Target::Of(resource));
    let (present, gathered) = (read(8, Target::Present), read(9, Target::Present));
    let start = |how: fn(u32, Target) -> Use| how(11, Target::Of(R::NetworkStart));
    let rates = |how: fn(u32, Target) -> Use| how(12, Target::Of(R::NetworkRates));
    let listed = read(13, Target::List);
    let right_side = [of(write, 18, R::SolverConditioned), of(write, 25, R::SolverDiagonal)];
    let mut uses = Vec::new();
    if variant.kind.evaluates() {
        // Some tables exist only for networks with radiation or with tails.
        let wanted = |(_, table): &(u32, R)| match table {
            R::NetworkRadiators => variant.radiative,
            R::NetworkTails | R::NetworkLinks => variant.tails,
            _ => true,
        };
        uses.extend((0..).zip(TABLES).filter(wanted).map(|(binding, table)| of(read, binding, table)));
    }
    match variant.kind {
        WideKind::Begin => uses.extend([present, gathered, rates(write)]),
        WideKind::First => uses.extend([present, write(10, Target::Next), start(write), rates(read)]),
        WideKind::Stage => uses.extend([present, gathered, both(10, Target::Next), start(read), rates(read)]),
        WideKind::Lone => {
            uses.extend([both(8, Target::Present), gathered, listed]);
        }
        WideKind::Last => {
            uses.extend([present, gathered, start(read), rates(both), of(both, 15, R::NetworkErrors)]);
        }
        WideKind::Sense => uses.extend([gathered, listed, of(write, 16, R::NetworkSensed)]),
        WideKind::Start => uses.extend([present, gathered, write(10, Target::Next), start(write), rates(write)]),
        WideKind::Balance => {
            uses.extend([present, gathered, listed]);
            uses.extend(right_side);
        }
        WideKind::Residual => {
            uses.extend([present, gathered, read(10, Target::Next), start(read), rates(read), listed]);
            uses.extend(right_side);
        }
        WideKind::Product => {
            uses.extend([
                listed,
                of(read, 18, R::SolverConditioned),
                of(read, 19, R::SolverConditioned),
                of(write, 24, R::SolverProduct),
                of(read, 25, R::SolverDiagonal),
                of(write, 27, R::SolverPartials),
            ]);
            if variant.radiative {
                uses.extend([present, gathered]);
            }
        }
        WideKind::Scalars => uses.extend([of(read, 27, R::SolverPartials), of(both, 28, R::SolverScalars)]),
        WideKind::Update => {
            uses.extend([
                listed,
                of(both, 18, R::SolverConditioned),
                of(both, 21, R::SolverDirection),
                of(both, 22, R::SolverProductDirection),
                of(both, 23, R::SolverSolution),
                of(read, 24, R::SolverProduct),
                of(read, 25, R::SolverDiagonal),
                of(read, 28, R::SolverScalars),
            ]);
        }
        WideKind::Move => {
            uses.extend([
                listed,
                both(8, Target::Present),
                of(read, 23, R::SolverSolution),
                of(write, 27, R::SolverPartials),
                of(read, 28, R::SolverScalars),
            ]);
        }
        WideKind::Middle => {
            uses.extend([listed, present, read(10, Target::Next), start(write)]);
        }
        WideKind::Estimate => {
            uses.extend([
                listed,
                present,
                gathered,
                read(10, Target::Next),
                of(both, 15, R::NetworkErrors),
                of(read, 23, R::SolverSolution),
                of(read, 25, R::SolverDiagonal),
            ]);
        }
    }
    uses
}

/// Read and write access of a compute pass.
pub(super) const COMPUTE: Scope =
    scope(S::COMPUTE_SHADER, A::from_raw(A::SHADER_STORAGE_READ.as_raw() | A::SHADER_STORAGE_WRITE.as_raw()));

/// Place of a pass in its attempt.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moment {
    /// Number of the stage, for its time and weights.
    pub stage: u32,
    pub sub_step: u32,
    /// Whether the present stage is in `NetworkOdd` and the next one in `NetworkEven`.
    pub odd: bool,
}

/// State of the present stage.
pub(super) fn present(odd: bool) -> Resource {
    if odd { Resource::NetworkOdd } else { Resource::NetworkEven }
}

/// List of the nodes of a pass.
pub(super) fn list_of(nodes: NetworkNodes) -> Resource {
    match nodes {
        NetworkNodes::All => Resource::NetworkAll,
        NetworkNodes::Sensors => Resource::NetworkSensors,
        NetworkNodes::Arithmetic => Resource::NetworkArithmetic,
        NetworkNodes::Free => Resource::NetworkFree,
    }
}

/// A pass over `count` groups or sensors, with all its accesses.
pub(super) fn pass(
    variant: WideVariant,
    (nodes, count): (NetworkNodes, u32),
    Moment { stage, sub_step, odd }: Moment,
    mode: u32,
) -> Entry {
    let mut accesses = Vec::new();
    for used in uses(variant) {
        let resource = match used.target {
            Target::List => list_of(nodes),
            Target::Present => present(odd),
            Target::Next => present(!odd),
            Target::Of(resource) => resource,
        };
        let scopes = [(used.reads, COMPUTE_READ), (used.writes, COMPUTE_WRITE)];
        for (_, scope) in scopes.into_iter().filter(|(is, _)| *is) {
            accesses.push(Access { binding: Some(used.binding), ..access(resource, scope) });
        }
    }
    let workgroups = count.div_ceil(WORKGROUP as u32);
    // A solver decision runs in one workgroup and reads the partial sums of all.
    let decides = variant.kind == WideKind::Scalars;
    let (count, workgroups) = if decides { (workgroups, 1) } else { (count, workgroups) };
    let said = Said::Network(NetworkWork { kind: variant.kind, count, stage, sub_step, mode });
    let set = 2 * nodes as u32 + u32::from(odd);
    let work = Work::Dispatch { kernel: Kernel::Wide(variant), workgroups, set, said };
    Entry::Pass(Pass { name: variant.shader().name(), work, accesses })
}
