//! Splits triangles at vertices that lie within their edges, so that a surface conducts across T-junctions.
//!
//! Programs that divide faces one by one leave such vertices: one long edge of a triangle lies along several edges of others. Conduction follows vertices that two triangles share, so it
//! would end there. Edges count that only one triangle of a part and material has, and that lie along another such edge.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::Model;
use super::alike::places;
use super::faces::ends;

/// Distance from an edge that is rounding, over the diagonal of the craft: some units in the last place of an f32.
const ROUNDING: f64 = 5e-7;
/// Cells of the grid of vertices along the diagonal, at most.
const CELLS: f64 = 256.0;

/// An edge that only one triangle has.
#[derive(Clone, Copy)]
struct OpenEdge {
    triangle: usize,
    /// Vertices and places of its ends.
    vertices: [u32; 2],
    places: [u32; 2],
}

impl Model {
    /// Splits triangles of parts and materials that count at vertices of the same part and material within their open edges. Returns how many triangles were split.
    pub(crate) fn split_at_hanging_vertices(&mut self, counts: impl Fn(u32) -> bool) -> usize {
        let (place_of, count) = places(&self.positions);
        let mut points = vec![DVec3::ZERO; count];
        place_of.iter().zip(&self.positions).for_each(|(place, position)| points[*place as usize] = *position);
        let within = ROUNDING * self.diagonal();
        let mut split = BTreeSet::new();
        for edges in self.open_edges(&place_of, counts).into_values() {
            let finder = HangingPlaces::new(&points, &edges, within);
            // The pieces of a split triangle have its other edges whole, so these are looked for in them.
            let mut pieces_of: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
            for open in &edges {
                let hanging = finder.on(open);
                if hanging.is_empty() {
                    continue;
                }
                let pieces = pieces_of.entry(open.triangle).or_insert_with(|| vec![open.triangle]);
                let has_edge = |piece: &usize| {
                    let corners = &self.triangles[*piece];
                    (0..3).find(|edge| ends(corners, *edge) == open.vertices)
                };
                let Some((piece, edge)) = pieces.iter().find_map(|piece| Some((*piece, has_edge(piece)?))) else {
                    continue;
                };
                split.insert(open.triangle);
                let first = self.triangles.len();
                self.fan(piece, edge, &hanging, &points);
                pieces.extend(first..self.triangles.len());
            }
        }
        split.len()
    }

    /// The edges that only one triangle of a part and material has.
    fn open_edges(&self, place_of: &[u32], counts: impl Fn(u32) -> bool) -> BTreeMap<[u32; 2], Vec<OpenEdge>> {
        let mut all = Vec::new();
        for (triangle, corners) in self.triangles.iter().enumerate() {
            let first = corners[0] as usize;
            if !counts(self.vertex_material[first]) {
                continue;
            }
            let owner = [self.vertex_part[first], self.vertex_material[first]];
            for edge in 0..3 {
                let vertices = ends(corners, edge);
                let places = vertices.map(|vertex| place_of[vertex as usize]);
                let [a, b] = places;
                if a != b {
                    all.push((owner, [a.min(b), a.max(b)], OpenEdge { triangle, vertices, places }));
                }
            }
        }
        all.sort_by_key(|(owner, pair, open)| (*owner, *pair, open.triangle));
        let mut open: BTreeMap<[u32; 2], Vec<OpenEdge>> = BTreeMap::new();
        for same in all.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1)) {
            if let [(owner, _, edge)] = same {
                open.entry(*owner).or_default().push(*edge);
            }
        }
        open
    }

    /// Splits a triangle along an edge into triangles around the corner across from it. The vertices are given by the places where they lie, from the first end of the edge to the second.
    fn fan(&mut self, triangle: usize, edge: usize, hanging: &[u32], points: &[DVec3]) {
        let corners = self.triangles[triangle];
        let [from, to] = ends(&corners, edge);
        let tip = corners[(edge + 2) % 3];
        let [start, end] = [from, to].map(|vertex| self.positions[vertex as usize]);
        let mut along = vec![from];
        for place in hanging {
            let at = points[*place as usize];
            let share = ((at - start).dot(end - start) / (end - start).length_squared()).clamp(0.0, 1.0) as f32;
            let [one, other] = [from, to].map(|vertex| self.normals[vertex as usize]);
            along.push(self.positions.len() as u32);
            self.positions.push(at);
            self.normals.push(one.lerp(other, share).try_normalize().unwrap_or(one));
            self.vertex_part.push(self.vertex_part[from as usize]);
            self.vertex_material.push(self.vertex_material[from as usize]);
        }
        along.push(to);
        let pieces: Vec<[u32; 3]> = along.windows(2).map(|pair| [pair[0], pair[1], tip]).collect();
        self.triangles[triangle] = pieces[0];
        self.triangles.extend(&pieces[1..]);
    }
}

/// The ends of open edges, in a grid.
struct HangingPlaces<'a> {
    points: &'a [DVec3],
    /// Distance that is rounding [m].
    within: f64,
    /// Side of a cell [m].
    side: f64,
    cells: BTreeMap<[i64; 3], Vec<u32>>,
    /// The other ends of the open edges of each place.
    others: BTreeMap<u32, Vec<u32>>,
}

impl<'a> HangingPlaces<'a> {
    fn new(points: &'a [DVec3], edges: &[OpenEdge], within: f64) -> Self {
        let mut others: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for OpenEdge { places: [a, b], .. } in edges {
            others.entry(*a).or_default().push(*b);
            others.entry(*b).or_default().push(*a);
        }
        let lengths =
            edges.iter().map(|edge| edge.places.map(|place| points[place as usize])).map(|[a, b]| a.distance(b));
        let side = (lengths.sum::<f64>() / edges.len().max(1) as f64).max(within / ROUNDING / CELLS);
        let mut cells: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
        for place in others.keys() {
            cells.entry((points[*place as usize] / side).floor().as_i64vec3().to_array()).or_default().push(*place);
        }
        Self { points, within, side, cells, others }
    }

    /// Places within an edge at which another open edge lies along it, in order.
    fn on(&self, open: &OpenEdge) -> Vec<u32> {
        let [from, to] = open.places;
        let [start, end] = [from, to].map(|place| self.points[place as usize]);
        let (way, length) = ((end - start).normalize_or_zero(), start.distance(end));
        // Distance along the edge and from its line.
        let seen = |place: u32| {
            let to = self.points[place as usize] - start;
            let along = to.dot(way);
            (along, (to - along * way).length())
        };
        let is_within =
            |(along, off): (f64, f64)| off <= self.within && along > self.within && along < length - self.within;
        let lies_along = |place: u32, along: f64| {
            self.others[&place].iter().any(|other| {
                let (end, off) = seen(*other);
                let overlap = along.max(end).min(length) - along.min(end).max(0.0);
                off <= self.within && overlap > self.within
            })
        };
        let corner = |point: DVec3, by: f64| ((point + by) / self.side).floor().as_i64vec3();
        let [low, high] = [corner(start.min(end), -self.within), corner(start.max(end), self.within)];
        let mut found = Vec::new();
        let mut take = |places: &[u32]| {
            for place in places {
                let at = seen(*place);
                if is_within(at) && lies_along(*place, at.0) {
                    found.push((at.0, *place));
                }
            }
        };
        let size = (high - low + 1).as_dvec3();
        if size.x * size.y * size.z > self.cells.len() as f64 {
            self.cells.values().for_each(|places| take(places));
        } else {
            for x in low.x..=high.x {
                for y in low.y..=high.y {
                    for z in low.z..=high.z {
                        self.cells.get(&[x, y, z]).into_iter().for_each(|places| take(places));
                    }
                }
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.into_iter().map(|(_, place)| place).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// A square: the left half is one quad, the right half has `pieces` of them.
    fn halves(pieces: u32, parts: [u32; 2]) -> Model {
        let mut model = Model::default();
        let mut quad = |x: [f64; 2], y: [f64; 2], part: u32| {
            let first = model.positions.len() as u32;
            for (u, v) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                model.positions.push(DVec3::new(x[u], y[v], 0.3));
                model.normals.push(Vec3::Z);
                model.vertex_part.push(part);
                model.vertex_material.push(0);
            }
            model.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        };
        quad([0.0, 0.5], [0.0, 1.0], parts[0]);
        for piece in 0..pieces {
            let [low, high] = [piece, piece + 1].map(|end| f64::from(end) / f64::from(pieces));
            quad([0.5, 1.0], [low, high], parts[1]);
        }
        model.weld()
    }

    fn area(model: &Model) -> f64 {
        (0..model.triangles.len()).map(|triangle| model.triangle_area(triangle)).sum()
    }

    #[test]
    fn an_edge_is_split_at_each_vertex_of_its_part_that_lies_on_it() {
        for pieces in [2, 3, 7] {
            let mut model = halves(pieces, [0; 2]);
            assert_eq!(model.split_at_hanging_vertices(|_| true), 1);
            let model = model.weld();
            assert!((area(&model) - 1.0).abs() < 1e-12);
            // One quad more has two more places, and each vertex on the seam one more triangle.
            assert_eq!(model.triangles.len() as u32, 2 + 2 * pieces + pieces - 1);
            assert_eq!(model.positions.len() as u32, 4 + 2 * pieces);
            assert_eq!(model.clone().split_at_hanging_vertices(|_| true), 0, "nothing hangs any more");
        }
    }

    #[test]
    fn other_parts_and_materials_that_do_not_count_stay() {
        assert_eq!(halves(3, [0, 1]).split_at_hanging_vertices(|_| true), 0);
        assert_eq!(halves(3, [0, 0]).split_at_hanging_vertices(|_| false), 0);
    }

    /// A triangle that touches an edge with a corner alone shares no length of it.
    #[test]
    fn a_corner_that_touches_an_edge_splits_nothing() {
        let mut model = halves(1, [0; 2]);
        let first = model.positions.len() as u32;
        for at in [DVec3::new(0.0, 0.4, 0.3), DVec3::new(-0.5, 0.2, 0.3), DVec3::new(-0.5, 0.6, 0.3)] {
            model.positions.push(at);
            model.normals.push(Vec3::Z);
            model.vertex_part.push(0);
            model.vertex_material.push(0);
        }
        model.triangles.push([first, first + 2, first + 1]);
        assert_eq!(model.split_at_hanging_vertices(|_| true), 0);
    }

    /// Both long edges of a triangle may have vertices of others.
    #[test]
    fn two_edges_of_a_triangle_are_split() {
        let mut model = halves(3, [0; 2]);
        let mut quad = |low: f64, high: f64| {
            let first = model.positions.len() as u32;
            for [x, y] in [[low, -0.5], [high, -0.5], [high, 0.0], [low, 0.0]] {
                model.positions.push(DVec3::new(x, y, 0.3));
                model.normals.push(Vec3::Z);
                model.vertex_part.push(0);
                model.vertex_material.push(0);
            }
            model.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        };
        quad(0.0, 0.2);
        quad(0.2, 0.5);
        let mut model = model.weld();
        assert_eq!(model.split_at_hanging_vertices(|_| true), 1);
        let model = model.weld();
        assert!((area(&model) - 1.25).abs() < 1e-12);
        assert_eq!(model.triangles.len(), 2 + 6 + 4 + 3);
        assert_eq!(model.clone().split_at_hanging_vertices(|_| true), 0);
    }
}
