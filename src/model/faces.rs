//! Finds the edges of thin triangles inside flat faces, and flips them so that triangles become wide.
//!
//! A flip gives two triangles the other diagonal. It moves no vertex, and the surface stays. Flips end where the two angles across each edge add up to at most 180 deg (Lawson, "Software
//! for C1 surface interpolation", Mathematical Software III, 1977).

use glam::DVec3;
use rayon::prelude::*;

use super::Model;

/// Marks an edge that is not inside a face.
const BORDER: u32 = u32::MAX;
/// Height over longest edge below which a triangle is thin: half of a rectangle that is 4.3 times as long as wide.
const THIN: f64 = 0.22;
/// Cosine of the largest angle between triangles of a flat face, 0.1 deg. Facets of a round body differ by more.
const FLAT: f64 = 1.0 - 1.5e-6;
/// Distance from a plane that is rounding, over the diagonal of the craft: a unit in the last place of an f32.
const ROUNDING: f64 = 1e-7;
/// Sum of two cotangents that is rounding.
const SQUARE: f64 = 1e-6;

/// The edges inside flat faces. Edge `3 t + k` is edge `k` of triangle `t`.
pub(super) struct Faces {
    /// The same edge in the triangle on its other side, or `BORDER`. Empty where no triangle is thin.
    across: Vec<u32>,
}

impl Faces {
    /// Faces of which no edge is inside.
    fn none() -> Self {
        Self { across: Vec::new() }
    }

    /// Finds the edges that two triangles of a flat face have in common, with both vertices. One of the two is thin and `open`, and no third triangle has the edge. `place_of` has the place
    /// of each vertex, counted from 0, and `places` is their number.
    pub(super) fn find(
        model: &Model,
        (place_of, places): (&[u32], usize),
        open: impl Fn(&[u32; 3]) -> bool + Sync,
    ) -> Self {
        let thin: Vec<bool> =
            model.triangles.par_iter().map(|triangle| open(triangle) && model.is_thin(triangle)).collect();
        // Edges have 32 bits. Triangles of a larger mesh are halved as they are.
        if !thin.contains(&true) || 3 * model.triangles.len() > BORDER as usize {
            return Self::none();
        }
        let mut beside = vec![false; places];
        for (corners, _) in model.triangles.iter().zip(&thin).filter(|(_, thin)| **thin) {
            corners.iter().for_each(|vertex| beside[place_of[*vertex as usize] as usize] = true);
        }
        let edges = || {
            let all = model.triangles.iter().zip(0u32..).flat_map(|(corners, triangle)| {
                (0..3u32).map(move |edge| {
                    let [a, b] = ends(corners, edge as usize).map(|vertex| place_of[vertex as usize]);
                    (a.min(b), a.max(b), 3 * triangle + edge)
                })
            });
            all.filter(|(low, high, _)| beside[*low as usize] && beside[*high as usize])
        };
        // For each place the edges to higher places.
        let mut starts = vec![0usize; places + 1];
        for (low, ..) in edges() {
            starts[low as usize + 1] += 1;
        }
        for place in 0..places {
            starts[place + 1] += starts[place];
        }
        let mut lists = vec![[0u32; 2]; starts[places]];
        let mut next = starts.clone();
        for (low, high, edge) in edges() {
            lists[next[low as usize]] = [high, edge];
            next[low as usize] += 1;
        }
        let within = ROUNDING * model.diagonal();
        let mut across = vec![BORDER; 3 * model.triangles.len()];
        for range in starts.windows(2) {
            let list = &mut lists[range[0]..range[1]];
            list.sort_unstable();
            for same in list.chunk_by(|a, b| a[0] == b[0]) {
                if let [[_, one], [_, other]] = *same
                    && (thin[one as usize / 3] || thin[other as usize / 3])
                    && model.is_flat(one, other, within)
                {
                    (across[one as usize], across[other as usize]) = (other, one);
                }
            }
        }
        Self { across }
    }

    /// The other triangle of an edge inside a face.
    pub(super) fn beyond(&self, triangle: usize, edge: usize) -> Option<usize> {
        self.across.get(3 * triangle + edge).filter(|edge| **edge != BORDER).map(|edge| *edge as usize / 3)
    }

    /// Flips edges inside faces until the two angles across each add up to at most 180 deg.
    pub(super) fn flip(&mut self, model: &mut Model) {
        let within = ROUNDING * model.diagonal();
        let inside = self.across.iter().zip(0u32..).filter(|(other, _)| **other != BORDER);
        let mut waiting: Vec<u32> = inside.map(|(_, edge)| edge).collect();
        while let Some(one) = waiting.pop() {
            let other = self.across[one as usize];
            // Flips bring borders and triangles together that were not compared yet.
            if other == BORDER || !model.flips(one, other) || !model.is_flat(one, other, within) {
                continue;
            }
            let [[first, e], [second, f]] = [one, other].map(|edge| [edge / 3, edge % 3]);
            let corner = |triangle: u32, at: u32| model.triangles[triangle as usize][at as usize % 3];
            let [a, b, c, d] = [corner(first, e), corner(first, e + 1), corner(first, e + 2), corner(second, f + 2)];
            let outer = |triangle: u32, at: u32| self.across[(3 * triangle + at % 3) as usize];
            let beyond = [outer(second, f + 1), outer(first, e + 2), outer(second, f + 2), outer(first, e + 1)];
            model.triangles[first as usize] = [a, d, c];
            model.triangles[second as usize] = [d, b, c];
            let edges = [3 * first, 3 * first + 2, 3 * second, 3 * second + 1];
            for (edge, beyond) in edges.into_iter().zip(beyond) {
                self.across[edge as usize] = beyond;
                if beyond != BORDER {
                    self.across[beyond as usize] = edge;
                    waiting.push(edge);
                }
            }
            (self.across[3 * first as usize + 1], self.across[3 * second as usize + 2]) =
                (3 * second + 2, 3 * first + 1);
        }
    }
}

impl Model {
    /// The corners of the two triangles at an edge: its ends, the third corner of the first triangle, and the third corner of the second.
    fn around(&self, one: u32, other: u32) -> [DVec3; 4] {
        let at = |edge: u32, corner: u32| {
            self.positions[self.triangles[edge as usize / 3][(edge % 3 + corner) as usize % 3] as usize]
        };
        [at(one, 0), at(one, 1), at(one, 2), at(other, 2)]
    }

    fn is_thin(&self, triangle: &[u32; 3]) -> bool {
        let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize]);
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        (b - a).cross(c - a).length() < THIN * longest
    }

    /// Whether the triangles at an edge share its vertices, face one way, and lie in one plane but for `within` [m].
    fn is_flat(&self, one: u32, other: u32, within: f64) -> bool {
        let [[a, b], [c, d]] = [one, other].map(|edge| ends(&self.triangles[edge as usize / 3], edge as usize % 3));
        if [a, b] != [d, c] {
            return false;
        }
        let [a, b, c, d] = self.around(one, other);
        let [first, second] = [(b - a).cross(c - a), (d - a).cross(b - a)];
        let product = first.length() * second.length();
        let off = |normal: DVec3, from: DVec3| normal.dot(from).abs() / normal.length();
        product > 0.0 && first.dot(second) > FLAT * product && off(first, d - a).max(off(second, c - a)) <= within
    }

    /// Whether the other diagonal of the two triangles at an edge is better, and lies inside them.
    fn flips(&self, one: u32, other: u32) -> bool {
        let [a, b, c, d] = self.around(one, other);
        let normal = (b - a).cross(c - a);
        let angle = |at: DVec3| (a - at).dot(b - at) / (a - at).cross(b - at).length();
        let faces = |p: DVec3, q: DVec3, r: DVec3| (q - p).cross(r - p).dot(normal) > 0.0;
        angle(c) + angle(d) < -SQUARE && faces(a, d, c) && faces(d, b, c)
    }
}

/// Edge number `edge` of a triangle: from that corner to the next.
pub(super) fn ends(triangle: &[u32; 3], edge: usize) -> [u32; 2] {
    [triangle[edge], triangle[(edge + 1) % 3]]
}
