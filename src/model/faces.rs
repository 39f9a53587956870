//! Finds the edges of thin triangles inside flat faces, and flips them so that triangles become wide.
//!
//! A flip gives two triangles the other diagonal. It moves no vertex, and the surface stays. Flips end where the two angles across each edge add up to at most 180 deg (Lawson, "Software
//! for C1 surface interpolation", Mathematical Software III, 1977).

use std::iter::repeat_n;

use glam::DVec3;
use rayon::prelude::*;

use super::Model;

/// Marks an edge that is not inside a face.
const BORDER: u32 = u32::MAX;
/// Height over longest edge below which a triangle is thin: half of a rectangle that is 4.3 times as long as wide.
const THIN: f64 = 0.22;
/// Cosine of the largest angle between triangles of a flat face, 0.1 deg. Facets of a round body differ by more.
const FLAT: f64 = 1.0 - 1.5e-6;
/// Distances from a plane up to this are rounding, over the diagonal of the craft: a unit in the last place of an f32.
const ROUNDING: f64 = 1e-7;
/// Sum of two cotangents that is rounding.
const SQUARE: f64 = 1e-6;

/// The edges inside flat faces. Edge `3 t + k` is edge `k` of triangle `t`.
pub(super) struct Faces {
    /// Whether each triangle was thin once, or came from one that was.
    thin: Vec<bool>,
    /// The same edge in the triangle on its other side, or `BORDER`. Empty where no triangle is thin.
    across: Vec<u32>,
    /// Distances from a plane up to this are rounding [m].
    within: f64,
}

impl Faces {
    pub(super) fn new(model: &Model) -> Self {
        let thin = vec![false; model.triangles.len()];
        Self { thin, across: Vec::new(), within: ROUNDING * model.diagonal() }
    }

    /// Finds the edges that two triangles of a flat face have in common, with both vertices. One of the two is thin and `open`, or a piece of such a triangle, and no third triangle has the
    /// edge. `place_of` has the place of each vertex, counted from 0, and `places` is their number.
    pub(super) fn find(
        &mut self,
        model: &Model,
        (place_of, places): (&[u32], usize),
        open: impl Fn(&[u32; 3]) -> bool + Sync,
    ) {
        let thin = &mut self.thin;
        let triangles = thin.par_iter_mut().zip(&model.triangles);
        triangles.for_each(|(thin, triangle)| *thin = *thin || open(triangle) && model.is_thin(triangle));
        self.across.clear();
        // Edges have 32 bits. Triangles of a larger mesh are halved as they are.
        if !thin.contains(&true) || 3 * thin.len() > BORDER as usize {
            return;
        }
        let mut beside = vec![false; places];
        for (corners, _) in model.triangles.iter().zip(&*thin).filter(|(_, thin)| **thin) {
            corners.iter().for_each(|vertex| beside[place_of[*vertex as usize] as usize] = true);
        }
        let of_triangle = |(triangle, corners): (usize, &[u32; 3])| {
            let places = corners.map(|vertex| place_of[vertex as usize]);
            (0..3).map(move |edge| (ends(&places, edge), (3 * triangle + edge) as u32))
        };
        let near = |([a, b], _): &([u32; 2], u32)| beside[*a as usize] && beside[*b as usize];
        let all = model.triangles.par_iter().enumerate().flat_map_iter(of_triangle).filter(near);
        let mut edges: Vec<([u32; 2], u32)> = all.map(|([a, b], edge)| ([a.min(b), a.max(b)], edge)).collect();
        edges.par_sort_unstable();
        self.across.resize(3 * thin.len(), BORDER);
        for same in edges.chunk_by(|a, b| a.0 == b.0) {
            if let [(_, one), (_, other)] = *same
                && (thin[one as usize / 3] || thin[other as usize / 3])
                && model.is_flat(one, other, self.within)
            {
                (self.across[one as usize], self.across[other as usize]) = (other, one);
            }
        }
    }

    /// Follows the triangles that were split along marked edges: pieces of a thin one count as thin.
    pub(super) fn split(&mut self, marks: &[u8]) {
        let pieces = |(thin, marks): (&bool, &u8)| repeat_n(*thin, 1 + marks.count_ones() as usize);
        self.thin = self.thin.iter().zip(marks).flat_map(pieces).collect();
    }

    /// The edges of a triangle that are not inside a face, as bits.
    pub(super) fn borders(&self, triangle: usize) -> u8 {
        let is_border = |edge: usize| self.across.get(3 * triangle + edge).is_none_or(|beyond| *beyond == BORDER);
        (0..3).fold(0, |borders, edge| borders | u8::from(is_border(edge)) << edge)
    }

    /// Flips edges inside faces until the two angles across each add up to at most 180 deg.
    pub(super) fn flip(&mut self, model: &mut Model) {
        let inside = self.across.iter().zip(0u32..).filter(|(other, _)| **other != BORDER);
        let waiting = inside.map(|(_, edge)| edge).collect();
        self.flip_from(model, waiting, |_| ());
    }

    /// Halves edges inside faces that are too long, each where it is the longest edge of both its triangles, and flips after each round. `long` says which edges of a triangle are too long,
    /// as bits. Each middle is a new vertex and a new place.
    ///
    /// # Errors
    /// The number of vertices, if it would exceed `limit`, or if edges would exceed 32 bits.
    pub(super) fn halve(
        &mut self,
        model: &mut Model,
        long: impl Fn(&Model, &[u32; 3]) -> u8 + Sync,
        limit: usize,
    ) -> Result<(), usize> {
        // Later rounds look only at triangles that changed.
        let mut changed: Vec<u32> = (0..self.across.len() as u32 / 3).collect();
        loop {
            let longest = |triangle: u32| 3 * triangle + model.longest_edge(&model.triangles[triangle as usize]) as u32;
            let chosen = |triangle: &u32| {
                let one = longest(*triangle);
                let other = self.across[one as usize];
                let is_long = || long(model, &model.triangles[*triangle as usize]) >> (one % 3) & 1 == 1;
                (other != BORDER && longest(other / 3) == other && is_long()).then_some(one.min(other))
            };
            let mut edges: Vec<u32> = changed.par_iter().filter_map(chosen).collect();
            edges.par_sort_unstable();
            edges.dedup();
            let needed = model.positions.len() + edges.len();
            if edges.is_empty() {
                return Ok(());
            }
            if needed > limit || 3 * (model.triangles.len() + 2 * edges.len()) > BORDER as usize {
                return Err(needed);
            }
            changed = edges.iter().flat_map(|edge| self.halve_edge(model, *edge)).collect();
            let inside = changed.iter().flat_map(|triangle| [0, 1, 2].map(|edge| 3 * triangle + edge)).collect();
            self.flip_from(model, inside, |both| changed.extend(both));
        }
    }

    /// Halves an edge and its two triangles. Returns the four triangles.
    fn halve_edge(&mut self, model: &mut Model, one: u32) -> [u32; 4] {
        let other = self.across[one as usize];
        let ([a, b, c, d], [ad, ca, db, bc]) = (model.quadrilateral(one, other), self.outer(one, other));
        let middle = model.positions.len() as u32;
        model.push_midpoint([a.min(b), a.max(b)]);
        let third = model.triangles.len() as u32;
        let all = [one / 3, other / 3, third, third + 1];
        let [first, second, third, fourth] = all.map(|triangle| 3 * triangle);
        model.triangles[one as usize / 3] = [a, middle, c];
        model.triangles[other as usize / 3] = [b, middle, d];
        model.triangles.extend([[middle, b, c], [middle, a, d]]);
        self.thin.extend([one, other].map(|edge| self.thin[edge as usize / 3]));
        self.across.extend([BORDER; 6]);
        self.join(first, fourth);
        self.join(second, third);
        self.join(first + 1, third + 2);
        self.join(second + 1, fourth + 2);
        for (edge, beyond) in [(first + 2, ca), (second + 2, db), (third + 1, bc), (fourth + 1, ad)] {
            self.join(edge, beyond);
        }
        all
    }

    /// Flips edges, and then those around each flipped one. `changed` gets the two triangles of each.
    fn flip_from(&mut self, model: &mut Model, mut waiting: Vec<u32>, mut changed: impl FnMut([u32; 2])) {
        while let Some(one) = waiting.pop() {
            let other = self.across[one as usize];
            // Flips bring borders and triangles together that were not compared yet.
            if other == BORDER || !model.flips(one, other) || !model.is_flat(one, other, self.within) {
                continue;
            }
            let ([a, b, c, d], outer) = (model.quadrilateral(one, other), self.outer(one, other));
            let [first, second] = [one / 3, other / 3];
            model.triangles[first as usize] = [a, d, c];
            model.triangles[second as usize] = [d, b, c];
            for (edge, beyond) in [3 * first, 3 * first + 2, 3 * second, 3 * second + 1].into_iter().zip(outer) {
                self.join(edge, beyond);
                waiting.push(edge);
            }
            self.join(3 * first + 1, 3 * second + 2);
            changed([first, second]);
        }
    }

    /// What lies beyond the four outer edges of the two triangles at an edge: from a to d, from c to a, from d to b and from b to c, with the corners of `Model::quadrilateral`.
    fn outer(&self, one: u32, other: u32) -> [u32; 4] {
        let at = |edge: u32, next: u32| self.across[(edge - edge % 3 + (edge + next) % 3) as usize];
        [at(other, 1), at(one, 2), at(other, 2), at(one, 1)]
    }

    /// Notes where an edge goes on: in another triangle, or nowhere for a border.
    fn join(&mut self, edge: u32, beyond: u32) {
        self.across[edge as usize] = beyond;
        if beyond != BORDER {
            self.across[beyond as usize] = edge;
        }
    }
}

impl Model {
    /// The corners of the two triangles at an edge: its ends, the third corner of the first triangle, and the third corner of the second.
    fn quadrilateral(&self, one: u32, other: u32) -> [u32; 4] {
        let at = |edge: u32, corner: u32| self.triangles[edge as usize / 3][(edge % 3 + corner) as usize % 3];
        [at(one, 0), at(one, 1), at(one, 2), at(other, 2)]
    }

    /// Their positions [m].
    fn around(&self, one: u32, other: u32) -> [DVec3; 4] {
        self.quadrilateral(one, other).map(|vertex| self.positions[vertex as usize])
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
