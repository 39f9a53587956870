//! The surface that the Sun lights: its nodes, the corners of triangles that belong to them, and groups of neighbours in one plane.

use std::ops::Range;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::corner::Division;
use super::sunward::Caster;

/// Cosine of the angle between the normals of a node and of its triangle below which the node is not flat.
pub(super) const FLAT: f64 = 1.0 - 1e-7;

/// Lines across a node that something may hide, at least.
const LINES: u32 = 8;
/// Nodes of a group, at most.
const GROUP: usize = 32;

/// A node that the Sun may light.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LitNode {
    /// Its number among all nodes.
    pub(crate) number: u32,
    /// Its number in the model, from which its samples follow: the same in whatever order a device has the nodes.
    pub(crate) vertex: u32,
    /// Unit normal in the frame of its joint.
    pub(crate) normal: DVec3,
    /// Whether the side against the normal absorbs light too.
    pub(crate) both_sides: bool,
    /// Joint; 0 is the body.
    pub(crate) joint: u32,
    /// How its triangles are divided between their corners.
    pub(crate) division: Division,
}

impl LitNode {
    /// A node of a plate whose front looks along +Z, in no network.
    pub(crate) fn on_plate(number: u32) -> Self {
        Self { number, vertex: number, normal: DVec3::Z, both_sides: false, joint: 0, division: Division::Thirds }
    }
}

/// The surface of a craft as the Sun lights it, in the file's pose.
#[derive(Debug, Clone)]
pub(crate) struct LitSurface {
    /// Positions of all nodes [m].
    pub(crate) positions: Vec<DVec3>,
    /// Nodes of the triangles.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Triangles that cast shadows. Empty where the craft casts none on itself.
    pub(crate) casters: Vec<Caster>,
    /// Largest distance between two lines [m].
    pub(crate) spacing: f64,
    /// Lines across an area, over the usual number.
    pub(crate) times: u32,
}

/// The part of a triangle that belongs to a node.
pub(super) struct Corner {
    /// Unit normal on the side of the node's normal.
    pub(super) normal: DVec3,
    /// Area [m2].
    pub(super) area: f64,
}

impl LitSurface {
    /// The triangle and the place in it of a corner: number of the triangle times three, plus the place.
    pub(super) fn corner(&self, corner: u32, node_normal: DVec3) -> Corner {
        let [a, b, c] = self.placed(corner);
        let twice = (b - a).cross(c - a);
        let length = twice.length();
        let normal = if length > 0.0 { twice / length } else { DVec3::ZERO };
        Corner { normal: on_side_of(node_normal, normal), area: length / 6.0 }
    }

    pub(super) fn placed(&self, corner: u32) -> [DVec3; 3] {
        self.triangles[corner as usize / 3].map(|node| self.positions[node as usize])
    }

    /// Distance between the start of a ray and its surface [m].
    pub(super) fn start(&self) -> f64 {
        self.casters.iter().map(|caster| caster.start).fold(0.0, f64::max)
    }

    /// Lines across a node whose corners that face the Sun have an area [m2].
    pub(super) fn lines(&self, area: f64) -> u32 {
        self.times * ((area.sqrt() / self.spacing).ceil() as u32).max(LINES)
    }
}

/// The normal of a corner, turned to the side of its node's normal.
pub(super) fn on_side_of(node_normal: DVec3, normal: DVec3) -> DVec3 {
    if normal.dot(node_normal) < 0.0 { -normal } else { normal }
}

/// Nodes of a joint that follow each other.
#[derive(Debug, Clone)]
pub(super) struct Group {
    pub(super) nodes: Range<usize>,
    /// Whether all lie in one plane.
    pub(super) is_flat: bool,
}

/// Nodes, and the corners that belong to each.
#[derive(Debug, Clone)]
pub(super) struct Cells {
    pub(super) nodes: Vec<LitNode>,
    /// First corner of each node, and the one after the last.
    first: Vec<u32>,
    corners: Vec<u32>,
}

impl Cells {
    /// The cells of some nodes of a surface.
    pub(super) fn new(surface: &LitSurface, nodes: Vec<LitNode>) -> Self {
        let mut place = vec![u32::MAX; surface.positions.len()];
        for (index, node) in nodes.iter().enumerate() {
            place[node.number as usize] = index as u32;
        }
        let owners = || surface.triangles.as_flattened().iter().map(|node| place[*node as usize]).enumerate();
        let mut first = vec![0u32; nodes.len() + 1];
        for (_, owner) in owners().filter(|(_, owner)| *owner != u32::MAX) {
            first[owner as usize + 1] += 1;
        }
        for index in 0..nodes.len() {
            first[index + 1] += first[index];
        }
        let mut next = first.clone();
        let mut corners = vec![0; first[nodes.len()] as usize];
        for (corner, owner) in owners().filter(|(_, owner)| *owner != u32::MAX) {
            corners[next[owner as usize] as usize] = corner as u32;
            next[owner as usize] += 1;
        }
        Self { nodes, first, corners }
    }

    pub(super) fn corners_of(&self, index: usize) -> &[u32] {
        &self.corners[self.first[index] as usize..self.first[index + 1] as usize]
    }

    /// Whether all corners of a node with an area have its normal.
    pub(super) fn is_flat(&self, surface: &LitSurface, index: usize) -> bool {
        let node = &self.nodes[index];
        self.corners_of(index).iter().all(|corner| {
            let corner = surface.corner(*corner, node.normal);
            corner.area == 0.0 || corner.normal.dot(node.normal) > FLAT
        })
    }

    /// An order of the nodes, and groups of neighbours that follow each other in it.
    pub(super) fn groups(&self, surface: &LitSurface) -> (Vec<u32>, Vec<Group>) {
        let start = surface.start();
        let at = |node: &LitNode| surface.positions[node.number as usize];
        let has_plane = |index: usize| {
            let has_area = |number: &u32| surface.corner(*number, DVec3::Z).area > 0.0;
            self.corners_of(index).iter().any(has_area) && self.is_flat(surface, index)
        };
        let is_flat: Vec<bool> = (0..self.nodes.len()).into_par_iter().map(has_plane).collect();
        let low = self.nodes.iter().map(at).fold(DVec3::INFINITY, DVec3::min);
        let size = self.nodes.iter().map(at).fold(DVec3::NEG_INFINITY, DVec3::max).distance(low).max(f64::MIN_POSITIVE);
        let key = |index: &u32| {
            let node = &self.nodes[*index as usize];
            let plane = is_flat[*index as usize].then(|| {
                let normal = (1e3 * node.normal).round().as_i16vec3().to_array();
                (node.both_sides, normal, (at(node).dot(node.normal) / size * 1e4).round() as i64)
            });
            (node.joint, plane, along_a_curve((at(node) - low) / size))
        };
        let mut order: Vec<u32> = (0..self.nodes.len() as u32).collect();
        order.par_sort_by_cached_key(key);
        let mut groups: Vec<Group> = Vec::new();
        for (place, index) in order.iter().enumerate() {
            let (node, is_flat) = (&self.nodes[*index as usize], is_flat[*index as usize]);
            if let Some(last) = groups.last_mut() {
                let first = &self.nodes[order[last.nodes.start] as usize];
                let is_in_plane = || {
                    first.both_sides == node.both_sides
                        && first.normal.dot(node.normal) > FLAT
                        && (at(node) - at(first)).dot(first.normal).abs() <= 0.1 * start
                };
                let is_near = last.nodes.len() < GROUP && first.joint == node.joint && last.is_flat == is_flat;
                if is_near && (!is_flat || is_in_plane()) {
                    last.nodes.end += 1;
                    continue;
                }
            }
            groups.push(Group { nodes: place..place + 1, is_flat });
        }
        (order, groups)
    }

    /// The box around the corners of each node in the frame of its joint [m].
    pub(super) fn boxes(&self, surface: &LitSurface) -> Vec<[Vec3; 2]> {
        let around = |index: usize| {
            let LitNode { number, division, .. } = self.nodes[index];
            let node = surface.positions[number as usize].as_vec3();
            let outline = |corner: &u32| division.outline(surface.placed(*corner), *corner as usize % 3);
            let outlines = self.corners_of(index).iter().map(outline);
            let points = outlines.flatten().map(DVec3::as_vec3);
            points.fold([node; 2], |[low, high], point| [low.min(point), high.max(point)])
        };
        (0..self.nodes.len()).into_par_iter().map(around).collect()
    }
}

/// Place of a point of the unit cube on a curve that seldom jumps (Morton 1966).
fn along_a_curve(at: DVec3) -> u64 {
    let bits = |axis: f64| (0..16).map(|bit| u64::from((axis * 65_535.0) as u16 >> bit & 1) << (3 * bit)).sum::<u64>();
    bits(at.x) | bits(at.y) << 1 | bits(at.z) << 2
}
