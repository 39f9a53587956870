//! A network as the device reads it: nodes with their rows of links, parallel conductors merged.

use super::rows::{Link, Rows};
use crate::gpu::layout::{NetworkLink, NetworkNode};
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::{Network, NodeKind};

/// Rows of links and what the nodes are.
pub struct Tables {
    /// Every node.
    pub nodes: Vec<NetworkNode>,
    /// The links of all nodes, those of a boundary left out.
    pub links: Vec<NetworkLink>,
    /// Whether any link radiates.
    pub radiative: bool,
    /// Arithmetic nodes without arithmetic neighbours.
    pub lone: Vec<u32>,
    /// Arithmetic nodes with arithmetic neighbours.
    pub coupled: Vec<u32>,
    /// Nodes that are no boundary.
    pub free: Vec<u32>,
}

/// Whether a row leads to an arithmetic node.
pub fn is_coupled(network: &Network, row: &[Link]) -> bool {
    row.iter().any(|link| network.kinds[link.neighbour as usize] == NodeKind::Arithmetic)
}

impl From<&Link> for NetworkLink {
    fn from(link: &Link) -> Self {
        Self { neighbour: link.neighbour, conductance: link.conductance as f32, exchange: link.exchange as f32 }
    }
}

impl Tables {
    /// Gathers the conductors of every node.
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

    /// Links of a node.
    pub fn row(&self, node: usize) -> std::ops::Range<usize> {
        self.nodes[node].links_begin as usize..self.nodes[node].links_end as usize
    }

    /// Turns of loops of one pass over these nodes and their links by so many invocations.
    pub fn loops(&self, nodes: &[u32], lanes: u32) -> u32 {
        let turns = |chunk: &[u32]| chunk.iter().map(|node| self.row(*node as usize).len() + 1).max().unwrap_or(0);
        nodes.chunks(lanes as usize).map(turns).sum::<usize>() as u32 + 1
    }
}
