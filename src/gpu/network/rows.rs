//! Conductors of a network, sorted by node, with parallel conductors merged.

use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::{Network, NodeKind};

/// Heat exchange of a node with one neighbour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// Number of the neighbour.
    pub neighbour: u32,
    /// Linear conductor GL [W/K].
    pub conductance: f64,
    /// Stefan-Boltzmann constant x radiative conductor GR [W/K4].
    pub exchange: f64,
}

/// Numbers of the conductors of every node, linear ones first.
pub struct Rows<'a> {
    network: &'a Network,
    /// Index in `numbers` of each node's first conductor, plus one index at the end.
    starts: Vec<u32>,
    numbers: Vec<u32>,
}

impl<'a> Rows<'a> {
    /// Sorts the conductors by counting, because a list for each node would need a million allocations. Each conductor
    /// is in the rows of both its ends, but boundary nodes have no row.
    pub fn new(network: &'a Network) -> Self {
        let pairs = network.linear.iter().map(|one| one.nodes).chain(network.radiative.iter().map(|one| one.nodes));
        let ends = pairs.enumerate().filter(|(_, [a, b])| a != b);
        let ends = ends.flat_map(|(number, pair)| pair.map(|node| (node, number as u32)));
        let ends = ends.filter(|(node, _)| network.kinds[*node as usize] != NodeKind::Boundary);
        let mut starts = vec![0u32; network.len() + 1];
        for (node, _) in ends.clone() {
            starts[node as usize + 1] += 1;
        }
        for node in 0..network.len() {
            starts[node + 1] += starts[node];
        }
        let mut numbers = vec![0u32; starts[network.len()] as usize];
        // `starts[node]` moves to the end of the node's row, which is the start of the next row.
        for (node, number) in ends {
            let next = &mut starts[node as usize];
            numbers[*next as usize] = number;
            *next += 1;
        }
        starts.rotate_right(1);
        starts[0] = 0;
        Self { network, starts, numbers }
    }

    /// Writes the links of a node to `row`, in the order of the neighbours.
    pub fn of(&self, node: usize, row: &mut Vec<Link>) {
        let network = self.network;
        let [begin, end] = [self.starts[node], self.starts[node + 1]].map(|at| at as usize);
        row.clear();
        row.extend(self.numbers[begin..end].iter().map(|number| {
            let number = *number as usize;
            let ([a, b], conductance, exchange) = match network.linear.get(number) {
                Some(one) => (one.nodes, one.conductance, 0.0),
                None => {
                    let one = &network.radiative[number - network.linear.len()];
                    (one.nodes, 0.0, STEFAN_BOLTZMANN * one.exchange_area)
                }
            };
            Link { neighbour: if a as usize == node { b } else { a }, conductance, exchange }
        }));
        row.sort_by_key(|link| link.neighbour);
        row.dedup_by(|next, kept| {
            let same = next.neighbour == kept.neighbour;
            if same {
                kept.conductance += next.conductance;
                kept.exchange += next.exchange;
            }
            same
        });
    }
}
