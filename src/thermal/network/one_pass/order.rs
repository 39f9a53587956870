//! Orders the nodes of a block so that nodes that conduct to each other stand close: reverse Cuthill-McKee (Cuthill & McKee, ACM 1969; George & Liu,
//! 1981, section 4.3).
//!
//! Exchange between far nodes is nothing within a step, so all weights of a block then lie near the diagonal.

/// The places of a block in their new order. `pairs` are the conductors between them, which join all places.
pub(crate) fn ordered(count: usize, pairs: &[[u32; 2]]) -> Vec<usize> {
    let mut neighbours = vec![Vec::new(); count];
    for [a, b] in pairs.iter().map(|pair| pair.map(|at| at as usize)) {
        neighbours[a].push(b);
        neighbours[b].push(a);
    }
    let degrees: Vec<usize> = neighbours.iter().map(Vec::len).collect();
    neighbours.iter_mut().for_each(|row| row.sort_by_key(|other| (degrees[*other], *other)));
    // The last place of a breadth-first walk lies at an end of the block.
    let mut order = walk(0, &neighbours);
    for _ in 0..2 {
        order = walk(order.last().copied().unwrap_or(0), &neighbours);
    }
    order.reverse();
    order
}

/// Places in the order of a breadth-first walk.
fn walk(start: usize, neighbours: &[Vec<usize>]) -> Vec<usize> {
    let mut is_seen = vec![false; neighbours.len()];
    let mut order = Vec::with_capacity(neighbours.len());
    for root in std::iter::once(start).chain(0..neighbours.len()) {
        if std::mem::replace(&mut is_seen[root], true) {
            continue;
        }
        let mut next = order.len();
        order.push(root);
        while let Some(place) = order.get(next).copied() {
            let fresh = neighbours[place].iter().filter(|other| !std::mem::replace(&mut is_seen[**other], true));
            order.extend(fresh);
            next += 1;
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of 30 x 3 nodes that is numbered along its long side: the distance of joined places falls from 30 to the short side or so.
    #[test]
    fn joined_places_stand_close() {
        let at = |x: u32, y: u32| 30 * y + x;
        let across = (0..30).flat_map(|x| (0..2).map(move |y| [at(x, y), at(x, y + 1)]));
        let along = (0..29).flat_map(|x| (0..3).map(move |y| [at(x, y), at(x + 1, y)]));
        let pairs: Vec<[u32; 2]> = across.chain(along).collect();
        let order = ordered(90, &pairs);
        let mut place = vec![usize::MAX; 90];
        order.iter().enumerate().for_each(|(place_of, old)| place[*old] = place_of);
        assert!(!place.contains(&usize::MAX), "each place is there once");
        let apart = |[a, b]: &[u32; 2]| place[*a as usize].abs_diff(place[*b as usize]);
        assert!(pairs.iter().map(apart).max() <= Some(5), "{:?}", pairs.iter().map(apart).max());
    }
}
