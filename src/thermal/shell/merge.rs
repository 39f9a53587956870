//! Merges nodes that exchange heat far faster than a frame can show, such as the ends of slivers.
//!
//! Capping the conductance instead would be wrong by kelvins (docs/numerics.md 3).

use rayon::prelude::*;

use crate::thermal::network::{LinearConductor, Network, NodeKind, RadiativeConductor};

/// Ratio of a pair's rate to the typical rate of the network above which it is a sliver. A fine mesh is fast everywhere and is not merged.
const ABOVE_TYPICAL: f64 = 8.0;

/// Number of sweeps over all conductors. Each uses the sums of the sweep before.
const MOST_SWEEPS: usize = 64;

/// Result of merging: the new node of each node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct MergedNodes {
    /// New number of every node.
    pub(super) node: Vec<u32>,
    pub(super) count: usize,
}

/// Rate at which a pair equalises [1/s]: GL (1/C1 + 1/C2). Only diffusive nodes have one. An arithmetic node costs no sub-steps, and a boundary keeps its
/// temperature.
fn rate(network: &Network, capacitances: &[f64], [a, b]: [usize; 2], conductance: f64) -> Option<f64> {
    let diffusive = |node: usize| network.kinds[node] == NodeKind::Diffusive;
    (diffusive(a) && diffusive(b)).then(|| conductance * (1.0 / capacitances[a] + 1.0 / capacitances[b]))
}

/// Rate above which pairs are merged [1/s]: `fastest`, or more where the whole network is fast.
pub(super) fn threshold(network: &Network, fastest: f64) -> f64 {
    let ends = |one: &LinearConductor| {
        rate(network, &network.capacitances, one.nodes.map(|node| node as usize), one.conductance)
    };
    let mut rates = Vec::with_capacity(network.linear.len());
    rates.extend(network.linear.iter().filter_map(ends));
    if rates.is_empty() {
        return fastest;
    }
    let middle = rates.len() / 2;
    let (_, median, _) = rates.select_nth_unstable_by(middle, f64::total_cmp);
    fastest.max(ABOVE_TYPICAL * *median)
}

/// Merges pairs faster than `threshold` [1/s], the fastest first, until none is left.
pub(super) fn merge(network: &mut Network, threshold: f64) -> MergedNodes {
    let mut merged = MergedNodes { node: (0..network.len() as u32).collect(), count: network.len() };
    for _ in 0..MOST_SWEEPS {
        let Some(sweep) = sweep(network, threshold) else { break };
        apply(network, &sweep);
        merged.node.par_iter_mut().for_each(|node| *node = sweep.node[*node as usize]);
        merged.count = sweep.count;
    }
    merged
}

/// One sweep over the pairs, the fastest first. Each pair has the capacitances after the merges before it.
fn sweep(network: &Network, threshold: f64) -> Option<MergedNodes> {
    let ends = |index: usize| network.linear[index].nodes.map(|node| node as usize);
    let mut fast: Vec<(f64, usize)> = (0..network.linear.len())
        .into_par_iter()
        .filter_map(|index| {
            let rate = rate(network, &network.capacitances, ends(index), network.linear[index].conductance)?;
            (rate > threshold).then_some((rate, index))
        })
        .collect();
    if fast.is_empty() {
        return None;
    }
    fast.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut parent: Vec<u32> = (0..network.len() as u32).collect();
    let mut capacitances = network.capacitances.clone();
    for (_, index) in fast {
        let [a, b] = ends(index).map(|node| root(&mut parent, node));
        let still = rate(network, &capacitances, [a, b], network.linear[index].conductance);
        if a != b && still.is_some_and(|rate| rate > threshold) {
            let [low, high] = [a.min(b), a.max(b)];
            parent[high] = low as u32;
            capacitances[low] += capacitances[high];
        }
    }
    let mut node = vec![0; network.len()];
    let mut count = 0;
    for old in 0..network.len() {
        let root = root(&mut parent, old);
        // A root is the lowest of its nodes, so it already has its new number.
        node[old] = if root == old {
            count += 1;
            count - 1
        } else {
            node[root]
        };
    }
    Some(MergedNodes { node, count: count as usize })
}

fn root(parent: &mut [u32], mut node: usize) -> usize {
    while parent[node] as usize != node {
        parent[node] = parent[parent[node] as usize];
        node = parent[node] as usize;
    }
    node
}

/// Renumbers a network. Capacitances and areas of merged nodes add up, and so do parallel conductors.
pub(super) fn apply(network: &mut Network, merged: &MergedNodes) {
    // A new number never exceeds the old one, so this works in place.
    let mut known = 0;
    for (old, new) in merged.node.iter().enumerate() {
        let new = *new as usize;
        network.kinds[new] = network.kinds[old];
        network.temperatures[new] = network.temperatures[old];
        let (capacitance, area) = (network.capacitances[old], network.emissive_areas[old]);
        if new == known {
            (network.capacitances[new], network.emissive_areas[new]) = (capacitance, area);
            known += 1;
        } else {
            network.capacitances[new] += capacitance;
            network.emissive_areas[new] += area;
        }
    }
    network.kinds.truncate(merged.count);
    network.capacitances.truncate(merged.count);
    network.emissive_areas.truncate(merged.count);
    network.temperatures.truncate(merged.count);
    let rename = |[a, b]: [u32; 2]| {
        let [a, b] = [merged.node[a as usize], merged.node[b as usize]];
        [a.min(b), a.max(b)]
    };
    // The list is replaced in place, because millions of conductors must not be held twice.
    let linear = std::mem::take(&mut network.linear);
    let linear = linear.into_iter().map(|one| (rename(one.nodes), one.conductance)).collect();
    let radiative = std::mem::take(&mut network.radiative);
    let radiative = radiative.into_iter().map(|one| (rename(one.nodes), one.exchange_area)).collect();
    network.linear =
        summed(linear).into_iter().map(|(nodes, conductance)| LinearConductor { nodes, conductance }).collect();
    network.radiative = summed(radiative)
        .into_iter()
        .map(|(nodes, exchange_area)| RadiativeConductor { nodes, exchange_area })
        .collect();
}

/// Every pair once with the sum of its values, without loops.
pub(super) fn summed(mut pairs: Vec<([u32; 2], f64)>) -> Vec<([u32; 2], f64)> {
    pairs.retain(|(pair, _)| pair[0] != pair[1]);
    if !pairs.is_sorted_by_key(|pair| pair.0) {
        // In place, and in an order that does not depend on the number of threads.
        pairs.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    }
    pairs.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
    pairs
}
