//! What a large network takes on a device, buffer by buffer, and which of it lies where a scene lets it lie.

use super::frame::SUB_STEPS_AT_MOST;
use super::sliced::{SLICE, Sizes};
use super::uses::WORKGROUP;
use crate::gpu::resource::{Count, Resource, Role};
use crate::gpu::resources::Planned;
use crate::thermal::network::Network;

/// Where pieces of a buffer begin: no device asks `minStorageBufferOffsetAlignment` to be more.
const PIECE: u64 = 256;

/// Vectors of the solver, which only a network that solves needs, and only while it does.
pub const SOLVER: [Resource; 6] = [
    Resource::SolverConditioned,
    Resource::SolverDirection,
    Resource::SolverProductDirection,
    Resource::SolverSolution,
    Resource::SolverProduct,
    Resource::SolverDiagonal,
];

/// All buffers of a network of such sizes with so many sensors.
pub fn plan(sizes: &Sizes, sensors: usize) -> Vec<Planned> {
    let planned = |resource: &Resource| {
        let row = resource.row();
        // No buffer is shorter: an empty table still binds.
        let bytes = |count| ((row.element * count) as u64).max(16);
        count(sizes, sensors, row.count).map(|count| Planned { resource: *resource, bytes: bytes(count) })
    };
    Resource::ALL.iter().filter_map(planned).collect()
}

/// How many there are of what `count` counts; `None` of what no large network has.
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

/// Whether the host reads or writes a buffer, so that it is counted as the host's.
pub fn is_of_host(resource: Resource) -> bool {
    matches!(resource.row().role, Role::FromHost | Role::ToHost)
}

/// For every vector of the solver of so many bytes the buffer among `spare` that it lies in, by number, and where.
pub fn lodgings(spare: &[u64], vector: u64) -> [Option<(usize, u64)>; SOLVER.len()] {
    let each = vector.next_multiple_of(PIECE);
    let places = |(number, bytes): (usize, &u64)| {
        // The last one need not end where another could begin.
        let count = if *bytes < vector { 0 } else { 1 + (bytes - vector) / each };
        (0..count).map(move |place| (number, place * each))
    };
    let mut places = spare.iter().enumerate().flat_map(places);
    SOLVER.map(|_| places.next())
}

/// What a large network takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NetworkBytes {
    /// On the device, the vectors of the solver counted, which a steady state and stiff networks need.
    pub device: u64,
    /// Where the host reads and writes.
    pub host: u64,
}

impl NetworkBytes {
    /// Of a network, but for the vectors of the solver that lie in spare buffers of so many bytes. At most so many: parallel
    /// conductors count as several.
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

    /// Bytes by hand of one slice: 16 nodes of a ring, each with two neighbours.
    #[test]
    fn a_ring_by_hand() {
        let sizes = Sizes { groups: 4, slices: 1, entries: [8, 0], links: 0, listed: [0, 4] };
        let plan = plan(&sizes, 0);
        // Rows, slices, neighbours, conductances, empty tables and lists, the free, states, start and rates, a sum.
        let expected = 128 + 16 + 128 + 128 + 3 * 16 + 3 * 16 + 16 + 2 * 128 + 2 * 64 + 16;
        assert_eq!(NetworkBytes::of_plan(&plan, &[64 + 5 * 256]).device, expected, "the solver lies elsewhere");
        assert_eq!(NetworkBytes::of_plan(&plan, &[]).device, expected + 6 * 64);
    }
}
