//! Memory plan of a network, and its use of the scene's spare buffers.

use super::frame::SUB_STEPS_AT_MOST;
use super::sliced::{SLICE, Sizes};
use super::uses::WORKGROUP;
use crate::gpu::resource::Resource;
use crate::gpu::resource_row::{Count, Role};
use crate::gpu::resources::Planned;
use crate::thermal::network::Network;

/// Alignment of a part of a buffer [bytes]. No device requires a larger `minStorageBufferOffsetAlignment`.
const PIECE: u64 = 256;

/// Vectors of the solver. They are needed only while a network solves a linear system.
pub const SOLVER: [Resource; 6] = [
    Resource::SolverConditioned,
    Resource::SolverDirection,
    Resource::SolverProductDirection,
    Resource::SolverSolution,
    Resource::SolverProduct,
    Resource::SolverDiagonal,
];

/// All buffers of a network.
pub fn plan(sizes: &Sizes, sensors: usize) -> Vec<Planned> {
    let planned = |resource: &Resource| {
        let row = resource.row();
        // An empty table also needs a buffer to bind.
        let bytes = |count| ((row.element * count) as u64).max(16);
        count(sizes, sensors, row.count).map(|count| Planned { resource: *resource, bytes: bytes(count) })
    };
    Resource::ALL.iter().filter_map(planned).collect()
}

/// Number of elements for a `count`; `None` if a network has no such elements.
fn count(sizes: &Sizes, sensors: usize, count: Count) -> Option<usize> {
    Some(match count {
        Count::NetworkGroups => sizes.groups,
        Count::NetworkSlices => sizes.slices + 1,
        Count::NetworkLinear => sizes.entries[0],
        Count::NetworkRadiative => sizes.entries[1],
        Count::NetworkTails if sizes.links > 0 => SLICE * sizes.slices + 1,
        Count::NetworkTails | Count::NetworkAll => 0,
        Count::NetworkLinks => sizes.links,
        Count::NetworkArithmetic => sizes.listed[0],
        Count::NetworkFree => sizes.listed[1],
        Count::NetworkSensors => sensors,
        Count::NetworkSensed => sensors * SUB_STEPS_AT_MOST as usize,
        Count::NetworkWorkgroups => sizes.groups.div_ceil(WORKGROUP),
        Count::NetworkOnce => 1,
        _ => return None,
    })
}

/// Whether the host reads or writes a buffer. Such a buffer counts as host memory.
pub fn is_of_host(resource: Resource) -> bool {
    matches!(resource.row().role, Role::FromHost | Role::ToHost)
}

/// Placement of the solver's vectors, of `vector` bytes each, in spare buffers: number of the buffer and offset
/// [bytes]. It is `None` for a vector that does not fit.
pub fn lodgings(spare: &[u64], vector: u64) -> [Option<(usize, u64)>; SOLVER.len()] {
    let each = vector.next_multiple_of(PIECE);
    let places = |(number, bytes): (usize, &u64)| {
        // The last vector in a buffer needs no padding after it.
        let count = if *bytes < vector { 0 } else { 1 + (bytes - vector) / each };
        (0..count).map(move |place| (number, place * each))
    };
    let mut places = spare.iter().enumerate().flat_map(places);
    SOLVER.map(|_| places.next())
}

/// Memory of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NetworkBytes {
    /// Device memory [bytes], with the solver's vectors, which steady states and stiff networks need.
    pub device: u64,
    /// Host-visible memory [bytes].
    pub host: u64,
}

impl NetworkBytes {
    /// Memory of a network, without solver vectors that fit into `spare` buffers [bytes]. This is an upper bound,
    /// because parallel conductors count separately.
    pub fn of(network: &Network, sensors: usize, spare: &[u64]) -> Self {
        Self::of_plan(&plan(&Sizes::counted(network), sensors), spare)
    }

    fn of_plan(plan: &[Planned], spare: &[u64]) -> Self {
        let of = |host: bool| plan.iter().filter(move |planned| is_of_host(planned.resource) == host);
        let [device, host] = [false, true].map(|host| of(host).map(|planned| planned.bytes).sum::<u64>());
        let vector = plan.iter().find(|planned| planned.resource == SOLVER[0]).map_or(0, |planned| planned.bytes);
        let lodged = lodgings(spare, vector).iter().flatten().count() as u64;
        Self { device: device - vector * lodged, host }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_lie_in_whole_pieces_and_not_in_each_other() {
        // Three of 1000 bytes begin at 0, 1024 and 2048 of 3048; 999 hold none.
        let found = lodgings(&[3048, 999, 1000], 1000);
        assert_eq!(found, [Some((0, 0)), Some((0, 1024)), Some((0, 2048)), Some((2, 0)), None, None]);
        assert_eq!(lodgings(&[3047], 1000)[2], None);
        assert_eq!(lodgings(&[], 1000), [None; 6]);
    }

    /// Compares the bytes of one slice with a sum by hand: 16 nodes of a ring, each with two neighbours.
    #[test]
    fn a_ring_by_hand() {
        let sizes = Sizes { groups: 4, slices: 1, entries: [8, 0], links: 0, listed: [0, 4] };
        let plan = plan(&sizes, 0);
        // Rows, slices, neighbours, conductances, empty tables and lists, free nodes, states, start and rates, a
        // partial sum.
        let expected = 128 + 16 + 128 + 128 + 3 * 16 + 3 * 16 + 16 + 2 * 128 + 2 * 64 + 16;
        assert_eq!(NetworkBytes::of_plan(&plan, &[64 + 5 * 256]).device, expected, "the solver lies elsewhere");
        assert_eq!(NetworkBytes::of_plan(&plan, &[]).device, expected + 6 * 64);
    }
}
