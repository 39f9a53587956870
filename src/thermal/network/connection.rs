//! Finds nodes of a network whose heat has no path to a sink.

use super::{Network, NodeKind};

impl Network {
    /// An arithmetic node whose heat has no sink: no path of conductors and arithmetic nodes leads from it to a diffusive node, to a boundary or to space.
    pub fn unbalanced_node(&self) -> Option<usize> {
        self.closed_node(|kind| kind != NodeKind::Arithmetic)
    }

    /// A node whose heat has no sink in a steady state: no path leads from it to a boundary or to space.
    pub fn unsteady_node(&self) -> Option<usize> {
        self.closed_node(|kind| kind == NodeKind::Boundary)
    }

    /// The first node without a path to space or to a node of a kind that `is_end` accepts.
    fn closed_node(&self, is_end: impl Fn(NodeKind) -> bool) -> Option<usize> {
        let linear =
            self.linear.iter().filter(|conductor| conductor.conductance > 0.0).map(|conductor| conductor.nodes);
        let radiative =
            self.radiative.iter().filter(|conductor| conductor.exchange_area > 0.0).map(|conductor| conductor.nodes);
        let mut open: Vec<bool> =
            (0..self.len()).map(|node| is_end(self.kinds[node]) || self.emissive_areas[node] > 0.0).collect();
        if open.iter().all(|open| *open) {
            return None;
        }
        // Connected nodes form a set. A set has a sink where one of its nodes has one.
        let mut parent: Vec<u32> = (0..self.len() as u32).collect();
        for pair in linear.chain(radiative) {
            let [a, b] = pair.map(|node| root(&mut parent, node));
            if a != b {
                parent[b as usize] = a;
                open[a as usize] |= open[b as usize];
            }
        }
        (0..self.len()).find(|node| !open[root(&mut parent, *node as u32) as usize])
    }
}

/// The node that represents the set of a node. Each node of `parent` names another of its set, the last one itself.
pub(crate) fn root(parent: &mut [u32], mut node: u32) -> u32 {
    while parent[node as usize] != node {
        parent[node as usize] = parent[parent[node as usize] as usize];
        node = parent[node as usize];
    }
    node
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::network::LinearConductor;

    #[test]
    fn a_chain_that_ends_nowhere_is_found() {
        let join = |a, b, conductance| LinearConductor { nodes: [a, b], conductance };
        let mut network = Network {
            kinds: vec![NodeKind::Diffusive, NodeKind::Arithmetic, NodeKind::Arithmetic, NodeKind::Boundary],
            capacitances: vec![1.0, 0.0, 0.0, 0.0],
            emissive_areas: vec![0.0; 4],
            temperatures: vec![300.0; 4],
            linear: vec![join(1, 2, 1.0)],
            ..Network::default()
        };
        assert_eq!(network.unbalanced_node(), Some(1));
        network.linear.push(join(2, 0, 0.0));
        assert_eq!(network.unbalanced_node(), Some(1), "a conductance of 0 leads nowhere");
        network.linear.push(join(2, 0, 1.0));
        assert_eq!(network.unbalanced_node(), None);
        assert_eq!(network.unsteady_node(), Some(0));
        network.emissive_areas[1] = 0.1;
        assert_eq!(network.unsteady_node(), None);
    }
}
