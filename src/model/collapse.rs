//! Merges vertices along short edges, so that tiny details cost no nodes.
//!
//! The shortest edge goes first. One end moves to the other, and the triangles between them vanish (a half-edge
//! collapse: Schroeder, Zarge & Lorensen, Computer Graphics 26, 1992; Hoppe, SIGGRAPH 1996). All vertices at one place
//! move together, so no crack opens. A corner stays. A vertex on a border or sharp edge moves along it where it is
//! nearly straight. No triangle may turn by more than `MOST_TURNED` or become a needle.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::alike::places;
use super::measure::area_vector;
use super::{Model, ModelError};
use crate::stop::Watch;

/// Cosine of the largest turn of a triangle's normal: 30 deg.
const MOST_TURNED: f64 = 0.866_025_403_784_438_6;

/// Cosine of the angle between two triangles above which their edge counts as sharp: 40 deg.
const SHARP: f64 = 0.766_044_443_118_978;

/// Cosine of the largest bend of a border at a vertex that moves along it: 30 deg.
const MOST_BENT: f64 = MOST_TURNED;

/// Cosine of the largest angle between the normals of vertices that merge: 15 deg.
const SAME_NORMAL: f32 = 0.965_925_8;

/// Quality below which a triangle is a needle. Quality is 4 sqrt(3) x area / sum of squared edges, and 1 for an
/// equilateral triangle.
const NEEDLE: f64 = 0.05;

/// Corners of a triangle that has vanished.
const GONE: [u32; 3] = [u32::MAX; 3];

/// The result of merging.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct MergeSummary {
    /// Number of places that vertices left.
    pub places: usize,
    /// Number of triangles that vanished.
    pub triangles: usize,
    /// Area before and after [m2].
    pub area_m2: [f64; 2],
    /// The part with the largest relative change of area, and its area before and after [m2].
    pub most_changed: Option<(String, [f64; 2])>,
}

/// A collapse that is allowed.
struct Move {
    /// Sum of the absolute changes of area [m2].
    change: f64,
    /// The new vertex for each vertex at the place. Vertices that are not listed move.
    becomes: Vec<(u32, u32)>,
}

struct Collapse<'a> {
    model: &'a mut Model,
    min_edges: &'a [f64],
    place: Vec<u32>,
    /// Position of each place [m].
    at: Vec<DVec3>,
    /// Triangles around each place.
    star: Vec<Vec<u32>>,
    /// Unit normals of the triangles in the file.
    original: Vec<DVec3>,
    /// Edges, shortest first: bits of the length, which sort like lengths, and the two places.
    waiting: BinaryHeap<Reverse<(u64, u32, u32)>>,
    merged: usize,
    vanished: usize,
}

impl Model {
    /// Merges edges shorter than the limit of each part [m]. A limit of 0 merges nothing.
    ///
    /// Every part around the end that moves must ask for the merge. Materials, parts and borders stay. A mesh without
    /// such edges does not change.
    ///
    /// # Errors
    /// [`ModelError::MinEdge`] if a limit is negative or not finite.
    pub fn merge_short_edges(mut self, min_edges: &[f64]) -> Result<(Self, MergeSummary), ModelError> {
        if let Some(wrong) = min_edges.iter().find(|edge| !edge.is_finite() || **edge < 0.0) {
            return Err(ModelError::MinEdge(*wrong));
        }
        let before = self.part_areas();
        let mut collapse = Collapse::new(&mut self, min_edges);
        collapse.run();
        let (places, triangles) = (collapse.merged, collapse.vanished);
        if places > 0 {
            self.triangles.retain(|triangle| *triangle != GONE);
            let mut used = vec![false; self.positions.len()];
            for vertex in self.triangles.as_flattened() {
                used[*vertex as usize] = true;
            }
            self.keep_vertices(|vertex| used[vertex], |vertex| vertex as u32);
            // Vertices that moved may coincide with others.
            self = self.weld();
        }
        let after = self.part_areas();
        let change = |part: &usize| (after[*part] - before[*part]).abs() / before[*part].max(f64::MIN_POSITIVE);
        let most = (0..before.len()).max_by(|a, b| change(a).total_cmp(&change(b))).filter(|_| places > 0);
        let merged = MergeSummary {
            places,
            triangles,
            area_m2: [before.iter().sum(), after.iter().sum()],
            most_changed: most.map(|part| (self.parts[part].name.clone(), [before[part], after[part]])),
        };
        Ok((self, merged))
    }

    /// Area of every part [m2], one side of each triangle.
    fn part_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.parts.len()];
        for (index, triangle) in self.triangles.iter().enumerate() {
            areas[self.vertex_part[triangle[0] as usize] as usize] += self.triangle_area(index);
        }
        areas
    }
}

impl<'a> Collapse<'a> {
    fn new(model: &'a mut Model, min_edges: &'a [f64]) -> Self {
        let (place, count) = places(&model.positions);
        let mut at = vec![DVec3::ZERO; count];
        for (place, position) in place.iter().zip(&model.positions) {
            at[*place as usize] = *position;
        }
        let mut star = vec![Vec::new(); count];
        for (index, triangle) in model.triangles.iter().enumerate() {
            for vertex in triangle {
                let here: &mut Vec<u32> = &mut star[place[*vertex as usize] as usize];
                if here.last() != Some(&(index as u32)) {
                    here.push(index as u32);
                }
            }
        }
        let original = model.triangles.iter().map(|triangle| area_vector(model.corners(*triangle)).normalize_or_zero());
        let original = original.collect();
        let waiting = BinaryHeap::new();
        Self { model, min_edges, place, at, star, original, waiting, merged: 0, vanished: 0 }
    }

    /// Collapses edges, shortest first, until none is left. A collapse may allow one that was refused before.
    fn run(&mut self) {
        let watch = Watch::begin();
        loop {
            for place in 0..self.star.len() as u32 {
                self.wait(place, |neighbour| neighbour > place);
            }
            let before = self.merged;
            while let Some(Reverse((_, a, b))) = self.waiting.pop() {
                watch.look();
                // Either place may have vanished in the meantime.
                if !self.star[a as usize].is_empty() && !self.star[b as usize].is_empty() {
                    self.try_edge(a, b);
                }
            }
            if self.merged == before {
                return;
            }
        }
    }

    /// Queues the short edges between a place and the wanted neighbours.
    fn wait(&mut self, place: u32, wanted: impl Fn(u32) -> bool) {
        let here = self.limit(&self.star[place as usize]);
        for neighbour in self.neighbours(place).into_iter().filter(|neighbour| wanted(*neighbour)) {
            let length = self.at[place as usize].distance(self.at[neighbour as usize]);
            if length < here.max(self.limit(&self.star[neighbour as usize])) {
                let (low, high) = (place.min(neighbour), place.max(neighbour));
                self.waiting.push(Reverse((length.to_bits(), low, high)));
            }
        }
    }

    /// Shortest edge that all parts of some triangles agree on [m].
    fn limit(&self, triangles: &[u32]) -> f64 {
        let part = |triangle: &u32| {
            let corner = self.model.triangles[*triangle as usize][0];
            self.model.vertex_part[corner as usize] as usize
        };
        let least = triangles.iter().map(|triangle| self.min_edges[part(triangle)]).fold(f64::INFINITY, f64::min);
        if triangles.is_empty() { 0.0 } else { least }
    }

    fn places_of(&self, triangle: u32) -> [u32; 3] {
        self.model.triangles[triangle as usize].map(|vertex| self.place[vertex as usize])
    }

    /// Places that share an edge with a place, in ascending order.
    fn neighbours(&self, place: u32) -> Vec<u32> {
        let corners = self.star[place as usize].iter().flat_map(|triangle| self.places_of(*triangle));
        let mut neighbours: Vec<u32> = corners.filter(|other| *other != place).collect();
        neighbours.sort_unstable();
        neighbours.dedup();
        neighbours
    }

    fn try_edge(&mut self, a: u32, b: u32) {
        let both = [(a, b), (b, a)].map(|(from, to)| self.allowed(from, to).map(|change| (change, from, to)));
        let best = both.into_iter().flatten().min_by(|x, y| x.0.change.total_cmp(&y.0.change));
        if let Some((change, from, to)) = best {
            self.apply(from, to, change);
            self.wait(to, |_| true);
        }
    }

    /// Checks whether a place may move to a neighbour. Returns the move.
    fn allowed(&self, from: u32, to: u32) -> Option<Move> {
        let star = &self.star[from as usize];
        let (here, there) = (self.at[from as usize], self.at[to as usize]);
        if here.distance(there) >= self.limit(star) {
            return None;
        }
        let (between, rest): (Vec<u32>, Vec<u32>) =
            star.iter().partition(|triangle| self.places_of(**triangle).contains(&to));
        if between.is_empty() || rest.is_empty() || !self.follows_features(from, to) {
            return None;
        }
        // The link condition: the collapse must not pinch other triangles together.
        let neighbours = self.neighbours(to);
        let opposite = |place: &u32| between.iter().any(|triangle| self.places_of(*triangle).contains(place));
        let common = self.neighbours(from).into_iter().filter(|place| neighbours.binary_search(place).is_ok());
        if !common.into_iter().all(|place| opposite(&place)) {
            return None;
        }
        let moved = |place: u32| if place == from { to } else { place };
        let sorted = |mut places: [u32; 3]| {
            places.sort_unstable();
            places
        };
        let others = self.star[to as usize].iter().filter(|triangle| !between.contains(triangle));
        let taken: Vec<[u32; 3]> = others.map(|triangle| sorted(self.places_of(*triangle))).collect();
        if rest.iter().any(|triangle| taken.contains(&sorted(self.places_of(*triangle).map(moved)))) {
            return None;
        }
        let change = self.change_of_area(&between, &rest, from, to)?;
        Some(Move { change, becomes: self.vertices_after(&between, &rest, from, to) })
    }

    /// Whether a place may leave its borders and sharp edges: it has none, or it moves along two that are nearly one
    /// line.
    fn follows_features(&self, from: u32, to: u32) -> bool {
        let neighbours = self.neighbours(from);
        let features: Vec<u32> = neighbours.into_iter().filter(|place| self.is_feature(from, *place)).collect();
        match features[..] {
            [] => true,
            [a, b] if a == to || b == to => {
                let other = self.at[(if a == to { b } else { a }) as usize];
                let here = self.at[from as usize];
                let [back, on] = [here - other, self.at[to as usize] - here].map(DVec3::normalize_or_zero);
                back.dot(on) >= MOST_BENT
            }
            _ => false,
        }
    }

    /// Whether an edge is sharp, or a border of the mesh, a part or a material.
    fn is_feature(&self, a: u32, b: u32) -> bool {
        let star = self.star[a as usize].iter();
        let with: Vec<u32> = star.copied().filter(|triangle| self.places_of(*triangle).contains(&b)).collect();
        let [first, second] = with[..] else { return true };
        let owner = |triangle: u32| {
            let corner = self.model.triangles[triangle as usize][0] as usize;
            (self.model.vertex_part[corner], self.model.vertex_material[corner])
        };
        let forwards = |triangle: u32| {
            let places = self.places_of(triangle);
            (0..3).any(|corner| places[corner] == a && places[(corner + 1) % 3] == b)
        };
        let normal = |triangle: u32| {
            area_vector(self.model.corners(self.model.triangles[triangle as usize])).normalize_or_zero()
        };
        owner(first) != owner(second)
            || forwards(first) == forwards(second)
            || normal(first).dot(normal(second)) < SHARP
    }

    /// Sum of the absolute changes of area [m2]. `None` if a triangle would turn too far or become a needle.
    fn change_of_area(&self, between: &[u32], rest: &[u32], from: u32, to: u32) -> Option<f64> {
        let corners = |triangle: u32| self.model.corners(self.model.triangles[triangle as usize]);
        let worst = rest.iter().map(|triangle| quality(corners(*triangle))).fold(NEEDLE, f64::min);
        let [mut before, mut after] = [between.iter().map(|one| area_vector(corners(*one)).length()).sum::<f64>(), 0.0];
        for &triangle in rest {
            let places = self.places_of(triangle);
            let moved = places.map(|place| self.at[(if place == from { to } else { place }) as usize]);
            let area = area_vector(moved);
            let turned = area.normalize_or_zero().dot(self.original[triangle as usize]);
            if turned < MOST_TURNED || quality(moved) < worst {
                return None;
            }
            before += area_vector(corners(triangle)).length();
            after += area.length();
        }
        Some((after - before).abs())
    }

    /// The new vertex for each vertex at a place: across a vanishing triangle, or with the same part, the same material
    /// and nearly the same normal. Other vertices keep their normal.
    fn vertices_after(&self, between: &[u32], rest: &[u32], from: u32, to: u32) -> Vec<(u32, u32)> {
        let at = |triangle: u32, place: u32| {
            let corners = self.model.triangles[triangle as usize];
            corners.into_iter().find(move |vertex| self.place[*vertex as usize] == place)
        };
        let mut becomes: Vec<(u32, u32)> = Vec::new();
        for &triangle in between {
            if let (Some(here), Some(there)) = (at(triangle, from), at(triangle, to))
                && !becomes.iter().any(|(known, _)| *known == here)
            {
                becomes.push((here, there));
            }
        }
        let there: Vec<u32> = self.star[to as usize].iter().filter_map(|triangle| at(*triangle, to)).collect();
        for here in rest.iter().filter_map(|triangle| at(*triangle, from)) {
            if becomes.iter().any(|(known, _)| *known == here) {
                continue;
            }
            let model = &self.model;
            let owner = |vertex: u32| (model.vertex_part[vertex as usize], model.vertex_material[vertex as usize]);
            let likeness = |vertex: &u32| model.normals[*vertex as usize].dot(model.normals[here as usize]);
            let alike = there.iter().filter(|vertex| owner(**vertex) == owner(here));
            let nearest = alike.max_by(|a, b| likeness(a).total_cmp(&likeness(b)).then(b.cmp(a)));
            if let Some(nearest) = nearest.filter(|vertex| likeness(vertex) >= SAME_NORMAL) {
                becomes.push((here, *nearest));
            }
        }
        becomes
    }

    fn apply(&mut self, from: u32, to: u32, change: Move) {
        for triangle in std::mem::take(&mut self.star[from as usize]) {
            let places = self.places_of(triangle);
            if places.contains(&to) {
                for place in places.into_iter().filter(|place| *place != from) {
                    self.star[place as usize].retain(|other| *other != triangle);
                }
                self.model.triangles[triangle as usize] = GONE;
                self.vanished += 1;
                continue;
            }
            for vertex in &mut self.model.triangles[triangle as usize] {
                if self.place[*vertex as usize] == from {
                    match change.becomes.iter().find(|(here, _)| here == vertex) {
                        Some((_, there)) => *vertex = *there,
                        None => self.model.positions[*vertex as usize] = self.at[to as usize],
                    }
                }
            }
            self.star[to as usize].push(triangle);
        }
        // Vertices that kept their normal move to the new place.
        for &triangle in &self.star[to as usize] {
            for vertex in self.model.triangles[triangle as usize] {
                if self.place[vertex as usize] == from {
                    self.place[vertex as usize] = to;
                }
            }
        }
        self.merged += 1;
    }
}

/// Quality of a triangle: 1 if equilateral, 0 without area.
fn quality([a, b, c]: [DVec3; 3]) -> f64 {
    let squares = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    if squares > 0.0 { 4.0 * 3.0_f64.sqrt() * area_vector([a, b, c]).length() / squares } else { 0.0 }
}
