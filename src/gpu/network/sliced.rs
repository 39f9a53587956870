//! A large network as its kernels read it: four nodes at a time, their rows of conductors in slices (the sliced ELLPACK
//! format: Monakov, Lokhmotov & Avetisyan, HiPEAC 2010, 111).

use super::tables::Tables;
use crate::gpu::layout::NetworkLink;
use crate::thermal::network::Network;

/// Nodes of a group, which one invocation takes.
pub const GROUP: usize = 4;
/// Groups of a slice (glsl/network_rows.glsl, GROUPS_OF_SLICE).
const GROUPS_OF_SLICE: usize = 8;
/// Nodes of a slice.
pub const SLICE: usize = GROUP * GROUPS_OF_SLICE;
/// Conductors of a row; what a node has beyond them is in its tail, so that a hub does not lengthen 31 other rows.
const ROW_AT_MOST: usize = 16;

/// Entries of the rows of a network and links of its tails, counted without laying them out.
pub fn entries(network: &Network) -> (usize, usize) {
    let mut links = vec![0u32; network.len().next_multiple_of(SLICE)];
    let ends = network.linear.iter().map(|one| one.nodes).chain(network.radiative.iter().map(|one| one.nodes));
    for node in ends.flatten() {
        links[node as usize] += 1;
    }
    let width = |slice: &[u32]| slice.iter().copied().max().unwrap_or(0).min(ROW_AT_MOST as u32) as usize;
    let entries = links.chunks(SLICE).map(|slice| width(slice) * GROUPS_OF_SLICE).sum();
    let tails = links.iter().map(|links| (*links as usize).saturating_sub(ROW_AT_MOST)).sum();
    (entries, tails)
}

/// Nodes and conductors.
pub struct Sliced {
    /// Groups of nodes, those of the last slice that are empty among them.
    pub groups: usize,
    /// Of every group: 1 / C, emission, sum of GL, sum of emissions.
    pub rows: Vec<[f32; 4]>,
    /// Where the entries of a slice begin.
    pub slices: Vec<u32>,
    /// Of every entry: the neighbours of four nodes, what they conduct and what they radiate.
    pub neighbours: Vec<[u32; 4]>,
    /// [W/K].
    pub conductances: Vec<[f32; 4]>,
    /// [W/K4].
    pub exchanges: Vec<[f32; 4]>,
    /// Where the tail of a node begins.
    pub tails: Vec<u32>,
    /// All tails.
    pub links: Vec<NetworkLink>,
}

impl Sliced {
    /// Lays out the rows.
    pub fn new(tables: &Tables) -> Self {
        let count = tables.nodes.len();
        let padded = count.next_multiple_of(SLICE);
        let groups = padded / GROUP;
        let mut rows = vec![[0.0; 4]; 4 * groups];
        for (node, row) in tables.nodes.iter().enumerate() {
            let (group, place) = (4 * (node / GROUP), node % GROUP);
            rows[group][place] = row.inverse_capacitance;
            rows[group + 1][place] = row.emission;
            rows[group + 2][place] = row.conductance_sum;
            rows[group + 3][place] = row.emission_sum;
        }
        let in_row = |node: usize| if node < count { tables.row(node).len().min(ROW_AT_MOST) } else { 0 };
        let mut slices = vec![0u32];
        for first in (0..padded).step_by(SLICE) {
            let width = (first..first + SLICE).map(in_row).max().unwrap_or(0);
            slices.push(slices[slices.len() - 1] + (width * GROUPS_OF_SLICE) as u32);
        }
        let entries = slices[slices.len() - 1] as usize;
        let mut sliced = Self {
            groups,
            rows,
            slices,
            neighbours: vec![[0; 4]; entries],
            conductances: vec![[0.0; 4]; entries],
            exchanges: if tables.radiative { vec![[0.0; 4]; entries] } else { Vec::new() },
            tails: Vec::with_capacity(padded + 1),
            links: Vec::new(),
        };
        for node in 0..padded {
            sliced.tails.push(sliced.links.len() as u32);
            let (slice, group, place) = (node / SLICE, node / GROUP % GROUPS_OF_SLICE, node % GROUP);
            let [begin, end] = [sliced.slices[slice], sliced.slices[slice + 1]].map(|at| at as usize);
            let links = if node < count { &tables.links[tables.row(node)] } else { &[] };
            let (row, tail) = links.split_at(in_row(node));
            for (number, entry) in (begin + group..end).step_by(GROUPS_OF_SLICE).enumerate() {
                // What is no conductor leads from a node to itself and conducts nothing.
                let link = row.get(number);
                sliced.neighbours[entry][place] = link.map_or(node as u32, |link| link.neighbour);
                sliced.conductances[entry][place] = link.map_or(0.0, |link| link.conductance);
                if let (Some(exchange), Some(link)) = (sliced.exchanges.get_mut(entry), link) {
                    exchange[place] = link.exchange;
                }
            }
            sliced.links.extend_from_slice(tail);
        }
        sliced.tails.push(sliced.links.len() as u32);
        sliced
    }

    /// Groups with any of the nodes, which are in order, and 1 for those of their nodes that are.
    pub fn groups_of(nodes: &[u32]) -> (Vec<u32>, Vec<[f32; 4]>) {
        let (mut groups, mut masks) = (Vec::new(), Vec::<[f32; 4]>::new());
        for node in nodes {
            let group = node / GROUP as u32;
            if groups.last() != Some(&group) {
                groups.push(group);
                masks.push([0.0; 4]);
            }
            if let Some(mask) = masks.last_mut() {
                mask[*node as usize % GROUP] = 1.0;
            }
        }
        (groups, masks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::network::{LinearConductor, Network, NodeKind};

    /// Every conductor is in the row or in the tail of both its nodes, once.
    #[test]
    fn every_conductor_is_found_again() {
        let hub = |node| LinearConductor { nodes: [7, node], conductance: f64::from(node) + 0.5 };
        let network = Network {
            kinds: vec![NodeKind::Diffusive; 70],
            capacitances: vec![1.0; 70],
            emissive_areas: vec![0.0; 70],
            temperatures: vec![300.0; 70],
            linear: (0..70).filter(|node| *node != 7).map(hub).collect(),
            ..Network::default()
        };
        let tables = Tables::new(&network);
        let sliced = Sliced::new(&tables);
        assert_eq!(sliced.groups, 24);
        assert_eq!(sliced.links.len(), 69 - ROW_AT_MOST);
        let mut sums = vec![0.0; 96];
        for slice in 0..3 {
            for entry in sliced.slices[slice] as usize..sliced.slices[slice + 1] as usize {
                let group = (entry - sliced.slices[slice] as usize) % GROUPS_OF_SLICE;
                for place in 0..GROUP {
                    let node = slice * SLICE + group * GROUP + place;
                    let conductance = f64::from(sliced.conductances[entry][place]);
                    assert!(conductance == 0.0 || node == 7 || sliced.neighbours[entry][place] == 7);
                    sums[node] += conductance;
                }
            }
        }
        for (node, sum) in sums.iter().enumerate().take(70) {
            let tail = sliced.tails[node] as usize..sliced.tails[node + 1] as usize;
            let all = sum + sliced.links[tail].iter().map(|link| f64::from(link.conductance)).sum::<f64>();
            assert_eq!(all, f64::from(tables.nodes[node].conductance_sum), "node {node}");
        }
    }

    #[test]
    fn nodes_are_grouped() {
        let (groups, masks) = Sliced::groups_of(&[1, 3, 9]);
        assert_eq!(groups, [0, 2]);
        assert_eq!(masks, [[0.0, 1.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]]);
    }
}
