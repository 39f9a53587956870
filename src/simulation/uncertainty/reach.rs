//! How far errors reach by conduction.

use super::conducted::settled;
use crate::simulation::prepare::Prepared;

/// Products with the conductances, at most, and the share of the first change at which the solution is near enough.
const PRODUCTS: usize = 100;
const NEAR: f64 = 1e-6;

/// Squares of the errors that reach each drawn node by conduction [K2]: with the conductances G and what a node radiates for each kelvin h [W/K], the solution of
/// (h + sum G) s = h e2 + sum G s of its neighbours. An error so reaches as far as the node's temperature does. `squares` are those of the nodes' own errors, and
/// `radiated` is h. Empty without a network.
pub(super) fn reach(prepared: &Prepared, squares: &[f64], radiated: &[f64]) -> Vec<f64> {
    let Some(scene) = &prepared.network else { return Vec::new() };
    let network = scene.network();
    // What comes from a node itself, and its weight.
    let mut sources = vec![0.0; network.len()];
    let mut own = vec![0.0; network.len()];
    let drawn: Vec<usize> = (0..squares.len()).filter(|slot| scene.has(*slot)).collect();
    for slot in &drawn {
        sources[scene.node_of(*slot)] += radiated[*slot] * squares[*slot];
        own[scene.node_of(*slot)] += radiated[*slot];
    }
    let alone = |(source, own): (&f64, &f64)| if *own > 0.0 { source / own } else { 0.0 };
    let first: Vec<f64> = sources.iter().zip(&own).map(alone).collect();
    let reached = settled(&network.linear, |_| true, &own, &first, (NEAR, PRODUCTS));
    let mut of_slots = vec![0.0; squares.len()];
    drawn.iter().for_each(|slot| of_slots[*slot] = reached[scene.node_of(*slot)].max(0.0));
    of_slots
}
