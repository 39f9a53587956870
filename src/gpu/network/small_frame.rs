//! Frame list of a small network: a dispatch, and barriers for the next dispatch and the host.

use crate::gpu::frame::Frame;
use crate::gpu::lists::{HOST_AND_COMPUTE, dispatch};
use crate::gpu::pass::{COMPUTE_WRITE, Entry, Kernel, barrier};
use crate::gpu::resource::Resource;
use crate::gpu::variant::FusedVariant;

/// Unknowns of a system of equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Unknowns {
    /// Coupled arithmetic nodes.
    Arithmetic,
    /// All nodes that are not a boundary.
    Free,
}

impl Unknowns {
    /// Buffers of the elimination order and the matrix.
    pub(super) fn resources(self) -> [Resource; 2] {
        match self {
            Self::Arithmetic => [Resource::BalanceSchedule, Resource::BalanceMatrix],
            Self::Free => [Resource::StepSchedule, Resource::StepMatrix],
        }
    }
}

/// Buffer of the state that a dispatch changes.
pub(super) fn state(odd: bool) -> Resource {
    if odd { Resource::SmallOdd } else { Resource::SmallEven }
}

/// One dispatch. An attempt submits it as often as it needs.
pub fn dispatched(variant: FusedVariant, unknowns: Unknowns, odd: bool) -> Frame {
    let [schedule, matrix] = unknowns.resources();
    let bound = [
        (0, Resource::SmallAttempt, true, false),
        (1, Resource::SmallNodes, true, false),
        (2, Resource::SmallLinks, true, false),
        (3, Resource::SmallHeat, true, false),
        (4, Resource::SmallStages, true, false),
        (5, Resource::SmallLists, true, false),
        (6, state(odd), true, true),
        (7, Resource::SmallWork, true, true),
        (8, Resource::SmallResult, true, true),
        (9, schedule, true, false),
        (10, matrix, true, true),
    ];
    let set = 2 * unknowns as u32 + u32::from(odd);
    let written = [state(odd), Resource::SmallWork, Resource::SmallResult, matrix];
    Frame {
        entries: vec![
            dispatch(variant.shader().name(), Kernel::Fused(variant), 1, set, &bound),
            Entry::Barriers(written.map(|one| barrier(one, COMPUTE_WRITE, HOST_AND_COMPUTE)).to_vec()),
        ],
    }
}
