//! Finds blocks of nodes joined by strong conductors, which a step can not take explicitly.
//!
//! A conductor is strong where it moves more than [`STRONG`] of the difference of its nodes in a step. A node whose weak conductors move more than
//! [`CROWDED`] of its difference to its neighbours has strong conductors only. Nodes joined by strong conductors are a block.

use std::fmt;

use super::series::{ChebyshevSeries, STAGES_AT_MOST};
use crate::thermal::network::{Network, NodeKind, radiative_slope};

/// Share of a difference that a weak conductor moves at most in a step.
const STRONG: f64 = 0.3;
/// Share that all weak conductors of a node move at most.
const CROWDED: f64 = 0.5;
/// Most nodes of a block with matrices. The host multiplies whole matrices of this size when the scene loads.
pub(crate) const BLOCK_AT_MOST: usize = 512;
/// Most time constants of radiation in a step, in a block. With more, the conduction of the last step is no guide to the present one.
const FADED: f64 = 3.0;

/// The reason why a network is not stepped in one pass.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Unfit {
    /// An arithmetic node that exchanges heat with another one, or too fast with others.
    Arithmetic {
        node: usize,
    },
    Boundary {
        node: usize,
    },
    /// Radiative conductors that move too much of a difference in a step.
    Radiative {
        /// A node that they join.
        node: usize,
        /// The share that they move.
        share: f64,
    },
    /// A large block that conducts too fast for its stages.
    Stiff {
        nodes: usize,
        /// Number of stages that it would take.
        stages: usize,
    },
    /// A node of a block that radiates away its heat too fast.
    Fast {
        node: usize,
        /// Number of its time constants in a step.
        ratio: f64,
    },
    /// The sensor of a thermostat that follows its heater so late that its way bends in a step.
    Lagging {
        node: usize,
    },
}

impl Unfit {
    /// Whether a shorter step may fit.
    pub(crate) fn depends_on_the_step(&self) -> bool {
        !matches!(self, Self::Boundary { .. })
    }
}

impl fmt::Display for Unfit {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Arithmetic { node } => {
                write!(out, "node {node} stores no heat, and conducts to another such node or fast beside the step")
            }
            Self::Boundary { node } => write!(out, "node {node} is a boundary"),
            Self::Radiative { node, share } => write!(
                out,
                "the radiative conductors of node {node} move {share:.2} of a difference in a step, which is more than \
                 {CROWDED}"
            ),
            Self::Stiff { nodes, stages } => write!(
                out,
                "{nodes} nodes are joined by conductors that would take {stages} stages in a step; it takes {STAGES_AT_MOST}"
            ),
            Self::Fast { node, ratio } => {
                write!(
                    out,
                    "node {node}, which conducts fast beside the step, has {ratio:.1} time constants of its radiation in a step; \
                     it takes {FADED:.0}"
                )
            }
            Self::Lagging { node } => write!(
                out,
                "node {node}, the sensor of a thermostat, follows its heater too late for a step of this length"
            ),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Division {
    /// Nodes of each block of at most [`BLOCK_AT_MOST`], ascending.
    pub(crate) blocks: Vec<Vec<u32>>,
    /// Nodes of each larger block, ascending.
    pub(crate) large: Vec<Vec<u32>>,
    /// Greatest rate at which differences in larger blocks decay [1/s], or a bound of it.
    pub(crate) fastest: f64,
    /// Whether each linear conductor lies inside a block.
    pub(crate) inside: Vec<bool>,
}

impl Division {
    /// Divides a network for a step [s]. No node is expected to be hotter than its value in `hottest` [K].
    pub(crate) fn new(network: &Network, step: f64, hottest: &[f64]) -> Result<Self, Unfit> {
        if let Some(node) = network.kinds.iter().position(|kind| *kind == NodeKind::Boundary) {
            return Err(Unfit::Boundary { node });
        }
        let massless = |node: u32| network.kinds[node as usize] == NodeKind::Arithmetic;
        let pairs = || network.linear.iter().map(|one| one.nodes).chain(network.radiative.iter().map(|one| one.nodes));
        if let Some([node, _]) = pairs().find(|[a, b]| a != b && massless(*a) && massless(*b)) {
            return Err(Unfit::Arithmetic { node: node as usize });
        }
        let slope = |node: u32| radiative_slope(hottest[node as usize]);
        // A node without capacity follows its neighbours.
        let share = |node: u32, conductance: f64| {
            if massless(node) { 0.0 } else { step * conductance / network.capacitances[node as usize] }
        };
        let ratio = |node: usize| share(node as u32, slope(node as u32) * network.emissive_areas[node]);
        let mut sums = vec![0.0; network.len()];
        for conductor in &network.radiative {
            let [a, b] = conductor.nodes;
            let steepest = slope(a).max(slope(b));
            for node in conductor.nodes {
                sums[node as usize] += share(node, steepest * conductor.exchange_area);
            }
        }
        if let Some(node) = (0..sums.len()).find(|node| sums[*node] > CROWDED) {
            return Err(Unfit::Radiative { node, share: sums[node] });
        }
        let moved = |[a, b]: [u32; 2], conductance: f64| share(a, conductance) + share(b, conductance);
        let strong = network.linear.iter().map(|one| moved(one.nodes, one.conductance) > STRONG);
        let mut strong: Vec<bool> = strong.collect();
        for (conductor, _) in network.linear.iter().zip(&strong).filter(|(_, strong)| !**strong) {
            for node in conductor.nodes {
                sums[node as usize] += share(node, conductor.conductance);
            }
        }
        for (conductor, strong) in network.linear.iter().zip(&mut strong) {
            *strong |= conductor.nodes.iter().any(|node| sums[*node as usize] > CROWDED);
        }
        let mut sets = Sets((0..network.len() as u32).collect());
        for (conductor, _) in network.linear.iter().zip(&strong).filter(|(_, strong)| **strong) {
            sets.join(conductor.nodes);
        }
        let mut members = vec![Vec::new(); network.len()];
        (0..network.len() as u32).for_each(|node| members[sets.root(node) as usize].push(node));
        let blocks: Vec<Vec<u32>> = members.into_iter().filter(|members| members.len() > 1).collect();
        for block in &blocks {
            for node in block.iter().map(|node| *node as usize) {
                if massless(node as u32) {
                    return Err(Unfit::Arithmetic { node });
                }
                if ratio(node) > FADED {
                    return Err(Unfit::Fast { node, ratio: ratio(node) });
                }
            }
        }
        let inside: Vec<bool> =
            network.linear.iter().map(|one| sets.root(one.nodes[0]) == sets.root(one.nodes[1])).collect();
        let (large, blocks): (Vec<_>, Vec<_>) = blocks.into_iter().partition(|block| block.len() > BLOCK_AT_MOST);
        let fastest = fastest(network, &inside, &large);
        if let Some(largest) = large.iter().map(Vec::len).max() {
            let stages = ChebyshevSeries::new(step * fastest).stages();
            if stages > STAGES_AT_MOST {
                return Err(Unfit::Stiff { nodes: largest, stages });
            }
        }
        Ok(Self { blocks, large, fastest, inside })
    }
}

/// Bound of the rates at which differences in blocks decay [1/s]: the greatest sum over a conductor of the rates of its two nodes, by conductors inside their
/// block (Anderson & Morley, Linear Multilinear Algebra 18, 1985, 141, with conductances and capacitances).
fn fastest(network: &Network, inside: &[bool], blocks: &[Vec<u32>]) -> f64 {
    let mut rates = vec![None; network.len()];
    blocks.iter().flatten().for_each(|node| rates[*node as usize] = Some(0.0));
    let conductors =
        || network.linear.iter().zip(inside).filter(|(one, inside)| **inside && one.nodes[0] != one.nodes[1]);
    for (conductor, _) in conductors() {
        for node in conductor.nodes.map(|node| node as usize) {
            if let Some(rate) = &mut rates[node] {
                *rate += conductor.conductance / network.capacitances[node];
            }
        }
    }
    let sum = |[a, b]: [u32; 2]| rates[a as usize].unwrap_or(0.0) + rates[b as usize].unwrap_or(0.0);
    conductors().map(|(conductor, _)| sum(conductor.nodes)).fold(0.0, f64::max)
}

/// Disjoint sets of nodes. The smallest node represents its set.
struct Sets(Vec<u32>);

impl Sets {
    fn root(&mut self, mut node: u32) -> u32 {
        while self.0[node as usize] != node {
            self.0[node as usize] = self.0[self.0[node as usize] as usize];
            node = self.0[node as usize];
        }
        node
    }

    fn join(&mut self, nodes: [u32; 2]) {
        let [a, b] = nodes.map(|node| self.root(node));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::network::LinearConductor;

    fn chain(conductances: &[f64]) -> Network {
        let count = conductances.len() + 1;
        let join = |(at, conductance): (usize, &f64)| LinearConductor {
            nodes: [at as u32, at as u32 + 1],
            conductance: *conductance,
        };
        Network {
            kinds: vec![NodeKind::Diffusive; count],
            capacitances: vec![1.0; count],
            emissive_areas: vec![0.0; count],
            temperatures: vec![300.0; count],
            linear: conductances.iter().enumerate().map(join).collect(),
            ..Network::default()
        }
    }

    #[test]
    fn strong_conductors_make_blocks() {
        let division = Division::new(&chain(&[0.01, 0.2, 0.2, 0.01, 5.0]), 1.0, &[300.0; 6]).expect("a chain");
        assert_eq!(division.blocks, [vec![1, 2, 3], vec![4, 5]]);
        assert_eq!(division.inside, [false, true, true, false, true]);
        let finer = Division::new(&chain(&[0.01, 0.2, 0.2, 0.01, 5.0]), 0.5, &[300.0; 6]).expect("a chain");
        assert_eq!(finer.blocks, [vec![4, 5]], "with half the step only one conductor is strong");
    }

    #[test]
    fn a_block_of_more_nodes_is_large() {
        let of = |conductors: usize| Division::new(&chain(&vec![1.0; conductors]), 1.0, &vec![300.0; conductors + 1]);
        let [small, large] = [BLOCK_AT_MOST - 1, BLOCK_AT_MOST].map(|conductors| of(conductors).expect("a chain"));
        assert_eq!((small.blocks.len(), small.large.len(), small.fastest), (1, 0, 0.0));
        assert_eq!((large.blocks.len(), large.large.len()), (0, 1));
        // Differences of neighbours in a long chain of equal nodes decay at up to four times the rate of a conductor.
        assert!((large.fastest - 4.0).abs() < 1e-12);
    }

    #[test]
    fn many_weak_conductors_of_a_node_are_strong_together() {
        // A star: each conductor moves 0.2 of a difference, six of them 0.6 of the centre's.
        let mut network = chain(&[0.0; 6]);
        network.linear = (1..7).map(|node| LinearConductor { nodes: [0, node], conductance: 0.1 }).collect();
        let division = Division::new(&network, 1.0, &[300.0; 7]).expect("a star");
        assert_eq!(division.blocks, [vec![0, 1, 2, 3, 4, 5, 6]]);
        network.linear.truncate(4);
        assert_eq!(Division::new(&network, 1.0, &[300.0; 7]).expect("a star").blocks, Vec::<Vec<u32>>::new());
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let refused =
            |network: &Network| Division::new(network, 1.0, &[300.0; BLOCK_AT_MOST + 1]).expect_err("a refusal");
        let stiff = refused(&chain(&[1e5; BLOCK_AT_MOST]));
        assert!(
            matches!(stiff, Unfit::Stiff { nodes, stages } if nodes == BLOCK_AT_MOST + 1 && stages > STAGES_AT_MOST)
        );
        let mut network = chain(&[0.1, 5.0]);
        network.emissive_areas[0] = 9.0 / radiative_slope(300.0);
        assert!(Division::new(&network, 1.0, &[300.0; 3]).is_ok(), "it conducts slowly");
        network.emissive_areas[1] = 3.1 / radiative_slope(300.0);
        assert!(matches!(refused(&network), Unfit::Fast { node: 1, .. }));
        let mut network = chain(&[0.1]);
        let exchange_area = 0.6 / radiative_slope(300.0);
        network.radiative.push(crate::thermal::network::RadiativeConductor { nodes: [1, 0], exchange_area });
        assert!(matches!(refused(&network), Unfit::Radiative { node: 0, .. }));
        network.radiative.clear();
        (network.kinds[1], network.capacitances[1]) = (NodeKind::Arithmetic, 0.0);
        assert!(Division::new(&network, 1.0, &[300.0; 2]).is_ok(), "a node without capacity that conducts slowly");
        network.linear[0].conductance = 0.4;
        assert_eq!(refused(&network), Unfit::Arithmetic { node: 1 });
        network.linear[0].conductance = 0.1;
        (network.kinds[0], network.capacitances[0]) = (NodeKind::Arithmetic, 0.0);
        assert_eq!(refused(&network), Unfit::Arithmetic { node: 0 });
        network.kinds[1] = NodeKind::Boundary;
        assert_eq!(refused(&network), Unfit::Boundary { node: 1 });
    }
}
