//! Exact shadows: rays from a node to the Sun's disc, against all triangles of the craft.

use std::f64::consts::TAU;

use glam::DVec3;

use super::tree::Tree;
use super::{SUN_ANGULAR_RADIUS, lit_side};

/// Points of the Sun's disc, each with one ray.
pub(crate) const SUN_RAYS: usize = 16;
/// Distance between a ray's start and its surface, as a share of the size of the craft.
const START: f64 = 1e-5;

/// Triangles that may cast shadows, and the tree that finds them.
#[derive(Debug, Clone, PartialEq)]
pub struct Occluders {
    /// Corner and edges of each triangle [m], in the order of the tree's leaves.
    pub(crate) triangles: Vec<[DVec3; 3]>,
    /// The tree of their boxes.
    pub tree: Tree,
    /// Distance between a ray's start and its surface [m].
    pub(crate) start: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// Place of the triangle in [`Occluders::triangles`].
    pub(crate) triangle: usize,
    /// Distance from the start of the ray [m].
    pub(crate) distance: f64,
    /// Weight of its second corner.
    pub(crate) u: f64,
    /// Weight of its third corner.
    pub(crate) v: f64,
    /// Whether the ray meets the face around which the corners turn to the left.
    pub(crate) outside: bool,
}

/// Unit vectors to points that share the Sun's disc evenly, on a sunflower spiral (Vogel 1979).
pub(crate) fn disc_directions(sun: DVec3) -> [DVec3; SUN_RAYS] {
    let (x, y) = sun.any_orthonormal_pair();
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    std::array::from_fn(|i| {
        let radius = SUN_ANGULAR_RADIUS * ((i as f64 + 0.5) / SUN_RAYS as f64).sqrt();
        let (sine, cosine) = (TAU * golden * i as f64).sin_cos();
        (sun + radius * (cosine * x + sine * y)).normalize()
    })
}

impl Occluders {
    /// The occluders of triangles with positions [m].
    pub(crate) fn new(positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let tree = Tree::new(positions, triangles);
        let mut occluders = Self { triangles: Vec::new(), tree, start: 0.0 };
        occluders.place(positions, triangles);
        occluders
    }

    /// Takes new positions [m] of the triangles. The order of the triangles stays.
    pub(crate) fn refit(&mut self, positions: &[DVec3], triangles: &[[u32; 3]]) {
        self.tree.refit(positions, triangles);
        self.place(positions, triangles);
    }

    fn place(&mut self, positions: &[DVec3], triangles: &[[u32; 3]]) {
        let edges = |number: &u32| {
            let [a, b, c] = triangles[*number as usize].map(|corner| positions[corner as usize]);
            [a, b - a, c - a]
        };
        self.triangles = self.tree.order.iter().map(edges).collect();
        self.start = START * self.tree.nodes.first().map_or(0.0, |root| (root.high - root.low).length());
    }

    /// Share of the Sun's disc that a node sees, at a position [m] with a unit normal. Either side of the surface may be lit.
    pub fn solar_visibility(&self, position: DVec3, normal: DVec3, sun: DVec3) -> f64 {
        let from = position + lit_side(normal, sun) * self.start;
        let open = disc_directions(sun).into_iter().filter(|direction| !self.is_hidden(from, *direction)).count();
        open as f64 / SUN_RAYS as f64
    }

    /// Whether a triangle lies in a direction from a point [m].
    pub(crate) fn is_hidden(&self, from: DVec3, direction: DVec3) -> bool {
        self.walk(from, direction, &mut |_| true)
    }

    /// Distance from a point [m] to the first triangle in a direction [m].
    pub(crate) fn nearest(&self, from: DVec3, direction: DVec3) -> Option<f64> {
        let mut nearest: Option<f64> = None;
        self.walk(from, direction, &mut |distance| {
            nearest = Some(nearest.map_or(distance, |least| least.min(distance)));
            false
        });
        nearest
    }

    /// The first triangle in a direction from a point [m]. Of two at the same distance it is the one that the walk meets first.
    pub(crate) fn first(&self, from: DVec3, direction: DVec3) -> Option<Hit> {
        let inverse = direction.recip();
        let (mut at, mut nearest, mut hit) = (0, f64::INFINITY, None);
        while let Some(node) = self.tree.nodes.get(at) {
            let (a, b) = ((node.low - from) * inverse, (node.high - from) * inverse);
            let enters = a.min(b).max_element();
            let leaves = a.max(b).min_element();
            if leaves < enters || leaves < 0.0 || enters > nearest {
                at = node.skip as usize;
                continue;
            }
            for number in node.first as usize..(node.first + node.count) as usize {
                let triangle = &self.triangles[number];
                if let Some((distance, u, v)) = meets(triangle, from, direction).filter(|meeting| meeting.0 < nearest) {
                    nearest = distance;
                    let outside = triangle[1].cross(triangle[2]).dot(direction) < 0.0;
                    hit = Some(Hit { triangle: number, distance, u, v, outside });
                }
            }
            at += 1;
        }
        hit
    }

    /// Calls `ends` with the distance of every triangle that a ray meets, until it returns true. Returns whether it did.
    fn walk(&self, from: DVec3, direction: DVec3, ends: &mut dyn FnMut(f64) -> bool) -> bool {
        let inverse = direction.recip();
        let mut at = 0;
        while let Some(node) = self.tree.nodes.get(at) {
            let (a, b) = ((node.low - from) * inverse, (node.high - from) * inverse);
            let enters = a.min(b).max_element();
            let leaves = a.max(b).min_element();
            // NaN, where a ray runs in a face of the box, counts as a hit.
            if leaves < enters || leaves < 0.0 {
                at = node.skip as usize;
                continue;
            }
            let run = node.first as usize..(node.first + node.count) as usize;
            if self.triangles[run]
                .iter()
                .filter_map(|triangle| meets(triangle, from, direction))
                .any(|meeting| ends(meeting.0))
            {
                return true;
            }
            at += 1;
        }
        false
    }
}

/// Distance at which a ray meets a triangle (Moeller and Trumbore 1997), from either side, and the weights of its second and third corner.
fn meets([corner, first, second]: &[DVec3; 3], from: DVec3, direction: DVec3) -> Option<(f64, f64, f64)> {
    let p = direction.cross(*second);
    let determinant = first.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let to = from - *corner;
    let u = to.dot(p) / determinant;
    let q = to.cross(*first);
    let v = direction.dot(q) / determinant;
    let distance = second.dot(q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some((distance, u, v))
}
