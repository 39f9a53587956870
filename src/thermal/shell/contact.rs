//! Contacts: given conductances between parts or materials whose surfaces lie close.
//!
//! Every node of one side is connected to the nearest point of the other side's triangles. Barycentric coordinates share the connection between the three
//! corners. The two meshes need not match.

use std::collections::{BTreeMap, HashMap, HashSet};

use glam::DVec3;
use rayon::prelude::*;

use super::{NO_NODE, ShellError, ShellMaterial, Surface};
use crate::thermal::network::LinearConductor;

/// A selection of vertices by part and by material. A vertex must fit both.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Selection {
    /// Name for messages.
    pub name: String,
    /// Whether each part is selected.
    pub parts: Vec<bool>,
    /// Whether each material is selected.
    pub materials: Vec<bool>,
}

/// Conductance of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactConductance {
    /// Total conductance [W/K].
    Total(f64),
    /// Conductance per contact area [W/(m2 K)].
    PerArea(f64),
}

/// A contact between two selections.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Name for messages.
    pub name: String,
    /// The two selections.
    pub between: [Selection; 2],
    /// Greatest distance between the surfaces [m].
    pub distance: f64,
    /// Conductance of the contact.
    pub conductance: ContactConductance,
}

/// Part of a contact for each node.
#[derive(Debug, Clone, PartialEq, Default)]
struct Shares {
    /// Contact area of every node [m2]: from triangles that lie wholly at the other side, or else from edges and thickness.
    area: BTreeMap<u32, f64>,
    faces: bool,
    touches: BTreeMap<u32, [(u32, f64); 3]>,
}

impl Selection {
    fn has(&self, surface: &Surface, vertex: u32) -> bool {
        let vertex = vertex as usize;
        self.parts[surface.parts[vertex] as usize] && self.materials[surface.materials[vertex] as usize]
    }
}

impl Contact {
    /// Adds the conductors of the contact. `node` is the node of every vertex.
    pub(super) fn conductors(
        &self,
        surface: &Surface,
        materials: &[Option<ShellMaterial>],
        node: &[u32],
    ) -> Result<Vec<LinearConductor>, ShellError> {
        let triangles = self.between.each_ref().map(|side| {
            let of_side = |triangle: &&[u32; 3]| {
                side.has(surface, triangle[0]) && triangle.iter().all(|vertex| node[*vertex as usize] != NO_NODE)
            };
            surface.triangles.iter().filter(of_side).copied().collect::<Vec<[u32; 3]>>()
        });
        for (side, triangles) in self.between.iter().zip(&triangles) {
            if triangles.is_empty() {
                return Err(ShellError::NotInNetwork { contact: self.name.clone(), side: side.name.clone() });
            }
        }
        let thickness = triangles.each_ref().map(|triangles| {
            let of = |triangle: &[u32; 3]| {
                let material = materials[surface.materials[triangle[0] as usize] as usize];
                material.map_or(0.0, |material| material.over.map_or(material.outer, |over| over.0).thickness)
            };
            triangles.iter().map(of).fold(f64::INFINITY, f64::min)
        });
        let thinner = thickness[0].min(thickness[1]);
        let [a, b] = &triangles;
        let sides = [(a, b), (b, a)].map(|(from, to)| self.shares(surface, node, from, to, thinner));
        // The finer mesh, or the smaller face, may have whole triangles in contact where the other has none.
        let better = |one: &Shares| (one.faces, one.area.values().sum::<f64>(), one.touches.len());
        let [first, second] = sides;
        let shares = if better(&first) >= better(&second) { first } else { second };

        if shares.touches.is_empty() {
            return Err(ShellError::Apart { contact: self.name.clone(), distance: self.distance });
        }
        let area: f64 = shares.area.values().sum();
        let of_node = |node: &u32| match self.conductance {
            ContactConductance::PerArea(conductance) => {
                conductance * shares.area.get(node).copied().unwrap_or_default()
            }
            ContactConductance::Total(conductance) if area > 0.0 => {
                conductance * shares.area.get(node).copied().unwrap_or_default() / area
            }
            ContactConductance::Total(conductance) => conductance / shares.touches.len() as f64,
        };
        if area <= 0.0 && matches!(self.conductance, ContactConductance::PerArea(_)) {
            return Err(ShellError::NoArea { contact: self.name.clone() });
        }
        let mut conductors = Vec::new();
        for (from, corners) in &shares.touches {
            let conductance = of_node(from);
            for (to, weight) in corners {
                if *to != *from && conductance * weight > 0.0 {
                    conductors.push(LinearConductor { nodes: [*from, *to], conductance: conductance * weight });
                }
            }
        }
        Ok(conductors)
    }

    /// The part of the triangles `from` that lies at the triangles `to`.
    fn shares(&self, surface: &Surface, node: &[u32], from: &[[u32; 3]], to: &[[u32; 3]], thickness: f64) -> Shares {
        let at = |vertex: u32| surface.positions[vertex as usize];
        let grid = Grid::new(to.iter().map(|triangle| triangle.map(at)).collect(), self.distance);
        let vertices: Vec<u32> = from.as_flattened().iter().copied().collect::<HashSet<_>>().into_iter().collect();
        let hits: HashMap<u32, (usize, [f64; 3])> = vertices
            .par_iter()
            .filter_map(|vertex| Some((*vertex, grid.nearest(at(*vertex), self.distance)?)))
            .collect();
        let touches_at = |point: DVec3| grid.nearest(point, self.distance).is_some();
        let mut shares = Shares::default();
        for (vertex, (triangle, weights)) in &hits {
            let corners = to[*triangle].map(|corner| node[corner as usize]);
            let place = [0, 1, 2].map(|corner| (corners[corner], weights[corner]));
            // Drawn vertices of one node coincide. The choice of the vertex must not depend on the order of a hash.
            let known = shares.touches.entry(node[*vertex as usize]).or_insert(place);
            if place.map(|corner| corner.0) < known.map(|corner| corner.0) {
                *known = place;
            }
        }
        for triangle in from {
            let whole = triangle.iter().all(|vertex| hits.contains_key(vertex));
            let [a, b, c] = triangle.map(at);
            if whole && touches_at((a + b + c) / 3.0) {
                shares.faces = true;
                let area = (b - a).cross(c - a).length() / 6.0;
                triangle.iter().for_each(|v| *shares.area.entry(node[*v as usize]).or_default() += area);
            }
        }
        if !shares.faces {
            let mut seen = HashSet::new();
            for triangle in from {
                for edge in [[0, 1], [1, 2], [2, 0]].map(|edge| edge.map(|corner| triangle[corner])) {
                    let [a, b] = edge.map(|vertex| node[vertex as usize]);
                    let [p, q] = edge.map(at);
                    let touches = edge.iter().all(|vertex| hits.contains_key(vertex)) && touches_at(0.5 * (p + q));
                    if touches && a != b && seen.insert([a.min(b), a.max(b)]) {
                        let area = 0.5 * p.distance(q) * thickness;
                        *shares.area.entry(a).or_default() += area;
                        *shares.area.entry(b).or_default() += area;
                    }
                }
            }
        }
        shares
    }
}

/// Triangles sorted into the cells of a grid.
struct Grid {
    corners: Vec<[DVec3; 3]>,
    cell: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Grid {
    /// Cells have the size of a mean triangle, so that a triangle lies in few cells.
    fn new(corners: Vec<[DVec3; 3]>, margin: f64) -> Self {
        let extents: Vec<[DVec3; 2]> =
            corners.iter().map(|[a, b, c]| [a.min(*b).min(*c) - margin, a.max(*b).max(*c) + margin]).collect();
        let sizes = extents.iter().map(|[low, high]| (*high - *low).max_element());
        let mean = sizes.clone().sum::<f64>() / corners.len().max(1) as f64;
        let largest = sizes.fold(0.0, f64::max);
        let mut grid = Self { corners, cell: mean.max(largest / 64.0).max(f64::MIN_POSITIVE), cells: HashMap::new() };
        for (index, [low, high]) in extents.into_iter().enumerate() {
            let [low, high] = [grid.cell_of(low), grid.cell_of(high)];
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        grid.cells.entry([x, y, z]).or_default().push(index as u32);
                    }
                }
            }
        }
        grid
    }

    fn cell_of(&self, point: DVec3) -> [i64; 3] {
        (point / self.cell).floor().to_array().map(|coordinate| coordinate as i64)
    }

    /// The nearest triangle within a distance, with the barycentric coordinates of its nearest point.
    fn nearest(&self, point: DVec3, within: f64) -> Option<(usize, [f64; 3])> {
        let mut best: Option<(f64, usize, [f64; 3])> = None;
        for index in self.cells.get(&self.cell_of(point))? {
            let corners = self.corners[*index as usize];
            let weights = nearest_point(point, corners);
            let place = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
            let distance = place.distance(point);
            if distance <= within && best.is_none_or(|(least, ..)| distance < least) {
                best = Some((distance, *index as usize, weights));
            }
        }
        best.map(|(_, index, weights)| (index, weights))
    }
}

/// Barycentric coordinates of the point of a triangle nearest to a point (Ericson, Real-Time Collision Detection, 2005, 5.1.5).
fn nearest_point(point: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let [d1, d2] = [ab.dot(point - a), ac.dot(point - a)];
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let [d3, d4] = [ab.dot(point - b), ac.dot(point - b)];
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let [d5, d6] = [ab.dot(point - c), ac.dot(point - c)];
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    let [along, beyond] = [d4 - d3, d5 - d6];
    if va <= 0.0 && along >= 0.0 && beyond >= 0.0 && along + beyond > 0.0 {
        let w = along / (along + beyond);
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    if sum > 0.0 { [va / sum, vb / sum, vc / sum] } else { [1.0, 0.0, 0.0] }
}
