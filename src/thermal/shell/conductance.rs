//! Cotangent weights of an intrinsic triangulation.
//!
//! GL = k h (cot a + cot b) / 2 for the angles a, b opposite to an edge (Pinkall & Polthier, Experimental Mathematics 2, 1993).

use super::NO_NODE;
use super::intrinsic::Intrinsic;

/// Ratio of area to squared longest edge below which a triangle is too flat for cotangents.
const DEGENERATE: f64 = 1e-12;

/// Weights (conductance per k h) of a surface.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Weights {
    /// Pairs of nodes with their positive weight. The lower node is first, and each pair occurs once.
    pub(super) pairs: Vec<([u32; 2], f64)>,
    /// Number of pairs whose negative weight was set to 0.
    pub(super) clamped: usize,
    /// Sum of the absolute values of the negative weights.
    pub(super) clamped_weight: f64,
    /// Number of triangles too flat to conduct.
    pub(super) degenerate: usize,
}

impl Weights {
    pub(super) fn new(surface: &Intrinsic) -> Self {
        let mut weights = Self::default();
        // Area of a triangle [m2]. 0 where it is too flat to conduct.
        let mut conducting = vec![0.0; surface.faces()];
        for (face, conducting) in conducting.iter_mut().enumerate() {
            let corner = [3 * face, 3 * face + 1, 3 * face + 2];
            let area = surface.area(face);
            let longest = corner.into_iter().map(|h| surface.length[h]).fold(0.0, f64::max);
            if area <= DEGENERATE * longest * longest {
                weights.degenerate += 1;
                continue;
            }
            *conducting = area;
        }
        let weight_of = |h: u32| surface.opening(h as usize) / (8.0 * conducting[h as usize / 3]);
        let (starts, mut sides) = surface.by_lower_node();
        // Nearly every pair has two half-edges. Growing the list would hold them twice.
        weights.pairs.reserve_exact(sides.len() / 2);
        for range in starts.windows(2) {
            let sides = &mut sides[range[0] as usize..range[1] as usize];
            sides.sort_unstable_by_key(|h| (surface.ends(*h), *h));
            for pair in sides.chunk_by(|a, b| surface.ends(*a) == surface.ends(*b)) {
                let ends = surface.ends(pair[0]);
                let conducts = |h: &&u32| conducting[**h as usize / 3] > 0.0;
                // After flips an edge may lead from a node around a cone back to the same node.
                if ends[0] == ends[1] || !pair.iter().any(|h| conducts(&h)) {
                    continue;
                }
                let weight: f64 = pair.iter().filter(conducts).map(|h| weight_of(*h)).sum();
                // A right angle has weight 0 up to rounding, and no conductor.
                let scale: f64 = pair.iter().filter(conducts).map(|h| weight_of(*h).abs()).fold(1e-3, f64::max);
                if weight > 1e-12 * scale {
                    weights.pairs.push((ends, weight));
                } else if weight < -1e-9 * scale {
                    weights.clamped += 1;
                    weights.clamped_weight -= weight;
                }
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
        assert_eq!((computed.clamped, computed.degenerate), (0, 0));
    }

    #[test]
    fn an_obtuse_border_is_clamped_and_counted() {
        let computed = weights(&[[0.0, 0.0], [1.0, 0.0], [0.5, 0.1]], &[[0, 1, 2]]);
        assert_eq!((computed.clamped, computed.pairs.len()), (1, 2));
        // Cotangent at the apex between (-0.5, -0.1) and (0.5, -0.1): -0.24 / 0.1.
        assert!((computed.clamped_weight - 1.2).abs() < 1e-12);
    }

    #[test]
    fn a_triangle_without_area_does_not_conduct() {
        let computed = weights(&[[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]], &[[0, 1, 2]]);
        assert_eq!((computed.degenerate, computed.pairs.len()), (1, 0));
    }
}
