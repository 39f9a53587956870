//! The large blocks of a network: nodes that conduct to each other in stages.

use super::blocks::Division;
use super::order::ordered;
use super::rows::{ExchangeLink, ExchangeRows};
use crate::thermal::network::{LinearConductor, Network};

/// Place of a node that is in no large block.
const NOWHERE: u32 = u32::MAX;

/// The large blocks.
#[derive(Debug)]
pub struct Large {
    nodes: Vec<u32>,
    /// Place of each node of the network among `nodes`, or `NOWHERE`.
    places: Vec<u32>,
    rows: ExchangeRows,
    /// Greatest rate at which differences decay [1/s], or a bound of it.
    pub(super) fastest: f64,
}

impl Large {
    /// The large blocks of a network. `None` where it has none.
    pub(super) fn new(network: &Network, division: &Division) -> Option<Self> {
        let Division { large, inside, fastest, .. } = division;
        if large.is_empty() {
            return None;
        }
        let mut places = vec![NOWHERE; network.len()];
        let mut block_of = vec![0; network.len()];
        for (number, block) in large.iter().enumerate() {
            block.iter().zip(0..).for_each(|(node, at)| places[*node as usize] = at);
            block.iter().for_each(|node| block_of[*node as usize] = number);
        }
        let is_own = |node: u32| places[node as usize] != NOWHERE;
        let inner = network.linear.iter().zip(inside).filter(|(one, inside)| **inside && is_own(one.nodes[0]));
        let inner: Vec<&LinearConductor> = inner.map(|(one, _)| one).collect();
        let mut pairs = vec![Vec::new(); large.len()];
        for conductor in &inner {
            let pair = conductor.nodes.map(|node| places[node as usize]);
            pairs[block_of[conductor.nodes[0] as usize]].push(pair);
        }
        let rows = ExchangeRows::new(network.len(), inner.into_iter(), &[]);
        let in_order = |(block, pairs): (&Vec<u32>, &Vec<[u32; 2]>)| -> Vec<u32> {
            ordered(block.len(), pairs).into_iter().map(|at| block[at]).collect()
        };
        let nodes: Vec<u32> = large.iter().zip(&pairs).flat_map(in_order).collect();
        nodes.iter().zip(0..).for_each(|(node, at)| places[*node as usize] = at);
        Some(Self { nodes, places, rows, fastest: *fastest })
    }

    /// Their nodes. Nodes that conduct to each other stand close.
    pub(crate) fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// The conductors of a node inside its block.
    pub(crate) fn links_of(&self, node: usize) -> &[ExchangeLink] {
        self.rows.of(node)
    }

    pub(crate) fn place(&self, node: u32) -> Option<usize> {
        Some(self.places[node as usize]).filter(|place| *place != NOWHERE).map(|place| place as usize)
    }

    /// X of a vector: the heat that each node loses to its neighbours in a step [s], over its capacitance. The values stand in the order of
    /// [`Self::nodes`].
    pub(super) fn rates(&self, network: &Network, step: f64, vector: &[f64]) -> Vec<f64> {
        let rate = |(node, here): (&u32, &f64)| {
            let lost =
                |link: &ExchangeLink| link.conductance * (here - vector[self.places[link.neighbour as usize] as usize]);
            let lost: f64 = self.links_of(*node as usize).iter().map(lost).sum();
            step / network.capacitances[*node as usize] * lost
        };
        self.nodes.iter().zip(vector).map(rate).collect()
    }
}
