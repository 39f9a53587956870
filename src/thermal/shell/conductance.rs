//! Cotangent weights of an intrinsic triangulation, and what takes their place at obtuse borders.
//!
//! GL = k h (cot a + cot b) / 2 for the angles a, b opposite to an edge (Pinkall & Polthier, Experimental Mathematics 2, 1993).
//!
//! Across from the border of a surface the angle may be obtuse, and no flip mends it. Such a triangle conducts as its two halves on both sides of its altitude do. The foot of the
//! altitude is no node and has the temperature of the corner across, because no heat passes the border. So heat along the border meets the whole section, and no weight is negative.
//! Beside such a triangle, and where more than two triangles meet, an obtuse angle may ask for the same. Heat does pass there, and meets less than the whole section.

use super::NO_NODE;
use super::intrinsic::{Intrinsic, next, previous};

/// Ratio of area to squared longest edge below which a triangle is too flat for cotangents.
const DEGENERATE: f64 = 1e-12;
/// Share of the larger weight below which a sum of weights is rounding.
const NO_WEIGHT: f64 = 1e-12;

/// Weights (conductance per k h) of a surface.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Weights {
    /// Pairs of nodes with their positive weight. The lower node is first, and each pair occurs once.
    pub(super) pairs: Vec<([u32; 2], f64)>,
    /// Number of triangles too flat to conduct.
    pub(super) degenerate: usize,
}

/// How a triangle conducts.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Conducting {
    /// It is too flat.
    Not,
    /// By cotangents. Its area [m2].
    Whole(f64),
    /// By its halves. Its area [m2], and the half-edge across from the obtuse angle.
    Halves(f64, u32),
}

impl Weights {
    pub(super) fn new(surface: &Intrinsic) -> Self {
        let mut weights = Self::default();
        let mut conducting: Vec<Conducting> = (0..surface.faces()).map(|face| Conducting::new(surface, face)).collect();
        weights.degenerate = conducting.iter().filter(|face| **face == Conducting::Not).count();
        let (starts, mut sides) = surface.by_lower_node();
        for range in starts.windows(2) {
            let sides = &mut sides[range[0] as usize..range[1] as usize];
            sides.sort_unstable_by_key(|h| (surface.ends(*h), *h));
        }
        let pairs = || sides.chunk_by(|a, b| surface.ends(*a) == surface.ends(*b));
        // The weight of a pair, and its largest part.
        let sum_of = |conducting: &[Conducting], pair: &[u32]| {
            let sides = pair.iter().map(|h| conducting[*h as usize / 3].weight(surface, *h));
            sides.fold((0.0, 1e-3), |(sum, scale), side| (sum + side, f64::max(scale, side.abs())))
        };
        // Halves conduct less across their sides, so the next triangle may then need halves too.
        let mut is_done = false;
        while !is_done {
            is_done = true;
            for pair in pairs() {
                let (sum, scale) = sum_of(&conducting, pair);
                if sum < -NO_WEIGHT * scale {
                    is_done = false;
                    pair.iter().for_each(|h| conducting[*h as usize / 3].halve_if_obtuse(surface, *h));
                }
            }
        }
        // Nearly every pair has two half-edges. Growing the list would hold them twice.
        weights.pairs.reserve_exact(sides.len() / 2);
        for pair in pairs() {
            let ends = surface.ends(pair[0]);
            let (sum, scale) = sum_of(&conducting, pair);
            // A right angle has weight 0 up to rounding, and no conductor. After flips an edge may lead from a node around a cone back to the same node.
            if ends[0] != ends[1] && sum > NO_WEIGHT * scale {
                weights.pairs.push((ends, sum));
            }
        }
        weights.pairs.shrink_to_fit();
        weights
    }

    /// Gives every node a new number. Pairs that become one node, and pairs with a node that is left out, vanish.
    pub(super) fn rename(&mut self, new: &[u32]) {
        for (pair, _) in &mut self.pairs {
            *pair = pair.map(|node| new[node as usize]);
        }
        self.pairs.retain(|([a, b], _)| a != b && *a != NO_NODE && *b != NO_NODE);
    }
}

impl Conducting {
    fn new(surface: &Intrinsic, face: usize) -> Self {
        let area = surface.area(face);
        let longest = surface.length[3 * face..3 * face + 3].iter().copied().fold(0.0, f64::max);
        if area <= DEGENERATE * longest * longest { Self::Not } else { Self::Whole(area) }
    }

    /// Lets a triangle conduct by its halves where the angle across from a half-edge is obtuse.
    fn halve_if_obtuse(&mut self, surface: &Intrinsic, half_edge: u32) {
        match *self {
            Self::Whole(area) if surface.opening(half_edge as usize) < 0.0 => *self = Self::Halves(area, half_edge),
            _ => {}
        }
    }

    /// Weight of a half-edge of this triangle.
    fn weight(self, surface: &Intrinsic, half_edge: u32) -> f64 {
        let half_edge = half_edge as usize;
        let (area, base) = match self {
            Self::Not => return 0.0,
            Self::Whole(area) => return surface.opening(half_edge) / (8.0 * area),
            Self::Halves(area, base) => (area, base as usize),
        };
        // A half-edge from the corner conducts over half the height along its part of the base.
        if half_edge == base {
            return 0.0;
        }
        let end = if half_edge == next(base) { previous(base) } else { next(base) };
        2.0 * area / surface.opening(end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn weights(points: &[[f64; 2]], triangles: &[[u32; 3]]) -> Weights {
        let positions: Vec<DVec3> = points.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect();
        Weights::new(&Intrinsic::new(triangles, &positions, |vertex| vertex))
    }

    #[test]
    fn an_equilateral_triangle_by_hand() {
        let computed = weights(&[[0.0, 0.0], [1.0, 0.0], [0.5, 0.75_f64.sqrt()]], &[[0, 1, 2]]);
        assert_eq!(computed.pairs.len(), 3);
        let half_cotangent = 0.5 / 3.0_f64.sqrt();
        assert!(computed.pairs.iter().all(|(_, weight)| (weight - half_cotangent).abs() < 1e-15));
    }

    #[test]
    fn a_square_conducts_along_its_sides() {
        let computed = weights(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]], &[[0, 1, 2], [0, 2, 3]]);
        assert_eq!(computed.pairs.len(), 4, "the diagonal's weight is zero");
        assert!(computed.pairs.iter().all(|(pair, weight)| pair != &[0, 2] && (weight - 0.5).abs() < 1e-15));
        assert_eq!(computed.degenerate, 0);
    }

    /// Where the temperature rises along the border, heat flows through half the height on each side, and none stays at the corner.
    #[test]
    fn an_obtuse_triangle_at_the_border_conducts_along_it() {
        let [left, right, height] = [0.3, 0.7, 0.1];
        let computed = weights(&[[0.0, 0.0], [1.0, 0.0], [left, height]], &[[0, 1, 2]]);
        let [(start, to_start), (end, to_end)] = computed.pairs[..] else { panic!("{computed:?}") };
        assert_eq!([start, end], [[0, 2], [1, 2]]);
        assert!((to_start * left - 0.5 * height).abs() < 1e-15, "half the section of the triangle");
        assert!((to_end * right - 0.5 * height).abs() < 1e-15);
    }

    #[test]
    fn a_right_angle_conducts_the_same_by_its_halves() {
        let right = Intrinsic::new(&[[0, 1, 2]], &[DVec3::ZERO, DVec3::X, DVec3::new(0.2, 0.4, 0.0)], |vertex| vertex);
        let whole = Conducting::new(&right, 0);
        let Conducting::Whole(area) = whole else { panic!("{whole:?}") };
        let halves = Conducting::Halves(area, 0);
        for half_edge in 0..3 {
            assert!((whole.weight(&right, half_edge) - halves.weight(&right, half_edge)).abs() < 1e-15);
        }
    }

    #[test]
    fn a_triangle_without_area_does_not_conduct() {
        let computed = weights(&[[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]], &[[0, 1, 2]]);
        assert_eq!((computed.degenerate, computed.pairs.len()), (1, 0));
    }
}
