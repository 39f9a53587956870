//! Layout of a small network for its shaders: nodes with their rows of links.

use super::rows::{Link, Rows};
use crate::gpu::layout::{NetworkLink, NetworkNode};
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::{Network, NodeKind};

/// Nodes and links of a small network.
pub struct Tables {
    /// Every node.
    pub nodes: Vec<NetworkNode>,
    /// Links of all nodes. Boundary nodes have none.
    pub links: Vec<NetworkLink>,
    /// Whether any nodes radiate to each other.
    pub radiative: bool,
    /// Arithmetic nodes without an arithmetic neighbour.
    pub lone: Vec<u32>,
    /// Arithmetic nodes with an arithmetic neighbour.
    pub coupled: Vec<u32>,
    /// Nodes that are not a boundary.
    pub free: Vec<u32>,
}

/// Whether a row contains an arithmetic node.
pub fn is_coupled(network: &Network, row: &[Link]) -> bool {
    row.iter().any(|link| network.kinds[link.neighbour as usize] == NodeKind::Arithmetic)
}

impl From<&Link> for NetworkLink {
    fn from(link: &Link) -> Self {
        Self { neighbour: link.neighbour, conductance: link.conductance as f32, exchange: link.exchange as f32 }
    }
}

impl Tables {
    /// Builds the tables of a network.
    pub fn new(network: &Network) -> Self {
        let rows = Rows::new(network);
        let mut row = Vec::new();
        let mut tables = Self {
            nodes: Vec::with_capacity(network.len()),
            links: Vec::new(),
            radiative: !network.radiative.is_empty(),
            lone: Vec::new(),
            coupled: Vec::new(),
            free: Vec::new(),
        };
        for node in 0..network.len() {
            rows.of(node, &mut row);
            let kind = network.kinds[node];
            let emission = STEFAN_BOLTZMANN * network.emissive_areas[node];
            let begin = tables.links.len() as u32;
            tables.links.extend(row.iter().map(NetworkLink::from));
            let stored = kind == NodeKind::Diffusive;
            tables.nodes.push(NetworkNode {
                inverse_capacitance: if stored { (1.0 / network.capacitances[node]) as f32 } else { 0.0 },
                capacitance: if stored { network.capacitances[node] as f32 } else { 0.0 },
                emission: emission as f32,
                conductance_sum: row.iter().map(|link| link.conductance).sum::<f64>() as f32,
                emission_sum: (emission + row.iter().map(|link| link.exchange).sum::<f64>()) as f32,
                links_begin: begin,
                links_end: tables.links.len() as u32,
            });
            if kind != NodeKind::Boundary {
                tables.free.push(node as u32);
            }
            if kind == NodeKind::Arithmetic {
                let list = if is_coupled(network, &row) { &mut tables.coupled } else { &mut tables.lone };
                list.push(node as u32);
            }
        }
        tables
    }

    /// Indices of a node's links.
    pub fn row(&self, node: usize) -> std::ops::Range<usize> {
        self.nodes[node].links_begin as usize..self.nodes[node].links_end as usize
    }

    /// Loop iterations of a pass over these nodes and their links with `lanes` invocations.
    pub fn loops(&self, nodes: &[u32], lanes: u32) -> u32 {
        let turns = |chunk: &[u32]| chunk.iter().map(|node| self.row(*node as usize).len() + 1).max().unwrap_or(0);
        nodes.chunks(lanes as usize).map(turns).sum::<usize>() as u32 + 1
    }
}
