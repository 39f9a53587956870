//! A network as the device reads it: nodes with their rows of links, parallel conductors merged.

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

impl Tables {
    /// Gathers the conductors of every node.
    pub fn new(network: &Network) -> Self {
        let is_free = |node: u32| network.kinds[node as usize] != NodeKind::Boundary;
        let linear = network.linear.len();
        // A conductor by its number: its ends, what it conducts, what it radiates.
        let conductor = |number: u32| match network.linear.get(number as usize) {
            Some(conductor) => (conductor.nodes, conductor.conductance, 0.0),
            None => {
                let conductor = &network.radiative[number as usize - linear];
                (conductor.nodes, 0.0, STEFAN_BOLTZMANN * conductor.exchange_area)
            }
        };
        // A conductor stands in the rows of both its ends, but for those that are a boundary.
        let numbers = 0..(linear + network.radiative.len()) as u32;
        let ends = numbers.flat_map(|number| {
            let ([a, b], ..) = conductor(number);
            let both = if a == b { &[][..] } else { &[0, 1][..] };
            both.iter().map(move |end| ([a, b][*end], number))
        });
        let ends = ends.filter(|(here, _)| is_free(*here));
        // All rows in one list, by counting: a list each would be a million allocations.
        let mut starts = vec![0usize; network.len() + 1];
        for (here, _) in ends.clone() {
            starts[here as usize + 1] += 1;
        }
        for node in 0..network.len() {
            starts[node + 1] += starts[node];
        }
        let mut all = vec![0u32; starts[network.len()]];
        let mut filled = starts.clone();
        for (here, number) in ends {
            all[filled[here as usize]] = number;
            filled[here as usize] += 1;
        }
        drop(filled);
        let mut row = Vec::new();
        let mut tables = Self {
            nodes: Vec::with_capacity(network.len()),
            links: Vec::with_capacity(all.len()),
            radiative: !network.radiative.is_empty(),
            lone: Vec::new(),
            coupled: Vec::new(),
            free: Vec::new(),
        };
        for node in 0..network.len() {
            row.clear();
            row.extend(all[starts[node]..starts[node + 1]].iter().map(|number| {
                let ([a, b], conductance, exchange) = conductor(*number);
                (if a as usize == node { b } else { a }, conductance, exchange)
            }));
            row.sort_by_key(|(there, ..): &(u32, f64, f64)| *there);
            row.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                if same {
                    kept.1 += next.1;
                    kept.2 += next.2;
                }
                same
            });
            let kind = network.kinds[node];
            let emission = STEFAN_BOLTZMANN * network.emissive_areas[node];
            let begin = tables.links.len() as u32;
            tables.links.extend(row.iter().map(|(there, conductance, exchange)| NetworkLink {
                neighbour: *there,
                conductance: *conductance as f32,
                exchange: *exchange as f32,
            }));
            let stored = kind == NodeKind::Diffusive;
            tables.nodes.push(NetworkNode {
                inverse_capacitance: if stored { (1.0 / network.capacitances[node]) as f32 } else { 0.0 },
                capacitance: if stored { network.capacitances[node] as f32 } else { 0.0 },
                emission: emission as f32,
                conductance_sum: row.iter().map(|(_, conductance, _)| conductance).sum::<f64>() as f32,
                emission_sum: (emission + row.iter().map(|(.., exchange)| exchange).sum::<f64>()) as f32,
                links_begin: begin,
                links_end: tables.links.len() as u32,
            });
            if kind != NodeKind::Boundary {
                tables.free.push(node as u32);
            }
            if kind == NodeKind::Arithmetic {
                let arithmetic = |(there, ..): &(u32, f64, f64)| network.kinds[*there as usize] == kind;
                let list = if row.iter().any(arithmetic) { &mut tables.coupled } else { &mut tables.lone };
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
