//! Splits triangles until no edge is too long. No crack opens, and the surface stays but for rounding.
//!
//! The positions of its two ends alone decide where an edge is split. Both directions give the same bits. So triangles
//! that meet along an edge split it alike, even if they share no vertices, as in glTF meshes at every crease. Parts may
//! have different longest edges. An edge is split if one of its triangles asks for it. A triangle that does not ask
//! also has its longest border split, so that no needles arise (Rivara, International Journal for Numerical Methods in
//! Engineering 20, 1984).
//!
//! Halving keeps the angles of a triangle, so a thin one would end as many slivers. The edges inside a flat face with thin triangles therefore wait until its borders are short. Then they are
//! flipped. One that is still too long is halved where it is the longest edge of both its triangles (Rivara & Inostroza, Engineering with Computers 13, 1997, 28).

use std::cmp::Ordering;

use glam::DVec3;
use rayon::prelude::*;

use super::alike::places;
use super::faces::{Faces, ends};
use super::{Model, ModelError};

const CHUNK: usize = 1 << 16;

/// Midpoints of the edges that one pass splits. Each vertex has a short list of the edges to higher vertices. Memory
/// grows linearly with vertices and split edges.
struct Midpoints {
    /// Start of each vertex's list in `upper`, and the end of the last one.
    starts: Vec<usize>,
    /// The higher vertices of the edges, in ascending order in each list.
    upper: Vec<u32>,
}

impl Midpoints {
    /// Collects the marked edges of all triangles, each once. `name` maps a corner to one of the `vertices`.
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

        // Sorts each list, removes repeats and closes the gaps.
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

    /// Edges as `[lower, higher]` vertex, in the order of the new vertices.
    fn edges(&self) -> impl Iterator<Item = [u32; 2]> {
        let lists = self.starts.windows(2).enumerate();
        lists.flat_map(|(low, range)| self.upper[range[0]..range[1]].iter().map(move |high| [low as u32, *high]))
    }

    fn find(&self, edge: [u32; 2]) -> Option<u32> {
        let [low, high] = ordered(edge);
        let (start, end) = (self.starts[low as usize], self.starts[low as usize + 1]);
        let place = self.upper[start..end].binary_search(&high).ok()?;
        Some((self.starts.len() - 1 + start + place) as u32)
    }

    fn vertex(&self, edge: [u32; 2]) -> u32 {
        self.find(edge).expect("every marked edge was collected")
    }
}

/// Distinct vertex positions. Triangles of two parts meet where they share positions.
struct VertexPlaces {
    of_vertex: Vec<u32>,
    count: usize,
}

impl VertexPlaces {
    /// Names the places of new vertices at midpoints. `shared` has the same midpoints by place.
    fn push(&mut self, midpoints: &Midpoints, shared: &Midpoints) {
        self.of_vertex.reserve_exact(midpoints.upper.len());
        for edge in midpoints.edges() {
            self.of_vertex.push(shared.vertex(edge.map(|vertex| self.of_vertex[vertex as usize])));
        }
        self.count += shared.upper.len();
    }

    /// Gives each of some new vertices a place of its own.
    fn push_alone(&mut self, vertices: usize) {
        self.of_vertex.extend((self.count..self.count + vertices).map(|place| place as u32));
        self.count += vertices;
    }
}

fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}

impl Model {
    /// Halves edges longer than `max_edge` [m] until none is left. Thin triangles of a flat face may get its other
    /// diagonals.
    ///
    /// Area, volume, materials and parts stay. Normals are interpolated. A quadrilateral is cut along its shorter
    /// diagonal. Triangles that share both vertices of an edge also share the new one. `progress` gets the number of
    /// vertices after each pass. An edge whose ends are neighbours in f64 stays.
    ///
    /// # Errors
    /// [`ModelError::MaxEdge`] if `max_edge` is not positive and finite. [`ModelError::TooManyVertices`] if the result
    /// would exceed `vertex_limit` or 32 bits. Both come before memory is allocated.
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

    /// Like `subdivide`, with a longest edge for each part [m]. An infinite length asks for nothing. Shared edges
    /// follow the finer part.
    ///
    /// # Errors
    /// As for `subdivide`, but a longest edge may be infinite.
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
        let extent = self.extent();
        let too_many = |path, needed| ModelError::TooManyVertices { path, extent, max_edge: finest, needed, limit };
        // A triangle with edges of `max_edge` covers at most sqrt(3)/4 of its square. A mesh has at least a quarter as
        // many vertices as triangles. This estimate refuses edges that are far too short.
        let triangles_needed = |(index, triangle): (usize, &[u32; 3])| {
            let max_edge = max_edges[self.vertex_part[triangle[0] as usize] as usize];
            self.triangle_area(index) / (max_edge * max_edge * 3.0_f64.sqrt() / 4.0)
        };
        let least = self.triangles.iter().enumerate().map(triangles_needed).sum::<f64>() / 4.0;
        if least > limit as f64 {
            return Err(too_many(self.source, least as usize));
        }
        let long_edges = |model: &Self, triangle: &[u32; 3]| {
            model.long_edges(triangle, max_edges[model.vertex_part[triangle[0] as usize] as usize])
        };
        let mut asks = vec![false; self.parts.len()];
        for triangle in self.triangles.iter().filter(|triangle| long_edges(&self, triangle) != 0) {
            asks[self.vertex_part[triangle[0] as usize] as usize] = true;
        }
        if !asks.contains(&true) {
            return Ok(self);
        }
        let (of_vertex, count) = places(&self.positions);
        let mut places = VertexPlaces { of_vertex, count };
        let mut faces = Faces::new(&self);
        loop {
            let is_open = |triangle: &[u32; 3]| asks[self.vertex_part[triangle[0] as usize] as usize];
            faces.find(&self, (&places.of_vertex, places.count), is_open);
            faces.flip(&mut self);
            let borders = |(number, triangle): (usize, &[u32; 3])| long_edges(&self, triangle) & faces.borders(number);
            let mut marks: Vec<u8> = self.triangles.par_iter().enumerate().map(borders).collect();
            let before = self.positions.len();
            if marks.par_iter().all(|marks| *marks == 0) {
                faces.halve(&mut self, long_edges, limit).map_err(|needed| too_many(self.source.clone(), needed))?;
                if self.positions.len() == before {
                    return Ok(self);
                }
                places.push_alone(self.positions.len() - before);
            } else {
                let shared = self.agree(&places, &faces, &mut marks);
                let midpoints = Midpoints::collect(before, &self.triangles, &marks, |vertex| vertex);
                let needed = before + midpoints.upper.len();
                if needed > limit {
                    return Err(too_many(self.source, needed));
                }
                places.push(&midpoints, &shared);
                self.push_midpoints(&midpoints);
                self.split(&midpoints, &marks);
                faces.split(&marks);
            }
            progress(self.positions.len());
        }
    }

    /// Copies marks between triangles that meet. Marks the longest border of each triangle that is split for a neighbour.
    /// Returns the marked edges by place.
    fn agree(&self, places: &VertexPlaces, faces: &Faces, marks: &mut [u8]) -> Midpoints {
        loop {
            let name = |vertex: u32| places.of_vertex[vertex as usize];
            let shared = Midpoints::collect(places.count, &self.triangles, marks, name);
            let changed = self
                .triangles
                .par_iter()
                .zip(marks.par_iter_mut())
                .enumerate()
                .map(|(number, (triangle, marks))| {
                    let before = *marks;
                    for edge in (0..3).filter(|edge| before >> edge & 1 == 0) {
                        let split = shared.find(ends(triangle, edge).map(name)).is_some();
                        *marks |= u8::from(split) << edge;
                    }
                    if *marks != before {
                        let borders = faces.borders(number);
                        let longest = self.longest_of(triangle, (0..3).filter(|edge| borders >> edge & 1 == 1));
                        *marks |= 1 << longest.unwrap_or_else(|| self.longest_edge(triangle));
                    }
                    *marks != before
                })
                .reduce(|| false, |a, b| a | b);
            if !changed {
                return shared;
            }
        }
    }

    /// The longest edge that can be halved. The positions of the ends decide between equal edges, independent of
    /// direction.
    pub(super) fn longest_edge(&self, triangle: &[u32; 3]) -> usize {
        self.longest_of(triangle, 0..3).unwrap_or(0)
    }

    /// The same among some edges.
    fn longest_of(&self, triangle: &[u32; 3], edges: impl Iterator<Item = usize>) -> Option<usize> {
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
        edges.max_by(compare)
    }

    /// Bit `k` is set if edge `k` is too long. Lengths are compared, because squares could underflow.
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
        midpoints.edges().for_each(|edge| self.push_midpoint(edge));
    }

    /// Appends the vertex in the middle of an edge from a lower to a higher vertex.
    pub(super) fn push_midpoint(&mut self, edge: [u32; 2]) {
        let [a, b] = edge.map(|vertex| vertex as usize);
        self.positions.push(middle(self.positions[a], self.positions[b]));
        // Opposite normals have no mean, so the lower vertex's normal is used.
        self.normals.push((self.normals[a] + self.normals[b]).try_normalize().unwrap_or(self.normals[a]));
        self.vertex_part.push(self.vertex_part[a]);
        self.vertex_material.push(self.vertex_material[a]);
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

    /// Writes the pieces of some triangles to `piece`, which has the exact length.
    fn split_into(&self, midpoints: &Midpoints, triangles: &[[u32; 3]], marks: &[u8], piece: &mut [[u32; 3]]) {
        let mut places = piece.iter_mut();
        let mut put = |triangles: &[[u32; 3]]| {
            for (place, triangle) in places.by_ref().take(triangles.len()).zip(triangles) {
                *place = *triangle;
            }
        };
        for (triangle, marks) in triangles.iter().zip(marks) {
            // Rotates the corners so that the marked edges come first. With two marked edges, b lies between them.
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

    /// Whether the first diagonal is shorter. Positions decide between equal ones, so that both faces of a sheet split
    /// alike.
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

/// The midpoint. Both directions give the same bits, because addition commutes.
fn middle(a: DVec3, b: DVec3) -> DVec3 {
    0.5 * (a + b)
}

/// Whether the middle differs from both ends. Otherwise f64 has no point between them.
fn is_between(a: DVec3, middle: DVec3, b: DVec3) -> bool {
    middle != a && middle != b
}

fn lexicographic(a: &[f64], b: &[f64]) -> Ordering {
    a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}
