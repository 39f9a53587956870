//! One side of a contact: its triangles, their planes, their nodes, and where each corner's part of a triangle ends.

use std::collections::HashMap;

use glam::DVec3;

use super::super::{NO_NODE, ShellMaterial, ShellSurface};
use crate::environment::shadow::Tree;
use crate::environment::shadow::corner::corner_dots;

/// Part and material of a triangle.
pub(super) type Group = [u32; 2];

/// The piece of a triangle whose material does not conduct.
pub(super) const NO_PIECE: u32 = u32::MAX;

/// The two groups of a contact, the lower first.
pub(super) type ContactGroups = [Group; 2];

/// The two groups in their order.
pub(super) fn owners(first: Group, second: Group) -> ContactGroups {
    [first.min(second), first.max(second)]
}

/// The node that stands for the piece of a node, on a way that becomes shorter.
fn root(above: &mut [u32], mut node: u32) -> u32 {
    while above[node as usize] != node {
        above[node as usize] = above[above[node as usize] as usize];
        node = above[node as usize];
    }
    node
}

/// The border between the parts of two corners in a triangle: a plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Divider {
    pub(super) corners: [usize; 2],
    /// A point of the border [m].
    pub(super) point: DVec3,
    /// Direction from the first corner's part to the second's.
    pub(super) towards: DVec3,
}

pub(super) struct ContactSide {
    /// Corners of each triangle [m].
    pub(super) corners: Vec<[DVec3; 3]>,
    /// Unit normals. 0 for triangles without area.
    pub(super) normals: Vec<DVec3>,
    pub(super) nodes: Vec<[u32; 3]>,
    /// Number of each triangle in the surface.
    pub(super) numbers: Vec<u32>,
    /// Part and material of each triangle.
    pub(super) groups: Vec<Group>,
    /// Thickness of the sheet of each triangle [m].
    pub(super) thickness: Vec<f64>,
    /// Depth of the sheet of each triangle behind and before the triangle [m].
    pub(super) filled: Vec<[f64; 2]>,
    /// Triangles by their number in the surface.
    by_number: HashMap<u32, u32>,
    tree: Tree,
}

impl ContactSide {
    /// The triangles of the network whose vertices are chosen.
    pub(super) fn new(
        surface: &ShellSurface,
        materials: &[Option<ShellMaterial>],
        node: &[u32],
        chosen: impl Fn(u32) -> bool,
    ) -> Self {
        let belongs = |triangle: &[u32; 3]| {
            chosen(triangle[0]) && triangle.iter().all(|vertex| node[*vertex as usize] != NO_NODE)
        };
        let numbers: Vec<u32> = (0..surface.triangles.len() as u32)
            .filter(|number| belongs(&surface.triangles[*number as usize]))
            .collect();
        let triangle = |number: &u32| surface.triangles[*number as usize];
        let triangles: Vec<[u32; 3]> = numbers.iter().map(triangle).collect();
        let at = |vertex: u32| surface.positions[vertex as usize];
        let corners: Vec<[DVec3; 3]> = triangles.iter().map(|triangle| triangle.map(at)).collect();
        let owner = |triangle: &[u32; 3]| triangle[0] as usize;
        let material = |triangle: &[u32; 3]| materials[surface.materials[owner(triangle)] as usize].unwrap_or_default();
        let thickness = |triangle: &[u32; 3]| material(triangle).inner().thickness;
        Self {
            normals: corners.iter().map(|[a, b, c]| (b - a).cross(c - a).normalize_or_zero()).collect(),
            nodes: triangles.iter().map(|triangle| triangle.map(|vertex| node[vertex as usize])).collect(),
            groups: triangles.iter().map(|one| [surface.parts[owner(one)], surface.materials[owner(one)]]).collect(),
            thickness: triangles.iter().map(thickness).collect(),
            filled: triangles.iter().map(|triangle| material(triangle).filled()).collect(),
            by_number: numbers.iter().enumerate().map(|(index, number)| (*number, index as u32)).collect(),
            tree: Tree::new(corners.iter().map(|[a, b, c]| [a.min(*b).min(*c), a.max(*b).max(*c)]).collect()),
            corners,
            numbers,
        }
    }

    /// Area of each part and material [m2].
    pub(super) fn areas_of_groups(&self) -> HashMap<Group, f64> {
        let mut areas = HashMap::new();
        for ([a, b, c], group) in self.corners.iter().zip(&self.groups) {
            *areas.entry(*group).or_default() += 0.5 * (b - a).cross(c - a).length();
        }
        areas
    }

    /// The piece of each triangle: all that hangs together by its nodes. `NO_PIECE` in a material that does not conduct.
    pub(super) fn pieces(&self, conducts: impl Fn(Group) -> bool) -> Vec<u32> {
        let count = self.nodes.iter().flatten().max().map_or(0, |last| *last + 1);
        let mut above: Vec<u32> = (0..count).collect();
        for [a, b, c] in &self.nodes {
            for [from, to] in [[*a, *b], [*b, *c]] {
                let (from, to) = (root(&mut above, from), root(&mut above, to));
                above[from as usize] = to;
            }
        }
        let piece = |(nodes, group): (&[u32; 3], &Group)| {
            if conducts(*group) { root(&mut above, nodes[0]) } else { NO_PIECE }
        };
        self.nodes.iter().zip(&self.groups).map(piece).collect()
    }

    /// Whether a triangle of the surface belongs to this side.
    pub(super) fn has(&self, number: u32) -> bool {
        self.by_number.contains_key(&number)
    }

    /// Calls a function with the triangles whose boxes touch a box [m].
    pub(super) fn near(&self, low: DVec3, high: DVec3, mut visit: impl FnMut(usize)) {
        let mut at = 0;
        while let Some(node) = self.tree.nodes.get(at) {
            let touches = node.low.cmple(high).all() && node.high.cmpge(low).all();
            if !touches {
                at = node.skip as usize;
                continue;
            }
            at += 1;
            let leaf = node.first as usize..(node.first + node.count) as usize;
            for triangle in &self.tree.order[leaf] {
                let [a, b, c] = self.corners[*triangle as usize];
                if a.min(b).min(c).cmple(high).all() && a.max(b).max(c).cmpge(low).all() {
                    visit(*triangle as usize);
                }
            }
        }
    }

    /// The borders between the corners' parts of a triangle. The parts have the areas of `corner_areas`.
    pub(super) fn dividers(&self, triangle: usize) -> impl Iterator<Item = Divider> + Clone + use<> {
        let corners = self.corners[triangle];
        let obtuse = corner_dots(corners).iter().position(|dot| *dot < 0.0);
        [[0, 1], [1, 2], [2, 0]].into_iter().filter_map(move |[first, second]| {
            let [a, b] = [corners[first], corners[second]];
            let towards = match obtuse {
                // Half the area is the obtuse corner's: a parallelogram with a corner in the middle of each side.
                Some(wide) if wide == first || wide == second => {
                    let other = if wide == first { second } else { first };
                    let along = corners[3 - first - second] - corners[wide];
                    let across = corners[other] - corners[wide];
                    let across = across - along * (across.dot(along) / along.length_squared());
                    if wide == first { across } else { -across }
                }
                Some(_) => return None,
                None => b - a,
            };
            Some(Divider { corners: [first, second], point: 0.5 * (a + b), towards })
        })
    }

    /// The corner whose part of a triangle holds a point.
    pub(super) fn corner_at(&self, triangle: usize, point: DVec3) -> usize {
        let mut lost = [false; 3];
        for divider in self.dividers(triangle) {
            let beyond = (point - divider.point).dot(divider.towards) > 0.0;
            lost[divider.corners[usize::from(!beyond)]] = true;
        }
        lost.iter().position(|lost| !lost).unwrap_or_default()
    }
}
