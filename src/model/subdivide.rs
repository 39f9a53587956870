//! Splits triangles until no edge is longer than asked, without a crack and without moving the surface.
//!
//! Whether an edge is split, and where, depends on the positions of its two ends alone, and gives the same bits from
//! either end. So triangles that meet along an edge split it alike even where they share no vertices, as glTF meshes do
//! at every crease: the mesh stays conforming. Where parts have their own longest edges, an edge is split when one of the
//! triangles that have it asks for it; one that does not ask has its longest edge split as well, so that the fine mesh
//! turns into the coarse one without needles (Rivara, International Journal for Numerical Methods in Engineering 20, 1984).

use std::cmp::Ordering;

use glam::DVec3;
use rayon::prelude::*;

use super::alike::places;
use super::{Model, ModelError};

/// Triangles that are split by one task.
const CHUNK: usize = 1 << 16;

/// Midpoints of the edges that one pass splits. Edges are kept with their lower vertex, in a list for each such vertex,
/// so that a lookup scans a few entries; memory is linear in vertices and split edges.
struct Midpoints {
    /// Where the list of each vertex starts in `upper`; one entry more than there are vertices.
    starts: Vec<usize>,
    /// The higher vertices of the edges, ascending in each list.
    upper: Vec<u32>,
}

impl Midpoints {
    /// Collects the marked edges of all triangles, each once. `name` tells which of the `vertices` a corner is.
    fn collect(vertices: usize, triangles: &[[u32; 3]], marks: &[u8], name: impl Fn(u32) -> u32 + Copy) -> Self {
        let marked = || {
            let edges = triangles.iter().zip(marks);
            edges.flat_map(move |(triangle, marks)| {
                let marked = (0..3).filter(move |edge| marks >> edge & 1 == 1);
                marked.map(move |edge| ordered(ends(triangle, edge).map(name)))
            })
        };
        let mut starts = vec![0usize; vertices + 1];
        for [low, _] in marked() {
            starts[low as usize + 1] += 1;
        }
        for vertex in 0..vertices {
            starts[vertex + 1] += starts[vertex];
        }
        let mut upper = vec![0u32; starts[vertices]];
        let mut next = starts.clone();
        for [low, high] in marked() {
            upper[next[low as usize]] = high;
            next[low as usize] += 1;
        }

        // Each list sorted and freed of repeats, all moved up to close the gaps.
        let mut kept = 0;
        let mut start = 0;
        for vertex in 0..vertices {
            let end = starts[vertex + 1];
            upper[start..end].sort_unstable();
            starts[vertex] = kept;
            let mut previous = None;
            for entry in start..end {
                let high = upper[entry];
                if previous != Some(high) {
                    upper[kept] = high;
                    kept += 1;
                }
                previous = Some(high);
            }
            start = end;
        }
        starts[vertices] = kept;
        upper.truncate(kept);
        Self { starts, upper }
    }

    /// Edges as `[lower, higher]` vertex, in the order of the vertices that they become.
    fn edges(&self) -> impl Iterator<Item = [u32; 2]> {
        let lists = self.starts.windows(2).enumerate();
        lists.flat_map(|(low, range)| self.upper[range[0]..range[1]].iter().map(move |high| [low as u32, *high]))
    }

    /// The vertex in the middle of an edge, where it is marked.
    fn find(&self, edge: [u32; 2]) -> Option<u32> {
        let [low, high] = ordered(edge);
        let (start, end) = (self.starts[low as usize], self.starts[low as usize + 1]);
        let place = self.upper[start..end].binary_search(&high).ok()?;
        Some((self.starts.len() - 1 + start + place) as u32)
    }

    /// The vertex in the middle of a marked edge.
    fn vertex(&self, edge: [u32; 2]) -> u32 {
        self.find(edge).expect("every marked edge was collected")
    }
}

/// Places of vertices while parts of different densities are split: triangles of two parts meet where their places do.
struct Places {
    of_vertex: Vec<u32>,
    count: usize,
}

/// Edge `edge` of a triangle, from corner `edge` to the next.
fn ends(triangle: &[u32; 3], edge: usize) -> [u32; 2] {
    [triangle[edge], triangle[(edge + 1) % 3]]
}

fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}

impl Model {
    /// Splits edges longer than `max_edge` [m] at their middles, again and again until none is left.
    ///
    /// Area, volume, materials and parts stay; normals are interpolated. Of the two diagonals of a quadrilateral the
    /// shorter is taken. A new vertex is shared by the triangles that share the edge's two vertices. After every pass
    /// `progress` is told the number of vertices. An edge that f64 cannot halve (its ends are neighbours) stays.
    ///
    /// # Errors
    /// [`ModelError::MaxEdge`] where `max_edge` is not finite and greater than 0; [`ModelError::TooManyVertices`] where
    /// the result would have more than `vertex_limit` vertices, or more than 32 bits can count. Both before the memory
    /// for them is taken.
    pub fn subdivide(
        self,
        max_edge: f64,
        vertex_limit: usize,
        progress: &mut dyn FnMut(usize),
    ) -> Result<Self, ModelError> {
        if !max_edge.is_finite() {
            return Err(ModelError::MaxEdge(max_edge));
        }
        let all = vec![max_edge; self.parts.len()];
        self.subdivide_parts(&all, vertex_limit, progress)
    }

    /// The same with a longest edge for every part [m]; an infinite one asks for nothing. Where parts meet, the edges that
    /// they share are split as the finer one asks.
    ///
    /// # Errors
    /// As for `subdivide`; a longest edge may be infinite.
    pub fn subdivide_parts(
        mut self,
        max_edges: &[f64],
        vertex_limit: usize,
        progress: &mut dyn FnMut(usize),
    ) -> Result<Self, ModelError> {
        if let Some(wrong) = max_edges.iter().find(|edge| edge.is_nan() || **edge <= 0.0) {
            return Err(ModelError::MaxEdge(*wrong));
        }
        let finest = max_edges.iter().copied().fold(f64::INFINITY, f64::min);
        let limit = vertex_limit.min(u32::MAX as usize);
        let too_many = |path, needed| ModelError::TooManyVertices { path, max_edge: finest, needed, limit };
        // A triangle with edges of `max_edge` covers at most sqrt(3)/4 of its square, and a mesh has at least a quarter as
        // many vertices as triangles: what is far too fine is refused without trying.
        let triangles_needed = |(index, triangle): (usize, &[u32; 3])| {
            let max_edge = max_edges[self.vertex_part[triangle[0] as usize] as usize];
            self.triangle_area(index) / (max_edge * max_edge * 3.0_f64.sqrt() / 4.0)
        };
        let least = self.triangles.iter().enumerate().map(triangles_needed).sum::<f64>() / 4.0;
        if least > limit as f64 {
            return Err(too_many(self.source, least as usize));
        }
        let mut places = max_edges.iter().any(|edge| *edge != finest).then(|| {
            let (of_vertex, count) = places(&self.positions);
            Places { of_vertex, count }
        });
        loop {
            let asks = |triangle: &[u32; 3]| {
                self.long_edges(triangle, max_edges[self.vertex_part[triangle[0] as usize] as usize])
            };
            let mut marks: Vec<u8> = self.triangles.par_iter().map(asks).collect();
            if marks.par_iter().all(|marks| *marks == 0) {
                return Ok(self);
            }
            let shared = places.as_ref().map(|places| self.agree(places, &mut marks));
            let midpoints = Midpoints::collect(self.positions.len(), &self.triangles, &marks, |vertex| vertex);
            let needed = self.positions.len() + midpoints.upper.len();
            if needed > limit {
                return Err(too_many(self.source, needed));
            }
            if let (Some(places), Some(shared)) = (&mut places, shared) {
                let of_vertex = &mut places.of_vertex;
                of_vertex.reserve_exact(midpoints.upper.len());
                for edge in midpoints.edges() {
                    of_vertex.push(shared.vertex(edge.map(|vertex| of_vertex[vertex as usize])));
                }
                places.count += shared.upper.len();
            }
            self.push_midpoints(&midpoints);
            self.split(&midpoints, &marks);
            progress(self.positions.len());
        }
    }

    /// Marks every edge that another triangle has marked in its place, and the longest edge of a triangle that is split for
    /// a neighbour's sake. Returns what is marked, by place.
    fn agree(&self, places: &Places, marks: &mut [u8]) -> Midpoints {
        loop {
            let name = |vertex: u32| places.of_vertex[vertex as usize];
            let shared = Midpoints::collect(places.count, &self.triangles, marks, name);
            let changed = self
                .triangles
                .par_iter()
                .zip(marks.par_iter_mut())
                .map(|(triangle, marks)| {
                    let before = *marks;
                    for edge in (0..3).filter(|edge| before >> edge & 1 == 0) {
                        let split = shared.find(ends(triangle, edge).map(name)).is_some();
                        *marks |= u8::from(split) << edge;
                    }
                    if *marks != before {
                        *marks |= 1 << self.longest_edge(triangle);
                    }
                    *marks != before
                })
                .reduce(|| false, |a, b| a | b);
            if !changed {
                return shared;
            }
        }
    }

    /// The longest edge of a triangle that can be halved; of equal ones that which comes first by its ends' positions, from
    /// whichever side it is seen.
    fn longest_edge(&self, triangle: &[u32; 3]) -> usize {
        let rank = |edge: usize| {
            let [a, b] = ends(triangle, edge).map(|vertex| self.positions[vertex as usize]);
            let mut ends = [a.to_array(), b.to_array()];
            ends.sort_unstable_by(|a, b| lexicographic(a, b));
            (is_between(a, middle(a, b), b), (a - b).length(), ends)
        };
        let compare = |a: &usize, b: &usize| {
            let (a, b) = (rank(*a), rank(*b));
            let by_place = || lexicographic(b.2.as_flattened(), a.2.as_flattened());
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then_with(by_place)
        };
        (0..3).max_by(compare).unwrap_or(0)
    }

    /// Bit `k` is set where edge `k` is too long. Lengths are compared, not squares, which could underflow.
    fn long_edges(&self, triangle: &[u32; 3], max_edge: f64) -> u8 {
        let long = |edge: usize| {
            let [a, b] = ends(triangle, edge).map(|vertex| self.positions[vertex as usize]);
            u8::from((a - b).length() > max_edge && is_between(a, middle(a, b), b))
        };
        (0..3).fold(0, |marks, edge| marks | long(edge) << edge)
    }

    fn push_midpoints(&mut self, midpoints: &Midpoints) {
        let count = midpoints.upper.len();
        self.positions.reserve_exact(count);
        self.normals.reserve_exact(count);
        self.vertex_part.reserve_exact(count);
        self.vertex_material.reserve_exact(count);
        for edge in midpoints.edges() {
            let [a, b] = edge.map(|vertex| vertex as usize);
            self.positions.push(middle(self.positions[a], self.positions[b]));
            // Opposite normals have no mean; the lower vertex's is as good as the other's.
            self.normals.push((self.normals[a] + self.normals[b]).try_normalize().unwrap_or(self.normals[a]));
            self.vertex_part.push(self.vertex_part[a]);
            self.vertex_material.push(self.vertex_material[a]);
        }
    }

    /// Replaces every marked triangle by two, three or four.
    fn split(&mut self, midpoints: &Midpoints, marks: &[u8]) {
        let added = |marks: &[u8]| marks.iter().map(|marks| marks.count_ones() as usize).sum::<usize>();
        let sizes: Vec<usize> = marks.par_chunks(CHUNK).map(|marks| marks.len() + added(marks)).collect();
        let mut triangles = vec![[0; 3]; sizes.iter().sum()];
        let mut rest = triangles.as_mut_slice();
        let mut pieces = Vec::with_capacity(sizes.len());
        for size in sizes {
            let piece;
            (piece, rest) = rest.split_at_mut(size);
            pieces.push(piece);
        }
        let chunks = self.triangles.par_chunks(CHUNK).zip(marks.par_chunks(CHUNK));
        chunks.zip(pieces).for_each(|((triangles, marks), piece)| self.split_into(midpoints, triangles, marks, piece));
        self.triangles = triangles;
    }

    /// Writes what becomes of some triangles to `piece`, which is as long as that.
    fn split_into(&self, midpoints: &Midpoints, triangles: &[[u32; 3]], marks: &[u8], piece: &mut [[u32; 3]]) {
        let mut places = piece.iter_mut();
        let mut put = |triangles: &[[u32; 3]]| {
            for (place, triangle) in places.by_ref().take(triangles.len()).zip(triangles) {
                *place = *triangle;
            }
        };
        for (triangle, marks) in triangles.iter().zip(marks) {
            // The first of the corners from which the marked edges come first: b is between them where there are two.
            let turn = match marks {
                0b010 | 0b110 => 1,
                0b100 | 0b101 => 2,
                _ => 0,
            };
            let [a, b, c] = [0, 1, 2].map(|corner| triangle[(corner + turn) % 3]);
            let middle = |a, b| midpoints.vertex([a, b]);
            match marks.count_ones() {
                0 => put(&[[a, b, c]]),
                1 => {
                    let m = middle(a, b);
                    put(&[[a, m, c], [m, b, c]]);
                }
                2 => {
                    let (m, n) = (middle(a, b), middle(b, c));
                    put(&[[m, b, n]]);
                    if self.prefers([a, n], [m, c]) {
                        put(&[[a, m, n], [a, n, c]]);
                    } else {
                        put(&[[a, m, c], [m, n, c]]);
                    }
                }
                _ => {
                    let (m, n, p) = (middle(a, b), middle(b, c), middle(c, a));
                    put(&[[a, m, p], [m, b, n], [p, n, c], [m, n, p]]);
                }
            }
        }
    }

    /// Whether the first diagonal is the shorter. Where they are equal, positions decide, so that the two faces of a
    /// sheet split alike.
    fn prefers(&self, first: [u32; 2], second: [u32; 2]) -> bool {
        let [first, second] = [first, second].map(|diagonal| {
            let mut ends = diagonal.map(|vertex| self.positions[vertex as usize].to_array());
            ends.sort_unstable_by(|a, b| lexicographic(a, b));
            ends
        });
        let length = |[a, b]: [[f64; 3]; 2]| DVec3::from_array(a).distance(DVec3::from_array(b));
        let by_place = || lexicographic(first.as_flattened(), second.as_flattened());
        length(first).total_cmp(&length(second)).then_with(by_place) == Ordering::Less
    }
}

/// The same bits from either end, because addition commutes.
fn middle(a: DVec3, b: DVec3) -> DVec3 {
    0.5 * (a + b)
}

/// Whether the middle differs from both ends: where it does not, f64 has no point between them.
fn is_between(a: DVec3, middle: DVec3, b: DVec3) -> bool {
    middle != a && middle != b
}

fn lexicographic(a: &[f64], b: &[f64]) -> Ordering {
    a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}
