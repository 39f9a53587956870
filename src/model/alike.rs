//! Finds identical vertices.

use glam::DVec3;
use rayon::prelude::*;

/// For every index below `count`: the first index with the same key.
pub(super) fn first_alike<K: Ord>(count: usize, key: impl Fn(usize) -> K + Sync) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count as u32).collect();
    order.par_sort_unstable_by(|a, b| key(*a as usize).cmp(&key(*b as usize)).then(a.cmp(b)));
    let mut first = vec![0; count];
    let mut runs_from = 0;
    for at in 0..count {
        if at == 0 || key(order[at] as usize) != key(order[at - 1] as usize) {
            runs_from = order[at];
        }
        first[order[at] as usize] = runs_from;
    }
    first
}

/// The bits of a position. Adding 0 turns -0 into 0.
pub(super) fn position_bits(position: DVec3) -> [u64; 3] {
    (position + 0.0).to_array().map(f64::to_bits)
}

/// Numbers the distinct positions, compared bit by bit. Also returns how many there are.
pub(super) fn places(positions: &[DVec3]) -> (Vec<u32>, usize) {
    let mut place = first_alike(positions.len(), |vertex| position_bits(positions[vertex]));
    let mut count = 0;
    for vertex in 0..place.len() {
        // The first vertex of a place already has its number when later ones ask.
        place[vertex] = if place[vertex] == vertex as u32 {
            count += 1;
            count - 1
        } else {
            place[place[vertex] as usize]
        };
    }
    (place, count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_numbered_in_the_order_of_their_first_vertices() {
        let at = [2.0, 0.0, 1.0, -0.0, 2.0, 1.0].map(DVec3::splat);
        assert_eq!(places(&at), (vec![0, 1, 2, 1, 0, 2], 3));
        assert_eq!(places(&[]), (vec![], 0));
    }
}
