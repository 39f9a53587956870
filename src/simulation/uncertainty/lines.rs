//! Straight lines between nodes that conduct.

use rayon::prelude::*;

use crate::model::nodes::GROUP;
use crate::simulation::prepare::Prepared;

/// Half of the distance of each drawn node's temperature from the mean of the nodes to which it conducts [K]. On an even mesh with edges h that is h2 T''/4. Lines
/// between nodes leave out h2 T''/8 in their middle, and the balance of the nodes errs by about as much. Contacts join other parts or materials, between which no line is drawn. Heat that enters by a contact
/// along an edge bends no line, so a node in contact takes the largest distance among its neighbours that are not in contact, where it has any. Empty without a network.
pub(super) fn lines(prepared: &Prepared, temperatures: &[f32]) -> Vec<f64> {
    let Some(scene) = &prepared.network else { return Vec::new() };
    let network = scene.network();
    let mut known = vec![f64::NAN; network.len()];
    let mut owner = vec![[u32::MAX; 2]; network.len()];
    let nodes = &prepared.nodes;
    for slot in (0..temperatures.len()).filter(|slot| scene.has(*slot)) {
        let (node, group) = (scene.node_of(slot), slot / GROUP);
        known[node] = f64::from(temperatures[slot]);
        owner[node] = [nodes.group_part[group], nodes.group_material[group]];
    }
    let mut sums = vec![[0.0, 0.0]; network.len()];
    let mut in_contact = vec![false; network.len()];
    for conductor in &network.linear {
        let [a, b] = conductor.nodes.map(|node| node as usize);
        let apart = known[b] - known[a];
        // Nodes that no image shows have no known temperature.
        if apart.is_finite() && owner[a] == owner[b] {
            for (node, apart) in [(a, apart), (b, -apart)] {
                sums[node][0] += conductor.conductance * apart;
                sums[node][1] += conductor.conductance;
            }
        } else if apart.is_finite() {
            (in_contact[a], in_contact[b]) = (true, true);
        }
    }
    let distance = |node: usize| {
        let [sum, all] = sums[node];
        if all > 0.0 { 0.5 * (sum / all).abs() } else { 0.0 }
    };
    let mut distances: Vec<f64> = (0..network.len()).map(distance).collect();
    let mut beside = vec![None; network.len()];
    for conductor in &network.linear {
        let [a, b] = conductor.nodes.map(|node| node as usize);
        for (here, there) in [(a, b), (b, a)] {
            if owner[here] == owner[there] && in_contact[here] && !in_contact[there] {
                beside[here] = Some(distances[there].max(beside[here].unwrap_or(0.0)));
            }
        }
    }
    distances.iter_mut().zip(beside).for_each(|(here, beside)| *here = beside.unwrap_or(*here));
    let mut lines = vec![0.0; temperatures.len()];
    lines.par_iter_mut().enumerate().filter(|(slot, _)| scene.has(*slot)).for_each(|(slot, line)| {
        *line = distances[scene.node_of(slot)];
    });
    lines
}
