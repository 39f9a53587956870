//! The eight-way tree of boxes in which rays find triangles, whatever the triangles.
//!
//! `obvhs` walks its tree with a stack of 32 entries and loses boxes below that depth without an error. Many coincident or nested triangles make such trees.
//! They get a tree that halves its boxes instead, which is never deep.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Depth up to which a walk of `obvhs` is complete.
const DEEPEST: u32 = 31;
/// Most triangles of a leaf, the most that an eight-way tree takes.
const LEAF: u32 = 3;
/// Depth below which the builder looks only at the next box, and share of boxes that are tried elsewhere: the values of `obvhs` for a medium build.
const SEARCH_DEPTH: usize = 3;
const REINSERTED: f32 = 0.05;

/// A tree over boxes.
pub(super) fn boxes_around(boxes: &[Aabb]) -> CwBvh {
    let numbers = (0..boxes.len() as u32).collect();
    let mut builder = PlocBuilder::with_capacity(boxes.len());
    let mut pairs = builder.build(PlocSearchDistance::Medium, boxes, numbers, SortPrecision::U64, SEARCH_DEPTH);
    ReinsertionOptimizer::default().run(&mut pairs, REINSERTED, None);
    let tree = bvh2_to_cwbvh(&pairs, LEAF, true, false);
    if depth(&tree) <= DEEPEST { tree } else { bvh2_to_cwbvh(&halved(boxes), LEAF, true, false) }
}

/// Inner boxes on the longest way down.
fn depth(tree: &CwBvh) -> u32 {
    let mut deepest = 0;
    let mut below: Vec<(u32, u32)> = if tree.nodes.is_empty() { Vec::new() } else { vec![(0, 1)] };
    while let Some((number, depth)) = below.pop() {
        deepest = deepest.max(depth);
        let node = &tree.nodes[number as usize];
        let inner = (0..8).filter(|child| !node.is_child_empty(*child) && !node.is_leaf(*child));
        below.extend(inner.map(|child| (node.child_node_index(child), depth + 1)));
    }
    deepest
}

/// A tree of pairs that halves the boxes by their number along the longest side.
fn halved(boxes: &[Aabb]) -> Bvh2 {
    let mut numbers: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut work = vec![(0usize, 0..boxes.len())];
    while let Some((place, range)) = work.pop() {
        let run = &mut numbers[range.clone()];
        let around = run.iter().fold(Aabb::empty(), |around, number| around.union(&boxes[*number as usize]));
        if run.len() == 1 {
            nodes[place] = Bvh2Node::new(around, 1, range.start as u32);
            continue;
        }
        let centre = |number: &u32| boxes[*number as usize].center();
        let [low, high] = run
            .iter()
            .map(centre)
            .fold([Vec3A::INFINITY, Vec3A::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)]);
        let axis = (high - low).to_array().iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(i, _)| i);
        let middle = run.len() / 2;
        run.select_nth_unstable_by(middle, |a, b| centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(b)));
        let first = nodes.len();
        nodes[place] = Bvh2Node::new(around, 0, first as u32);
        nodes.extend([Bvh2Node::default(); 2]);
        work.push((first, range.start..range.start + middle));
        work.push((first + 1, range.start + middle..range.end));
    }
    Bvh2 { nodes, primitive_indices: numbers, ..Bvh2::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes around each other, each twice as large as the last, and boxes at one place.
    #[test]
    fn no_tree_is_deeper_than_a_walk() {
        let nested = |number: i32| 1.2f32.powi(number % 100);
        for size in [nested, |_| 1.0] {
            let boxes: Vec<Aabb> =
                (0..3000).map(|number| Aabb::new(-Vec3A::splat(size(number)), Vec3A::splat(size(number)))).collect();
            let tree = boxes_around(&boxes);
            assert!(depth(&tree) <= DEEPEST, "{}", depth(&tree));
            let mut all = tree.primitive_indices.clone();
            all.sort_unstable();
            assert!(all.iter().copied().eq(0..3000), "each box once");
        }
        assert!(boxes_around(&[]).nodes.is_empty());
    }

    /// The builder's own tree is too deep for coincident boxes: without the second tree, rays would miss triangles.
    #[test]
    fn coincident_boxes_need_the_halved_tree() {
        let boxes = vec![Aabb::new(Vec3A::ZERO, Vec3A::ONE); 1003];
        let numbers = (0..1003).collect();
        let mut pairs = PlocBuilder::with_capacity(1003).build(
            PlocSearchDistance::Medium,
            &boxes,
            numbers,
            SortPrecision::U64,
            SEARCH_DEPTH,
        );
        ReinsertionOptimizer::default().run(&mut pairs, REINSERTED, None);
        assert!(depth(&bvh2_to_cwbvh(&pairs, LEAF, true, false)) > DEEPEST);
    }
}
