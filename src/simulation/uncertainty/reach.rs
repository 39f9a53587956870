//! How far errors reach by conduction.

use crate::simulation::prepare::Prepared;

/// Rounds in which errors pass from node to node, each by an edge at most.
const ROUNDS: u32 = 100;

/// Squares of the errors that reach each drawn node by conduction [K2]: with the conductances G and what a node radiates for each kelvin h [W/K], the solution of
/// (h + sum G) s = h e2 + sum G s of its neighbours. An error so reaches as far as the node's temperature does. `squares` are those of the nodes' own errors, and
/// `radiated` is h. Empty without a network.
pub(super) fn reach(prepared: &Prepared, squares: &[f64], radiated: &[f64]) -> Vec<f64> {
    let Some(scene) = &prepared.network else { return Vec::new() };
    let network = scene.network();
    // What comes from a node itself, and what all of its ways weigh.
    let mut sources = vec![0.0; network.len()];
    let mut weights = vec![0.0; network.len()];
    let drawn: Vec<usize> = (0..squares.len()).filter(|slot| scene.has(*slot)).collect();
    for slot in &drawn {
        sources[scene.node_of(*slot)] += radiated[*slot] * squares[*slot];
        weights[scene.node_of(*slot)] += radiated[*slot];
    }
    let mut reached: Vec<f64> = sources
        .iter()
        .zip(&weights)
        .map(|(source, weight)| if *weight > 0.0 { source / weight } else { 0.0 })
        .collect();
    for conductor in &network.linear {
        conductor.nodes.iter().for_each(|node| weights[*node as usize] += conductor.conductance);
    }
    for _ in 0..ROUNDS {
        let mut sums = sources.clone();
        for conductor in &network.linear {
            let [a, b] = conductor.nodes.map(|node| node as usize);
            sums[a] += conductor.conductance * reached[b];
            sums[b] += conductor.conductance * reached[a];
        }
        let of_node = |(sum, weight): (&f64, &f64)| if *weight > 0.0 { sum / weight } else { 0.0 };
        reached = sums.iter().zip(&weights).map(of_node).collect();
    }
    let mut of_slots = vec![0.0; squares.len()];
    drawn.iter().for_each(|slot| of_slots[*slot] = reached[scene.node_of(*slot)]);
    of_slots
}
