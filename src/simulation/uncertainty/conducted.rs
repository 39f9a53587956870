//! Errors that conduction moves from node to node.

use crate::exchange::scaling::conjugate_gradients;
use crate::simulation::prepare::Prepared;
use crate::thermal::network::connection::root;

/// Products with the conductances in a step, at most, and the share of the first change at which the solution is near enough.
const PRODUCTS: usize = 20;
const NEAR: f64 = 0.02;

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

/// ConductedErrors between the drawn nodes of a network during a step.
pub(super) struct ConductedErrors<'a> {
    prepared: &'a Prepared,
    /// The drawn nodes.
    drawn: Vec<usize>,
    /// Weight of what each drawn node errs by itself [W/K].
    weights: Vec<f64>,
    /// The same of each node of the network, and with the conductances to its drawn neighbours.
    own: Vec<f64>,
    all: Vec<f64>,
}

impl<'a> ConductedErrors<'a> {
    /// `weight` is what a drawn node radiates for each kelvin, over the share of its error that a step takes away [W/K]. `None` without a network.
    pub(super) fn new(prepared: &'a Prepared, weight: impl Fn(usize) -> f64) -> Option<Self> {
        let scene = prepared.network.as_ref()?;
        let network = scene.network();
        let drawn: Vec<usize> = (0..prepared.nodes.vertex_of_node.len()).filter(|slot| scene.has(*slot)).collect();
        let weights: Vec<f64> = drawn.iter().map(|slot| weight(*slot)).collect();
        let mut own = vec![0.0; network.len()];
        drawn.iter().zip(&weights).for_each(|(slot, weight)| own[scene.node_of(*slot)] += weight);
        let mut conduction = Self { prepared, drawn, weights, all: own.clone(), own };
        let mut all = std::mem::take(&mut conduction.all);
        conduction.conductors().for_each(|([a, b], conductance)| {
            all[a] += conductance;
            all[b] += conductance;
        });
        Some(Self { all, ..conduction })
    }

    /// Conductors between drawn nodes.
    fn conductors(&self) -> impl Iterator<Item = ([usize; 2], f64)> {
        let network = self.prepared.network.as_ref().map(|scene| scene.network());
        let linear = network.map_or(&[][..], |network| &network.linear);
        let ends = |[a, b]: [u32; 2]| [a as usize, b as usize];
        let both = linear.iter().map(move |one| (ends(one.nodes), one.conductance));
        both.filter(|([a, b], _)| self.own[*a] > 0.0 && self.own[*b] > 0.0)
    }

    /// The errors of drawn nodes at the end of the step, where `alone` are those without conduction. With weights w and conductances G they solve
    /// w x + sum of G (x - x of a neighbour) = w `alone`. What all nodes err alike stays.
    pub(super) fn spread(&self, alone: &mut [f64]) {
        let Some(scene) = &self.prepared.network else { return };
        let mut first = vec![0.0; self.own.len()];
        for (slot, weight) in self.drawn.iter().zip(&self.weights) {
            first[scene.node_of(*slot)] += weight * alone[*slot];
        }
        first.iter_mut().zip(&self.own).for_each(|(first, own)| *first = if *own > 0.0 { *first / own } else { 0.0 });
        let moved = |of: &[f64]| {
            let mut heat = vec![0.0; of.len()];
            self.conductors().for_each(|([a, b], conductance)| {
                heat[a] += conductance * (of[b] - of[a]);
                heat[b] += conductance * (of[a] - of[b]);
            });
            heat
        };
        let times = |way: &[f64]| -> Vec<f64> {
            let moved = moved(way);
            way.iter().zip(&self.own).zip(moved).map(|((way, own), moved)| own * way - moved).collect()
        };
        let change = conjugate_gradients(&self.all, times, &moved(&first), NEAR, PRODUCTS);
        for slot in &self.drawn {
            let node = scene.node_of(*slot);
            alone[*slot] = first[node] + change[node];
        }
    }
}
