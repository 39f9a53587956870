//! Layout of a network for its shaders: groups of four nodes whose rows of conductors lie in slices.
//!
//! The format is sliced ELLPACK (Monakov, Lokhmotov & Avetisyan, HiPEAC 2010, 111). Within a window, nodes with rows of
//! similar length are neighbours, as in SELL-C-sigma (Kreutzer, Hager, Wellein, Fehske & Bishop, SIAM J. Sci. Comput.
//! 36, 2014, C401).
//!
//! On lavapipe the cost is the number of loads, with one component or with four. Linear and radiative conductors have
//! separate rows, because most nodes of a mesh radiate to no other node. Conductors beyond 16 go to a tail, so that a
//! hub does not lengthen its slice.

use super::rows::{Link, Rows};
use crate::gpu::layout::NetworkLink;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::{Network, NodeKind};

/// Nodes of a group, which one invocation handles.
pub const GROUP: usize = 4;
/// Groups of a slice (GROUPS_OF_SLICE in glsl/network_rows.glsl).
const GROUPS_OF_SLICE: usize = 4;
/// Nodes of a slice.
pub const SLICE: usize = GROUP * GROUPS_OF_SLICE;
/// Nodes of a window, within which nodes are sorted by row length. It is small enough to keep neighbours close.
const WINDOW: usize = 32 * SLICE;
/// Conductors of a hub. A window with a hub is not sorted, so that one invocation does not get several hubs.
const HUB: u32 = 256;
/// Most conductors of a row. The others go to the node's tail.
const ROW_AT_MOST: usize = 16;

/// Whether a row contains an arithmetic node.
fn is_coupled(network: &Network, row: &[Link]) -> bool {
    row.iter().any(|link| network.kinds[link.neighbour as usize] == NodeKind::Arithmetic)
}

impl From<&Link> for NetworkLink {
    fn from(link: &Link) -> Self {
        Self { neighbour: link.neighbour, conductance: link.conductance as f32, exchange: link.exchange as f32 }
    }
}

/// Lengths of the arrays of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sizes {
    /// Number of groups, with the empty groups of the last slice.
    pub groups: usize,
    /// Number of slices.
    pub slices: usize,
    /// Number of linear and of radiative entries, for four nodes each.
    pub entries: [usize; 2],
    /// Number of conductors in tails.
    pub links: usize,
    /// Number of groups with an arithmetic node, and with a node that is not a boundary.
    pub listed: [usize; 2],
}

impl Sizes {
    /// Upper bound for a network, counted without building the layout. Parallel conductors count separately.
    pub fn counted(network: &Network) -> Self {
        Order::of(network).1
    }
}

/// Order of the nodes on the device. A slot is the place of a node.
struct Order {
    /// Node of each slot.
    node_of_slot: Vec<u32>,
    /// Slot of each node.
    slot_of_node: Vec<u32>,
}

impl Order {
    /// Sorts the nodes of each window by row length, and counts the sizes.
    fn of(network: &Network) -> (Self, Sizes) {
        let count = network.len();
        // Number of linear and radiative conductors at each node.
        let mut lengths = vec![[0u32; 2]; count];
        let mut add = |which: usize, pair: [u32; 2]| {
            for node in pair.into_iter().filter(|_| pair[0] != pair[1]).map(|node| node as usize) {
                lengths[node][which] += u32::from(network.kinds[node] != NodeKind::Boundary);
            }
        };
        network.linear.iter().filter(|one| one.conductance != 0.0).for_each(|one| add(0, one.nodes));
        network.radiative.iter().filter(|one| one.exchange_area != 0.0).for_each(|one| add(1, one.nodes));
        let mut node_of_slot: Vec<u32> = (0..count as u32).collect();
        for window in node_of_slot.chunks_mut(WINDOW) {
            let length = |node: &u32| lengths[*node as usize];
            if window.iter().flat_map(length).all(|length| length < HUB) {
                window.sort_by_key(|node| std::cmp::Reverse(length(node)));
            }
        }
        let slices = count.div_ceil(SLICE);
        let mut sizes = Sizes { groups: slices * GROUPS_OF_SLICE, slices, ..Sizes::default() };
        for slice in node_of_slot.chunks(SLICE) {
            for (which, entries) in sizes.entries.iter_mut().enumerate() {
                let lengths = slice.iter().map(|node| lengths[*node as usize][which] as usize);
                *entries += lengths.clone().max().unwrap_or(0).min(ROW_AT_MOST) * GROUPS_OF_SLICE;
                sizes.links += lengths.map(|length| length.saturating_sub(ROW_AT_MOST)).sum::<usize>();
            }
        }
        for group in node_of_slot.chunks(GROUP) {
            let any = |is: fn(NodeKind) -> bool| group.iter().any(|node| is(network.kinds[*node as usize]));
            sizes.listed[0] += usize::from(any(|kind| kind == NodeKind::Arithmetic));
            sizes.listed[1] += usize::from(any(|kind| kind != NodeKind::Boundary));
        }
        drop(lengths);
        let mut slot_of_node = vec![0u32; count];
        for (slot, node) in node_of_slot.iter().enumerate() {
            slot_of_node[*node as usize] = slot as u32;
        }
        (Self { node_of_slot, slot_of_node }, sizes)
    }
}

/// Nodes and conductors in the layout of the shaders. All numbers of nodes in it are slots.
#[derive(Default)]
pub struct Sliced {
    /// Number of groups, with the empty groups of the last slice.
    pub groups: usize,
    /// 1 / C and emission of each group.
    pub rows: Vec<[f32; 4]>,
    /// First linear and first radiative entry of each slice, plus one pair at the end.
    pub slices: Vec<[u32; 2]>,
    /// Linear entries: the neighbours of four nodes.
    pub neighbours: Vec<[u32; 4]>,
    /// Conductors of the linear entries [W/K].
    pub conductances: Vec<[f32; 4]>,
    /// Radiative entries: the neighbours of four nodes, and the bits of their conductors [W/K4].
    pub radiators: Vec<[[u32; 4]; 2]>,
    /// First conductor of each node's tail.
    pub tails: Vec<u32>,
    /// Conductors of all tails.
    pub links: Vec<NetworkLink>,
    /// Slot of each node.
    pub slot_of_node: Vec<u32>,
    /// Whether nodes radiate to each other.
    pub radiative: bool,
    /// Whether arithmetic nodes are coupled to each other.
    pub coupled: bool,
    /// Groups with arithmetic nodes, and a bit for each of these nodes.
    pub arithmetic: Vec<u32>,
    /// Groups with nodes that are not a boundary, and a bit for each of these nodes.
    pub free: Vec<u32>,
}

impl Sliced {
    /// Builds the layout of a network.
    pub fn new(network: &Network) -> Self {
        let rows = Rows::new(network);
        let (Order { node_of_slot, slot_of_node }, sizes) = Order::of(network);
        let mut sliced = Self {
            groups: sizes.groups,
            rows: vec![[0.0; 4]; 2 * sizes.groups],
            slices: Vec::with_capacity(sizes.slices + 1),
            neighbours: Vec::with_capacity(sizes.entries[0]),
            conductances: Vec::with_capacity(sizes.entries[0]),
            radiators: Vec::with_capacity(sizes.entries[1]),
            tails: Vec::new(),
            links: Vec::with_capacity(sizes.links),
            slot_of_node,
            radiative: !network.radiative.is_empty(),
            coupled: false,
            arithmetic: Vec::with_capacity(sizes.listed[0]),
            free: Vec::with_capacity(sizes.listed[1]),
        };
        if sizes.links > 0 {
            sliced.tails.reserve_exact(SLICE * sizes.slices + 1);
        }
        let mut row = Vec::new();
        // Linear and radiative links of the nodes of a slice.
        let mut links: [Vec<Vec<Link>>; 2] = [vec![Vec::new(); SLICE], vec![Vec::new(); SLICE]];
        for first in (0..SLICE * sizes.slices).step_by(SLICE) {
            for (place, slot) in (first..first + SLICE).enumerate() {
                links.iter_mut().for_each(|links| links[place].clear());
                if let Some(node) = node_of_slot.get(slot) {
                    rows.of(*node as usize, &mut row);
                    sliced.take_node(network, *node as usize, &row);
                    links[0][place].extend(row.iter().filter(|link| link.conductance != 0.0));
                    links[1][place].extend(row.iter().filter(|link| link.exchange != 0.0));
                }
            }
            sliced.take_slice(first, &links, sizes.links > 0);
        }
        sliced.slices.push(sliced.ends());
        if sizes.links > 0 {
            sliced.tails.push(sliced.links.len() as u32);
        }
        sliced
    }

    /// End of the linear and of the radiative entries so far.
    fn ends(&self) -> [u32; 2] {
        [self.neighbours.len() as u32, self.radiators.len() as u32]
    }

    fn take_node(&mut self, network: &Network, node: usize, row: &[Link]) {
        let kind = network.kinds[node];
        let slot = self.slot_of_node[node] as usize;
        let (group, place) = (2 * (slot / GROUP), slot % GROUP);
        let stored = kind == NodeKind::Diffusive;
        self.rows[group][place] = if stored { (1.0 / network.capacitances[node]) as f32 } else { 0.0 };
        self.rows[group + 1][place] = (STEFAN_BOLTZMANN * network.emissive_areas[node]) as f32;
        if kind != NodeKind::Boundary {
            list(&mut self.free, slot);
        }
        if kind == NodeKind::Arithmetic {
            list(&mut self.arithmetic, slot);
            self.coupled |= is_coupled(network, row);
        }
    }

    fn take_slice(&mut self, first: usize, [linear, radiative]: &[Vec<Vec<Link>>; 2], with_tails: bool) {
        let begin = self.ends();
        self.slices.push(begin);
        let width = |links: &[Vec<Link>]| links.iter().map(Vec::len).max().unwrap_or(0).min(ROW_AT_MOST);
        // An unused entry joins a node to itself with conductance 0.
        let itself = |group: usize| [0, 1, 2, 3].map(|place| (first + GROUP * group + place) as u32);
        for _ in 0..width(linear) {
            self.neighbours.extend((0..GROUPS_OF_SLICE).map(itself));
            self.conductances.extend([[0.0; 4]; GROUPS_OF_SLICE]);
        }
        for _ in 0..width(radiative) {
            self.radiators.extend((0..GROUPS_OF_SLICE).map(|group| [itself(group), [0; 4]]));
        }
        for at in 0..SLICE {
            let (group, place) = (at / GROUP, at % GROUP);
            let slot = |link: &Link| self.slot_of_node[link.neighbour as usize];
            for (number, link) in linear[at].iter().take(ROW_AT_MOST).enumerate() {
                let entry = begin[0] as usize + GROUPS_OF_SLICE * number + group;
                self.neighbours[entry][place] = slot(link);
                self.conductances[entry][place] = link.conductance as f32;
            }
            for (number, link) in radiative[at].iter().take(ROW_AT_MOST).enumerate() {
                let entry = begin[1] as usize + GROUPS_OF_SLICE * number + group;
                self.radiators[entry][0][place] = slot(link);
                self.radiators[entry][1][place] = (link.exchange as f32).to_bits();
            }
            if with_tails {
                self.tails.push(self.links.len() as u32);
                let conducting = linear[at].iter().skip(ROW_AT_MOST);
                let conducting = conducting.map(|link| Link { neighbour: slot(link), exchange: 0.0, ..*link });
                let radiating = radiative[at].iter().skip(ROW_AT_MOST);
                let radiating = radiating.map(|link| Link { neighbour: slot(link), conductance: 0.0, ..*link });
                self.links.extend(conducting.chain(radiating).map(|link| NetworkLink::from(&link)));
            }
        }
    }

    /// Lengths of the arrays.
    pub fn sizes(&self) -> Sizes {
        Sizes {
            groups: self.groups,
            slices: self.slices.len() - 1,
            entries: [self.neighbours.len(), self.radiators.len()],
            links: self.links.len(),
            listed: [self.arithmetic.len(), self.free.len()],
        }
    }
}

/// Adds a slot to a list of groups with a bit for each node. Slots must come in order.
fn list(list: &mut Vec<u32>, slot: usize) {
    let (group, bit) = ((slot / GROUP) as u32, 1 << (slot % GROUP));
    match list.last_mut() {
        Some(entry) if *entry >> GROUP == group => *entry |= bit,
        _ => list.push(group << GROUP | bit),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::network::{LinearConductor, RadiativeConductor};

    /// A hub that conducts to all other nodes and radiates to every third of them.
    fn hub() -> Network {
        let others = (0..70).filter(|node| *node != 7);
        let conducts = |node| LinearConductor { nodes: [7, node], conductance: f64::from(node) + 0.5 };
        let radiates = |node| RadiativeConductor { nodes: [node, 7], exchange_area: 1e6 * (f64::from(node) + 0.25) };
        let mut kinds = vec![NodeKind::Diffusive; 70];
        (kinds[0], kinds[1], kinds[3], kinds[69]) =
            (NodeKind::Boundary, NodeKind::Arithmetic, NodeKind::Arithmetic, NodeKind::Boundary);
        Network {
            kinds,
            capacitances: vec![1.0; 70],
            emissive_areas: vec![0.0; 70],
            temperatures: vec![300.0; 70],
            linear: others.clone().map(conducts).collect(),
            radiative: others.step_by(3).map(radiates).collect(),
            ..Network::default()
        }
    }

    /// Checks that every conductor is once in the row or tail of each of its nodes.
    #[test]
    fn every_conductor_is_found_again() {
        let network = hub();
        let sliced = Sliced::new(&network);
        let groups = 70_usize.div_ceil(SLICE) * GROUPS_OF_SLICE;
        assert_eq!(sliced.groups, groups);
        assert_eq!(sliced.links.len(), 69 - ROW_AT_MOST + 23 - ROW_AT_MOST);
        // By slot.
        let mut sums = vec![[0.0; 2]; GROUP * groups];
        let hub = sliced.slot_of_node[7] as usize;
        let entries = |which: usize| {
            let slices = sliced.slices.windows(2).enumerate();
            slices.flat_map(move |(slice, pair)| {
                let [begin, end] = [pair[0][which], pair[1][which]];
                (begin..end).flat_map(move |entry| {
                    let group = slice * GROUPS_OF_SLICE + (entry - begin) as usize % GROUPS_OF_SLICE;
                    (0..GROUP).map(move |place| (entry as usize, GROUP * group + place, place))
                })
            })
        };
        for (entry, slot, place) in entries(0) {
            let conductance = sliced.conductances[entry][place];
            assert!(conductance == 0.0 || slot == hub || sliced.neighbours[entry][place] as usize == hub);
            sums[slot][0] += f64::from(conductance);
        }
        for (entry, slot, place) in entries(1) {
            let exchange = f32::from_bits(sliced.radiators[entry][1][place]);
            assert!(exchange == 0.0 || slot == hub || sliced.radiators[entry][0][place] as usize == hub);
            sums[slot][1] += f64::from(exchange);
        }
        let mut expected = vec![[0.0; 2]; 70];
        for one in &network.linear {
            one.nodes.iter().for_each(|node| expected[*node as usize][0] += one.conductance);
        }
        for one in &network.radiative {
            let exchange = f64::from((STEFAN_BOLTZMANN * one.exchange_area) as f32);
            one.nodes.iter().for_each(|node| expected[*node as usize][1] += exchange);
        }
        for (node, mut expected) in expected.into_iter().enumerate() {
            if network.kinds[node] == NodeKind::Boundary {
                expected = [0.0; 2];
            }
            let slot = sliced.slot_of_node[node] as usize;
            let tail = &sliced.links[sliced.tails[slot] as usize..sliced.tails[slot + 1] as usize];
            let conductance = sums[slot][0] + tail.iter().map(|link| f64::from(link.conductance)).sum::<f64>();
            let exchange = sums[slot][1] + tail.iter().map(|link| f64::from(link.exchange)).sum::<f64>();
            assert_eq!([conductance, exchange], expected, "node {node}");
        }
        assert!(sums[70..].iter().all(|sums| *sums == [0.0; 2]));
        assert_eq!(sliced.sizes(), Sizes::counted(&network));
    }

    /// Checks that short rows of a window are not padded to the length of longer ones.
    #[test]
    fn nodes_of_like_rows_stand_beside_each_other() {
        let side = 40;
        let at = |x: u32, y: u32| y * side + x;
        let join = |a, b| LinearConductor { nodes: [a, b], conductance: 1.0 };
        let along = (0..side * side).filter(|node| node % side > 0).map(|node| join(node - 1, node));
        // Every fourth row of nodes also conducts across.
        let across = (0..side - 1).step_by(4).flat_map(|y| (0..side).map(move |x| join(at(x, y), at(x, y + 1))));
        let count = (side * side) as usize;
        let network = Network {
            kinds: vec![NodeKind::Diffusive; count],
            capacitances: vec![1.0; count],
            emissive_areas: vec![0.0; count],
            temperatures: vec![300.0; count],
            linear: along.chain(across).collect(),
            ..Network::default()
        };
        let ends = 2 * network.linear.len();
        let sizes = Sizes::counted(&network);
        assert!(GROUP * sizes.entries[0] < ends + ends / 20, "{} of {ends}", GROUP * sizes.entries[0]);
        assert_eq!(sizes, Sliced::new(&network).sizes());
        let mut slots = Sliced::new(&network).slot_of_node;
        assert!(slots.iter().enumerate().all(|(node, slot)| node / WINDOW == *slot as usize / WINDOW));
        slots.sort_unstable();
        assert!(slots.into_iter().eq(0..side * side), "every slot is taken once");
    }

    /// Checks that parallel conductors become one entry, although they count as two.
    #[test]
    fn parallel_conductors_are_one() {
        let mut network = hub();
        let first = network.linear[3];
        network.linear.push(LinearConductor { nodes: [first.nodes[1], first.nodes[0]], conductance: 2.0 });
        let (sliced, counted) = (Sliced::new(&network), Sizes::counted(&network));
        assert_eq!(counted.links, sliced.links.len() + 1);
        assert_eq!(sliced.links.len(), Sliced::new(&hub()).links.len());
    }

    #[test]
    fn nodes_are_listed_by_group() {
        let sliced = Sliced::new(&hub());
        let nodes = |list: &[u32]| {
            let slots = list.iter().flat_map(|entry| {
                let group = entry >> GROUP;
                (0..4).filter(move |place| entry >> place & 1 == 1).map(move |place| 4 * group + place)
            });
            let node = |slot: u32| sliced.slot_of_node.iter().position(|one| *one == slot);
            let mut nodes: Vec<usize> = slots.filter_map(node).collect();
            nodes.sort_unstable();
            nodes
        };
        assert_eq!(nodes(&sliced.arithmetic), [1, 3]);
        let free: Vec<usize> = (0..70).filter(|node| ![0, 69].contains(node)).collect();
        assert_eq!(nodes(&sliced.free), free);
        assert!(!sliced.coupled);
        let mut network = hub();
        network.linear.push(LinearConductor { nodes: [1, 3], conductance: 1.0 });
        assert!(Sliced::new(&network).coupled);
    }
}
