//! The craft as the Sun sees it: which triangles may hide the Sun from a node.
//!
//! All rays to the Sun are parallel within its disc. In coordinates (u, v, z), with z towards the Sun, a triangle can hide the Sun only from places that lie
//! below it and within its outline, grown by the radius of the disc times the distance. A tree of boxes in these coordinates finds the triangles that a node
//! may have above it. Most nodes have none and need no line; the lines of the others try a few triangles and need no tree.

use glam::{DAffine3, DVec3, Vec4};

use super::closed::in_closed_bodies;
use super::occluder::{Line, Occluder, Reach};
use super::outline::{Face, Outline, Region};
use super::rays::{around, edges_of, start_over};
use super::tree::Tree;

/// A box of the tree, in the order of a walk.
#[derive(Debug, Clone, Copy)]
struct OutlineBox {
    outline: Outline,
    /// The next box where this one is passed over.
    skip: u32,
    /// First triangle of a leaf, and the number of its triangles. 0 for an inner box.
    first: u32,
    count: u32,
}

/// Triangles of one joint that cast shadows.
#[derive(Debug, Clone)]
pub(crate) struct Caster {
    pub(super) joint: u32,
    /// Corners of each triangle [m], and whether it belongs to a closed body; in the order of the tree.
    triangles: Vec<([DVec3; 3], bool)>,
    tree: Tree,
    /// Distance between the start of a ray and its surface [m].
    pub(super) start: f64,
}

impl Caster {
    /// The triangles of a joint. Their corners turn to the left around the outside.
    pub(crate) fn new(joint: u32, positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let all = edges_of(positions, triangles);
        let bounds: Vec<[DVec3; 2]> = all.iter().map(around).collect();
        let start = start_over(&bounds);
        let tree = Tree::new(bounds);
        let is_closed = in_closed_bodies(positions, triangles);
        let triangle = |number: &u32| {
            let number = *number as usize;
            (triangles[number].map(|node| positions[node as usize]), is_closed[number])
        };
        let triangles = tree.order.iter().map(triangle).collect();
        Self { joint, triangles, tree, start }
    }

    /// Corners of each triangle in the frame of the joint [m].
    pub(super) fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> {
        self.triangles.iter().map(|(corners, _)| *corners)
    }
}

/// A triangle that may hide the Sun from a part of the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hiding {
    outline: Outline,
    /// Its number among all triangles.
    number: u32,
}

/// All triangles that may hide the Sun, as the Sun sees them.
#[derive(Debug)]
pub(super) struct Sunward {
    boxes: Vec<OutlineBox>,
    occluders: Vec<Occluder>,
    /// As many as occluders.
    outlines: Vec<Hiding>,
}

/// Takes a frame into the coordinates (u, v, z) of a Sun in this direction of the same frame.
pub(super) fn axes(sun: DVec3) -> DAffine3 {
    let (u, v) = sun.any_orthonormal_pair();
    let rows = glam::DMat3::from_cols(u, v, sun).transpose();
    DAffine3::from_mat3(rows)
}

/// What lies between a region and the Sun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Above {
    Nothing,
    /// One triangle over all of it.
    Cover,
    /// The triangles of the list.
    Some,
}

impl Sunward {
    /// The casters, which `placed` takes from their joint to the coordinates of the Sun.
    pub(super) fn new(casters: &[Caster], placed: impl Fn(u32) -> DAffine3) -> Self {
        let empty = Outline { sides: Vec4::INFINITY, top: f32::NEG_INFINITY };
        let mut all = Self { boxes: Vec::new(), occluders: Vec::new(), outlines: Vec::new() };
        for Caster { joint, triangles, tree, .. } in casters {
            let placed = placed(*joint);
            let [first_box, first_occluder] = [all.boxes.len(), all.occluders.len()];
            for (corners, is_closed) in triangles {
                let occluder = Occluder::new(corners.map(|corner| placed.transform_point3(corner)));
                let casts = !(*is_closed && occluder.turns_away());
                let number = all.occluders.len() as u32;
                all.outlines.push(Hiding { outline: if casts { occluder.outline() } else { empty }, number });
                all.occluders.push(occluder);
            }
            all.boxes.extend(tree.nodes.iter().map(|node| OutlineBox {
                outline: empty,
                skip: node.skip + first_box as u32,
                first: node.first + first_occluder as u32,
                count: node.count,
            }));
            for place in (first_box..all.boxes.len()).rev() {
                let OutlineBox { first, count, .. } = all.boxes[place];
                all.boxes[place].outline = if count > 0 {
                    let leaf = &all.outlines[first as usize..(first + count) as usize];
                    leaf.iter().fold(empty, |around, hiding| around.around(hiding.outline))
                } else {
                    let second = all.boxes[place + 1].skip as usize;
                    all.boxes[place + 1].outline.around(all.boxes[second].outline)
                };
            }
        }
        all
    }

    /// Finds the triangles that may hide the Sun from faces in a region, or without faces from any.
    pub(super) fn above(&self, region: &Region<'_>, faces: &[Face], start: f64, list: &mut Vec<Hiding>) -> Above {
        list.clear();
        let mut place = 0;
        while let Some(at) = self.boxes.get(place) {
            if !at.outline.may_shade(region) {
                place = at.skip as usize;
                continue;
            }
            let leaf = &self.outlines[at.first as usize..(at.first + at.count) as usize];
            if self.sift(leaf, region, faces, start, list) {
                return Above::Cover;
            }
            place += 1;
        }
        if list.is_empty() { Above::Nothing } else { Above::Some }
    }

    /// The same among the triangles above a region around this one.
    pub(super) fn above_among(
        &self,
        among: &[Hiding],
        region: &Region<'_>,
        faces: &[Face],
        start: f64,
        list: &mut Vec<Hiding>,
    ) -> Above {
        list.clear();
        if self.sift(among, region, faces, start, list) {
            return Above::Cover;
        }
        if list.is_empty() { Above::Nothing } else { Above::Some }
    }

    /// Finds the hidden parts of a line, in shares of its length and in their order. A triangle that hides all of it is tried first for the next line.
    pub(super) fn find_hidden(&self, line: &Line, hiding: &mut [Hiding], parts: &mut Vec<[f64; 2]>) {
        parts.clear();
        for place in 0..hiding.len() {
            let Hiding { outline, number } = hiding[place];
            if !line.may_be_under(&outline) {
                continue;
            }
            let part = self.occluders[number as usize].hides(line);
            parts.extend(part);
            if part == Some([0.0, 1.0]) {
                parts.clear();
                parts.extend(part);
                hiding.swap(0, place);
                return;
            }
        }
        parts.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    }

    /// Adds the triangles that may hide the Sun from faces in a region to a list. Returns whether one lies over all of it.
    fn sift(&self, among: &[Hiding], region: &Region<'_>, faces: &[Face], start: f64, list: &mut Vec<Hiding>) -> bool {
        for hiding in among.iter().filter(|hiding| hiding.outline.may_shade(region)) {
            let occluder = &self.occluders[hiding.number as usize];
            if !faces.is_empty() && !faces.iter().any(|face| occluder.is_above(face, start)) {
                continue;
            }
            match occluder.reaches(hiding.outline.top, region) {
                Reach::Misses => {}
                Reach::Covers if occluder.is_over(region, start) => return true,
                _ => list.push(*hiding),
            }
        }
        false
    }
}
