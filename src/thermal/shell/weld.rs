//! Welds drawn vertices into nodes: coincident vertices of one part and material.

use glam::DVec3;
use rayon::prelude::*;

use super::{NO_NODE, ShellSurface};

/// Numbers the places of the vertices for which `wanted` is true, in the order of their first vertices. Other vertices get `NO_NODE`. Returns the numbers
/// and their count. Coordinates must be equal to the last bit. Subdivision makes equal points from both sides of an edge.
pub(super) fn weld(surface: &ShellSurface, wanted: impl Fn(usize) -> bool + Sync) -> (Vec<u32>, usize) {
    let key = |vertex: u32| {
        let vertex = vertex as usize;
        let place = surface.positions[vertex];
        // Adding 0 turns -0 into 0.
        let bits = (place + DVec3::ZERO).to_array().map(f64::to_bits);
        (surface.parts[vertex], surface.materials[vertex], bits)
    };
    let mut order: Vec<u32> =
        (0..surface.positions.len()).into_par_iter().filter(|v| wanted(*v)).map(|v| v as u32).collect();
    order.par_sort_by_key(|vertex| key(*vertex));
    let mut first = vec![NO_NODE; surface.positions.len()];
    for same in order.chunk_by(|a, b| key(*a) == key(*b)) {
        for vertex in same {
            first[*vertex as usize] = same[0];
        }
    }
    // The sort is stable, so the first vertex of a place comes first.
    let mut count = 0;
    for vertex in 0..first.len() {
        if first[vertex] == vertex as u32 {
            first[vertex] = count;
            count += 1;
        } else if first[vertex] != NO_NODE {
            first[vertex] = first[first[vertex] as usize];
        }
    }
    (first, count as usize)
}
