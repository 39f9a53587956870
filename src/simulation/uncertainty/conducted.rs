//! Errors that conduction moves from node to node.

use crate::exchange::scaling::conjugate_gradients;
use crate::simulation::network::SceneNetwork;
use crate::simulation::prepare::Prepared;
use crate::thermal::network::LinearConductor;
use crate::thermal::network::connection::root;

/// Products with the conductances in a step, at most, and the share of the first change at which the solution is near enough.
const PRODUCTS: usize = 20;
const NEAR: f64 = 1e-3;

/// Area of all that conducts to each drawn node [m2]. `areas` are those of the nodes. Empty without a network.
pub(super) fn areas_of_pieces(prepared: &Prepared, areas: &[f64]) -> Vec<f64> {
    let Some(scene) = &prepared.network else { return Vec::new() };
    let network = scene.network();
    let mut above: Vec<u32> = (0..network.len() as u32).collect();
    for conductor in &network.linear {
        let [a, b] = conductor.nodes.map(|node| root(&mut above, node));
        above[a as usize] = b;
    }
    let mut of_piece = vec![0.0; network.len()];
    let drawn = |slot: &usize| scene.has(*slot);
    for slot in (0..areas.len()).filter(drawn) {
        of_piece[root(&mut above, scene.node_of(slot) as u32) as usize] += areas[slot];
    }
    let mut pieces = vec![0.0; areas.len()];
    for slot in (0..areas.len()).filter(drawn) {
        pieces[slot] = of_piece[root(&mut above, scene.node_of(slot) as u32) as usize];
    }
    pieces
}

/// Share of the error of a patch of an area [m2] that counts, where conduction evens out the errors of others too: heat spreads over the area pi `square` [m2], and over a piece
/// at most. Of N patches with independent errors the mean has the share N^-1/2, of patches that err alike 1. Reciprocity and closed rows join their errors, so N^-1/4 is taken.
pub(super) fn apart(square: f64, piece: f64, patch: f64) -> f64 {
    let spread = (std::f64::consts::PI * square).min(piece);
    if patch > 0.0 { (1.0 + spread / patch).powf(-0.25) } else { 1.0 }
}

/// Solves w x + sum of G (x - x of a neighbour) = w `first` with the weights `own` and the conductances of conductors between nodes that `take` part, near to a share of the first
/// change. What is alike over all that conducts stays, to the last bit.
pub(super) fn settled(
    linear: &[LinearConductor],
    takes: impl Fn(usize) -> bool,
    own: &[f64],
    first: &[f64],
    (near, products): (f64, usize),
) -> Vec<f64> {
    let conductors = || {
        let ends = linear.iter().map(|one| (one.nodes.map(|node| node as usize), one.conductance));
        ends.filter(|([a, b], _)| takes(*a) && takes(*b))
    };
    let moved = |of: &[f64]| {
        let mut heat = vec![0.0; of.len()];
        conductors().for_each(|([a, b], conductance)| {
            heat[a] += conductance * (of[b] - of[a]);
            heat[b] += conductance * (of[a] - of[b]);
        });
        heat
    };
    let mut all = own.to_vec();
    conductors().for_each(|([a, b], conductance)| {
        all[a] += conductance;
        all[b] += conductance;
    });
    let times = |way: &[f64]| -> Vec<f64> {
        let moved = moved(way);
        way.iter().zip(own).zip(moved).map(|((way, own), moved)| own * way - moved).collect()
    };
    let change = conjugate_gradients(&all, times, &moved(first), near, products);
    first.iter().zip(change).map(|(first, change)| first + change).collect()
}

/// Conduction of errors between the drawn nodes of a network during a step.
pub(super) struct ConductedErrors<'a> {
    scene: &'a SceneNetwork,
    /// The drawn nodes, and the weight of what each errs by itself [W/K].
    drawn: Vec<(usize, f64)>,
    /// The same of each node of the network.
    own: Vec<f64>,
}

impl<'a> ConductedErrors<'a> {
    /// `weight` is what a drawn node radiates for each kelvin, over the share of its error that a step takes away [W/K]. `None` without a network.
    pub(super) fn new(prepared: &'a Prepared, weight: impl Fn(usize) -> f64) -> Option<Self> {
        let scene = prepared.network.as_deref()?;
        let slots = (0..prepared.nodes.vertex_of_node.len()).filter(|slot| scene.has(*slot));
        let drawn: Vec<(usize, f64)> = slots.map(|slot| (slot, weight(slot))).collect();
        let mut own = vec![0.0; scene.network().len()];
        drawn.iter().for_each(|(slot, weight)| own[scene.node_of(*slot)] += weight);
        Some(Self { scene, drawn, own })
    }

    /// Gives drawn nodes their errors at the end of the step, where `alone` are those without conduction.
    pub(super) fn spread(&self, alone: &mut [f64]) {
        let mut first = vec![0.0; self.own.len()];
        for (slot, weight) in &self.drawn {
            first[self.scene.node_of(*slot)] += weight * alone[*slot];
        }
        first.iter_mut().zip(&self.own).for_each(|(first, own)| *first = if *own > 0.0 { *first / own } else { 0.0 });
        let linear = &self.scene.network().linear;
        let settled = settled(linear, |node| self.own[node] > 0.0, &self.own, &first, (NEAR, PRODUCTS));
        self.drawn.iter().for_each(|(slot, _)| alone[*slot] = settled[self.scene.node_of(*slot)]);
    }
}
