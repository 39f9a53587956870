//! Sunlight that patches mirror once: rays leave them in the mirror direction, and the patches that the rays meet receive the light.
//!
//! Each joint has a tree of its own in the file's pose, and a ray is turned into the frame of each. So a craft that moves needs no new trees, and the rays follow
//! the present pose. A rough mirror spreads its rays over the visible facets of GGX. The Sun is a point here.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::cast::{INSIDE, PatchRays, SPACE, face_of};
use super::directions::{basis, fractions};
use super::patches::{NONE, PatchSurface, Patches};
use super::sparse::{Sparse, SparseRow};
use crate::environment::StepLoad;
use crate::environment::shadow::Occluders;
use crate::thermal::lobe::facet_reflection;

/// Most mirrored rays of a patch. Rays of one direction need not be as many as rays over a hemisphere.
pub(crate) const MOST_RAYS: u32 = 32;

/// Cosine below which the Sun does not light a face, with a margin for the f32 of the device.
const GRAZING: f64 = -1e-5;

/// The patches that mirror sunlight, and the triangles that their rays may meet.
#[derive(Debug, Clone)]
pub struct Mirrors {
    faces: Vec<MirrorFace>,
    joints: Vec<JointTree>,
    /// Areas of all patches [m2].
    areas: Vec<f64>,
    /// Distance between a ray's start and its surface [m].
    start: f64,
}

/// A patch that mirrors, in the file's pose.
#[derive(Debug, Clone)]
struct MirrorFace {
    patch: u32,
    joint: u32,
    normal: DVec3,
    roughness: f64,
    rays: Vec<Start>,
}

/// Where a ray starts: its place [m], the unit normal there, and two numbers that choose a facet.
#[derive(Debug, Clone, Copy)]
struct Start {
    place: DVec3,
    normal: DVec3,
    facet: [f64; 2],
}

/// The triangles of a joint in the file's pose.
#[derive(Debug, Clone)]
struct JointTree {
    joint: u32,
    occluders: Occluders,
    /// Patches of the front and the back of each corner of the triangles.
    faces: Vec<[[u32; 2]; 3]>,
}

/// Where mirrored sunlight goes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mirrored {
    /// Row i lists the patches j whose mirrored light reaches patch i: the share of the light that does, times the area of j over the area of i.
    pub arrives: Sparse,
    /// Share of the mirrored light of each patch that leaves the craft.
    pub lost: Vec<f64>,
}

impl Mirrors {
    /// The mirrors of a craft, with at most `rays` rays of each. `None` where no patch mirrors.
    pub fn new(surface: &PatchSurface, patches: &Patches, rays: u32) -> Option<Self> {
        let count = rays.min(MOST_RAYS);
        let face = |(number, patch): (u32, &super::patches::Patch)| {
            let rays = PatchRays::new(surface, patches, number);
            let ray = |ray: u32| {
                let numbers = fractions(number, ray);
                let [place, normal] = rays.start(numbers);
                let [_, _, u, v] = numbers;
                Start { place, normal, facet: [u, v] }
            };
            (patch.gloss.specular > 0.0).then(|| MirrorFace {
                patch: number,
                joint: patch.joint,
                normal: patch.normal,
                roughness: (patch.gloss.alpha().powi(2) + patch.gloss.drawn_variance).sqrt(),
                rays: (0..count).map(ray).collect(),
            })
        };
        let faces: Vec<MirrorFace> = (0..).zip(patches.all.iter()).filter_map(face).collect();
        if faces.is_empty() {
            return None;
        }
        let most = surface.joints.iter().max().copied().unwrap_or(0);
        let joints: Vec<JointTree> = (0..=most).filter_map(|joint| JointTree::new(surface, patches, joint)).collect();
        let start = joints.iter().map(|tree| tree.occluders.start).fold(0.0, f64::max);
        Some(Self { faces, joints, areas: patches.all.iter().map(|patch| patch.area).collect(), start })
    }

    pub(crate) fn most_pairs(&self) -> usize {
        self.faces.iter().map(|face| face.rays.len().max(1)).sum()
    }

    /// Where the sunlight goes that is mirrored under a load. A patch that the Sun does not light mirrors nothing.
    pub fn mirrored(&self, load: &StepLoad) -> Mirrored {
        let scene = Placed::new(self, load);
        let ends: Vec<Option<SparseRow>> = self.faces.par_iter().map(|face| scene.ends(face)).collect();
        let mut rows: Vec<SparseRow> = vec![SparseRow::new(); self.areas.len()];
        let mut lost = vec![0.0; self.areas.len()];
        for (face, ends) in self.faces.iter().zip(ends) {
            for (end, share) in ends.into_iter().flatten() {
                match end {
                    SPACE => lost[face.patch as usize] = share,
                    to => {
                        let over = self.areas[face.patch as usize] / self.areas[to as usize];
                        rows[to as usize].push((face.patch, share * over));
                    }
                }
            }
        }
        Mirrored { arrives: Sparse::from_rows(rows), lost }
    }
}

impl JointTree {
    fn new(surface: &PatchSurface, patches: &Patches, joint: u32) -> Option<Self> {
        let is_own = |triangle: &&[u32; 3]| surface.joints[triangle[0] as usize] == joint;
        let triangles: Vec<[u32; 3]> = surface.triangles.iter().filter(is_own).copied().collect();
        if triangles.is_empty() {
            return None;
        }
        let occluders = Occluders::new(&surface.positions, &triangles);
        let faces = triangles.iter().map(|triangle| triangle.map(|node| patches.of_node[node as usize]));
        Some(Self { joint, faces: faces.collect(), occluders })
    }
}

/// Mirrors under a load: poses of the joints, and the frames of the trees.
struct Placed<'a> {
    mirrors: &'a Mirrors,
    load: &'a StepLoad,
    /// Takes the body frame into the frame of each tree.
    from_body: Vec<DAffine3>,
}

impl<'a> Placed<'a> {
    fn new(mirrors: &'a Mirrors, load: &'a StepLoad) -> Self {
        let from_body = mirrors.joints.iter().map(|tree| pose(load, tree.joint).inverse()).collect();
        Self { mirrors, load, from_body }
    }

    /// Shares of the mirrored light of a face by where it ends, sorted. `None` where the Sun does not light it.
    fn ends(&self, face: &MirrorFace) -> Option<SparseRow> {
        let pose = pose(self.load, face.joint);
        let sun = &self.load.sun;
        let normal = pose.matrix3 * face.normal;
        if !sun.iter().any(|sample| sample.flux > 0.0 && normal.dot(sample.direction) > GRAZING) {
            return None;
        }
        let starts: Vec<(DVec3, DVec3, &Start, DVec3, f64)> = (0..)
            .zip(&face.rays)
            .filter_map(|(number, start): (usize, _)| {
                let sample = &sun[number % sun.len()];
                let normal = pose.matrix3 * start.normal;
                let weight = sample.flux * normal.dot(sample.direction);
                let from = pose.transform_point3(start.place) + self.mirrors.start * normal;
                (weight > 0.0).then_some((from, normal, start, sample.direction, weight))
            })
            .collect();
        let lit: Vec<_> = starts.iter().filter(|(from, _, _, sun, _)| !self.is_hidden(*from, *sun)).collect();
        // Shadows by depth may light a patch that no ray to the Sun does.
        let lit = if lit.is_empty() { starts.iter().collect() } else { lit };
        let whole: f64 = lit.iter().map(|(.., weight)| weight).sum();
        if whole <= 0.0 {
            return Some(vec![(face.patch, 1.0)]);
        }
        let mut ends: SparseRow = Vec::new();
        for (from, normal, start, sun, weight) in lit {
            let end = self.end(*from, reflection(*sun, *normal, face.roughness, start.facet));
            ends.push((if end == INSIDE { face.patch } else { end }, weight / whole));
        }
        ends.sort_by_key(|(end, _)| *end);
        ends.dedup_by(|next, first| {
            let same = next.0 == first.0;
            first.1 += if same { next.1 } else { 0.0 };
            same
        });
        Some(ends)
    }

    fn is_hidden(&self, from: DVec3, direction: DVec3) -> bool {
        let mut trees = self.mirrors.joints.iter().zip(&self.from_body);
        trees.any(|(tree, frame)| tree.occluders.is_hidden(frame.transform_point3(from), frame.matrix3 * direction))
    }

    /// Where a ray ends: a patch, [`SPACE`] or [`INSIDE`].
    fn end(&self, from: DVec3, direction: DVec3) -> u32 {
        let (mut nearest, mut end) = (f64::INFINITY, SPACE);
        for (tree, frame) in self.mirrors.joints.iter().zip(&self.from_body) {
            let hit = tree.occluders.first(frame.transform_point3(from), frame.matrix3 * direction);
            if let Some(hit) = hit.filter(|hit| hit.distance < nearest) {
                nearest = hit.distance;
                end = match face_of(&tree.faces[hit.triangle], &hit) {
                    NONE => INSIDE,
                    patch => patch,
                };
            }
        }
        end
    }
}

fn pose(load: &StepLoad, joint: u32) -> DAffine3 {
    load.joints.get(joint as usize).copied().unwrap_or_default()
}

/// Direction in which a face with a unit normal mirrors light of the Sun. Where a facet would send light below the surface, a smooth mirror stands in
/// for it.
pub fn reflection(sun: DVec3, normal: DVec3, roughness: f64, facet: [f64; 2]) -> DVec3 {
    let cosine = normal.dot(sun);
    let smooth = 2.0 * cosine * normal - sun;
    if roughness == 0.0 {
        return smooth;
    }
    let along = sun - cosine * normal;
    let x = if along.length() > 1e-9 { along.normalize() } else { basis(normal)[0] };
    let way = facet_reflection(roughness, cosine, facet);
    if way.z > 0.0 { way.x * x + way.y * normal.cross(x) + way.z * normal } else { smooth }
}
