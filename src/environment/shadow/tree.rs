//! Bounding box tree of triangles, stored in the order of a walk, so that neither the host nor the device needs a stack.
//!
//! Some drivers end a shader's loops after 65,535 turns, so the tree must have fewer boxes. All leaves but the last are full. A tree of moving parts
//! therefore never has more boxes.

use glam::DVec3;

/// Triangles in a leaf. All leaves but the last are full, so that moving triangles never need a larger tree.
const LEAF: usize = 4;
/// Candidate places at which a box is split.
const BINS: usize = 16;
/// Most boxes of a tree on the device. lavapipe ends the loops of an invocation after 65,535 turns without an error.
pub(crate) const LARGEST_TREE: usize = 65_000;

const EMPTY: [DVec3; 2] = [DVec3::INFINITY, DVec3::NEG_INFINITY];

/// A box and its content. The box's descendants follow it directly. `skip` is the first node after them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TreeNode {
    /// Lower corner [m].
    pub(crate) low: DVec3,
    /// Upper corner [m].
    pub(crate) high: DVec3,
    /// The next node where a ray misses the box.
    pub(crate) skip: u32,
    /// First triangle of a leaf.
    pub(crate) first: u32,
    /// Number of triangles in a leaf. 0 for an inner node.
    pub(crate) count: u32,
}

/// The nodes in the order of a walk, and the order of the triangles.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Tree {
    /// Every node stands before its descendants.
    pub(crate) nodes: Vec<TreeNode>,
    /// Triangle numbers in the order of the leaves.
    pub(crate) order: Vec<u32>,
}

/// Number of boxes of a tree with so many triangles, wherever they lie.
pub(crate) fn tree_boxes(triangles: usize) -> usize {
    (2 * triangles.div_ceil(LEAF)).saturating_sub(1)
}

struct Builder {
    bounds: Vec<[DVec3; 2]>,
    centres: Vec<DVec3>,
    tree: Tree,
}

impl Tree {
    /// The tree of triangles with boxes around them (lower and upper corner [m]).
    pub(crate) fn new(bounds: Vec<[DVec3; 2]>) -> Self {
        let centres = bounds.iter().map(|[low, high]| 0.5 * (*low + *high)).collect();
        let (count, order) = (bounds.len(), (0..bounds.len() as u32).collect());
        let mut builder = Builder { bounds, centres, tree: Self { nodes: Vec::new(), order } };
        if count > 0 {
            builder.node(0, count);
        }
        builder.tree
    }

    /// Fits the boxes to triangles that have moved. Their order stays.
    pub(crate) fn refit(&mut self, bounds: &[[DVec3; 2]]) {
        for place in (0..self.nodes.len()).rev() {
            let TreeNode { first, count, .. } = self.nodes[place];
            let [low, high] = if count > 0 {
                let run = &self.order[first as usize..(first + count) as usize];
                around(run.iter().map(|number| bounds[*number as usize]))
            } else {
                let second = self.nodes[place + 1].skip as usize;
                around([place + 1, second].map(|child| [self.nodes[child].low, self.nodes[child].high]).into_iter())
            };
            (self.nodes[place].low, self.nodes[place].high) = (low, high);
        }
    }
}

impl Builder {
    /// Adds the node of a range of the order, and its descendants.
    fn node(&mut self, first: usize, end: usize) {
        let [low, high] = around(self.tree.order[first..end].iter().map(|number| self.bounds[*number as usize]));
        let place = self.tree.nodes.len();
        self.tree.nodes.push(TreeNode { low, high, skip: 0, first: first as u32, count: 0 });
        if end - first <= LEAF {
            self.tree.nodes[place].count = (end - first) as u32;
        } else {
            let middle = self.cut(first, end);
            self.node(first, middle);
            self.node(middle, end);
        }
        self.tree.nodes[place].skip = self.tree.nodes.len() as u32;
    }

    /// Splits a range in two where the surface area heuristic (Goldsmith and Salmon 1987, in bins) is least, rounded so that leaves are full. Halves the
    /// range where all centres are equal.
    fn cut(&mut self, first: usize, end: usize) -> usize {
        let Self { bounds, centres, tree } = self;
        let run = &mut tree.order[first..end];
        let [low, high] = around(run.iter().map(|number| [centres[*number as usize]; 2]));
        let axis = (high - low).to_array().iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(i, _)| i);
        let extent = high[axis] - low[axis];
        let bin = |number: u32| {
            let share = (centres[number as usize][axis] - low[axis]) / extent;
            ((share * BINS as f64) as usize).min(BINS - 1)
        };
        let mut bins = [(0usize, EMPTY); BINS];
        if extent > 0.0 {
            for number in run.iter() {
                let (count, bound) = &mut bins[bin(*number)];
                *count += 1;
                *bound = around([*bound, bounds[*number as usize]].into_iter());
            }
        }
        let cost = |bins: &[(usize, [DVec3; 2])]| {
            let count: usize = bins.iter().map(|(count, _)| count).sum();
            let [low, high] = around(bins.iter().map(|(_, bounds)| *bounds));
            let size = high - low;
            (count > 0).then_some(count as f64 * (size.x * size.y + size.y * size.z + size.z * size.x))
        };
        let best = (1..BINS)
            .filter_map(|cut| Some((cut, cost(&bins[..cut])? + cost(&bins[cut..])?)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let below = best.map_or(run.len() / 2, |(cut, _)| bins[..cut].iter().map(|(count, _)| count).sum());
        let most = (run.len() - 1) / LEAF * LEAF;
        let below = (below + LEAF / 2) / LEAF * LEAF;
        let below = below.clamp(LEAF, most);
        run.select_nth_unstable_by(below, |a, b| {
            centres[*a as usize][axis].total_cmp(&centres[*b as usize][axis]).then(a.cmp(b))
        });
        first + below
    }
}

fn around(boxes: impl Iterator<Item = [DVec3; 2]>) -> [DVec3; 2] {
    boxes.fold(EMPTY, |[low, high], [l, h]| [low.min(l), high.max(h)])
}
