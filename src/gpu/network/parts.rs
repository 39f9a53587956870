//! What a large network takes on a device, buffer by buffer, and which of it lies where a scene lets it lie.

use super::sliced::{SLICE, Sizes};
use super::wide::{SUB_STEPS_AT_MOST, WORKGROUP};
use crate::gpu::layout::{NetworkLink, NetworkSolver};
use crate::gpu::pass::{NetworkNodes, Resource};
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

/// A buffer of a large network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Part {
    /// What never changes, by binding, and last the heat, which the host writes.
    Table(u32),
    /// Which nodes a pass takes.
    List(NetworkNodes),
    /// What passes write.
    Of(Resource),
}

/// Names of the tables.
pub const TABLES: [&str; 8] = [
    "network rows",
    "network slices",
    "network neighbours",
    "network conductances",
    "network radiators",
    "network tails",
    "network links",
    "network heat",
];

impl Part {
    /// Whether the host reads or writes it, so that it is counted as the host's.
    pub fn is_of_host(self) -> bool {
        matches!(
            self,
            Self::Table(7)
                | Self::Of(
                    Resource::NetworkKept | Resource::NetworkErrors | Resource::NetworkSensed | Resource::SolverScalars
                )
        )
    }

    /// Its name.
    pub fn name(self) -> String {
        match self {
            Self::Table(binding) => TABLES[binding as usize].to_owned(),
            Self::List(nodes) => format!("network list of {nodes:?}").to_lowercase(),
            Self::Of(resource) => format!("{resource:?}"),
        }
    }
}

/// All buffers of a network of such sizes with so many sensors, in bytes, and the solver's vectors at the end.
pub fn parts(sizes: &Sizes, coupled: bool, sensors: usize) -> Vec<(Part, u64)> {
    let groups = sizes.groups as u64;
    let tails = if sizes.links > 0 { SLICE * sizes.slices + 1 } else { 0 } as u64;
    let [linear, radiative] = sizes.entries.map(|entries| entries as u64);
    let [arithmetic, free] = sizes.listed.map(|groups| 4 * groups as u64);
    let balanced = if coupled { NetworkNodes::Arithmetic } else { NetworkNodes::Lone };
    // A pair of sums for every workgroup of the largest pass.
    let partials = 8 * groups.div_ceil(WORKGROUP as u64);
    let sensed = 8 * sensors as u64 * u64::from(SUB_STEPS_AT_MOST);
    let mut parts = vec![
        (Part::Table(0), 32 * groups),
        (Part::Table(1), 8 * (sizes.slices as u64 + 1)),
        (Part::Table(2), 16 * linear),
        (Part::Table(3), 16 * linear),
        (Part::Table(4), 32 * radiative),
        (Part::Table(5), 4 * tails),
        (Part::Table(6), (size_of::<NetworkLink>() * sizes.links) as u64),
        (Part::Table(7), 32 * groups),
        (Part::List(NetworkNodes::All), 0),
        (Part::List(balanced), arithmetic),
        (Part::List(NetworkNodes::Free), free),
        (Part::List(NetworkNodes::Sensors), 4 * sensors as u64),
        (Part::Of(Resource::NetworkKept), 32 * groups),
        (Part::Of(Resource::NetworkEven), 32 * groups),
        (Part::Of(Resource::NetworkOdd), 32 * groups),
        (Part::Of(Resource::NetworkStart), 16 * groups),
        (Part::Of(Resource::NetworkRates), 16 * groups),
        (Part::Of(Resource::NetworkErrors), 4 * groups),
        (Part::Of(Resource::NetworkSensed), sensed),
        (Part::Of(Resource::SolverPartials), partials),
        (Part::Of(Resource::SolverScalars), size_of::<NetworkSolver>() as u64),
    ];
    parts.extend(SOLVER.map(|vector| (Part::Of(vector), 16 * groups)));
    // No buffer is shorter: an empty table still binds.
    parts.iter_mut().for_each(|(_, bytes)| *bytes = (*bytes).max(16));
    parts
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
        Self::of_parts(&parts(&Sizes::counted(network), false, sensors), spare)
    }

    fn of_parts(parts: &[(Part, u64)], spare: &[u64]) -> Self {
        let sum = |host: bool| parts.iter().filter(|(part, _)| part.is_of_host() == host).map(|(_, bytes)| bytes).sum();
        let (device, host): (u64, u64) = (sum(false), sum(true));
        let vector = parts.last().map_or(0, |(_, bytes)| *bytes);
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
        let parts = parts(&sizes, false, 0);
        // Rows, slices, neighbours, conductances, empty tables and lists, the free, states, start and rates, a sum.
        let expected = 128 + 16 + 128 + 128 + 3 * 16 + 3 * 16 + 16 + 2 * 128 + 2 * 64 + 16;
        assert_eq!(NetworkBytes::of_parts(&parts, &[64 + 5 * 256]).device, expected, "the solver lies elsewhere");
        assert_eq!(NetworkBytes::of_parts(&parts, &[]).device, expected + 6 * 64);
    }
}
