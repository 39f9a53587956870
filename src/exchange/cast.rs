//! Casts the rays of every patch and finds where each ends. Every device takes these rays.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::directions::{basis, cosine_direction_across, shifts};
use super::patches::{Corner, NONE, PatchSurface, Patches};
use crate::environment::shadow::{Hit, Occluders, fractions as numbers_of, point_near_corner};
use crate::stop::Watch;
use crate::trace::span;

/// The end of a ray that leaves the craft.
pub(crate) const SPACE: u32 = u32::MAX;
/// The end of a ray on the inner face of a skin, which exchanges no heat. Only meshes that are open or that reach into each other have such rays.
pub(crate) const INSIDE: u32 = u32::MAX - 1;

/// The craft as placed by its joints, for rays.
#[derive(Debug, Clone)]
pub struct Scenery {
    /// Poses of the body and of the joints. None is the file's pose.
    pub(crate) poses: Vec<DAffine3>,
    pub(crate) occluders: Occluders,
}

impl Scenery {
    /// Places a surface.
    pub fn new(surface: &PatchSurface, poses: &[DAffine3]) -> Self {
        let placed = |(position, joint): (&DVec3, &u32)| match poses.get(*joint as usize) {
            Some(pose) => pose.transform_point3(*position),
            None => *position,
        };
        let positions: Vec<DVec3> = surface.positions.iter().zip(&surface.joints).map(placed).collect();
        Self { occluders: Occluders::new(&positions, &surface.triangles), poses: poses.to_vec() }
    }

    pub(super) fn placed(&self, [from, direction]: Ray, joint: u32) -> Ray {
        match self.poses.get(joint as usize) {
            Some(pose) => [pose.transform_point3(from), pose.matrix3 * direction],
            None => [from, direction],
        }
    }
}

/// A ray: its start [m] and its direction, a unit vector.
pub(crate) type Ray = [DVec3; 2];

/// The rays of a patch in the file's pose.
pub(crate) struct PatchRays {
    /// Where the numbers of the patch begin.
    shifts: [u32; 4],
    corners: Vec<CornerRays>,
}

/// A corner of a patch from which rays start.
struct CornerRays {
    /// Numbers of places below which rays start in the corner, and in the one before.
    up_to: f64,
    before: f64,
    /// The node and the two sides of its triangle [m], and which of the three the corner is.
    at: [DVec3; 3],
    place: usize,
    /// Unit normal of the face, and two at right angles to it.
    normal: DVec3,
    across: [DVec3; 2],
}

impl PatchRays {
    pub(crate) fn new(surface: &PatchSurface, patches: &Patches, patch: u32) -> Self {
        let origin = &patches.all[patch as usize];
        let mut before = 0.0;
        let corner = |corner: &Corner| {
            let [a, b, c] = surface.triangles[corner.corner as usize / 3].map(|node| surface.positions[node as usize]);
            let outward = (b - a).cross(c - a).normalize_or(DVec3::Z);
            let normal = if origin.back { -outward } else { outward };
            let (up_to, place, across) = (corner.up_to, corner.corner as usize % 3, basis(normal));
            CornerRays {
                up_to,
                before: std::mem::replace(&mut before, up_to),
                at: [a, b - a, c - a],
                place,
                normal,
                across,
            }
        };
        Self { shifts: shifts(patch), corners: patches.corners[origin.corners.clone()].iter().map(corner).collect() }
    }

    /// Where a ray with these numbers ([`super::directions::fractions`]) starts on the surface, and the unit normal of its face there.
    pub(super) fn start(&self, numbers: [f64; 4]) -> Ray {
        let (point, corner) = self.corner_and_start(numbers);
        [point, corner.normal]
    }

    fn corner_and_start(&self, [place, s, ..]: [f64; 4]) -> (DVec3, &CornerRays) {
        let at = self.corners.partition_point(|corner| corner.up_to < place).min(self.corners.len() - 1);
        let corner = &self.corners[at];
        // The place within its corner, scaled to [0, 1], is as evenly spread as the place itself.
        let within = ((place - corner.before) / (corner.up_to - corner.before)).clamp(0.0, 1.0);
        let [second, third] = point_near_corner([within, s], corner.place);
        let [a, to_second, to_third] = corner.at;
        (a + second * to_second + third * to_third, corner)
    }

    /// A ray, its start lifted off the surface by `lift` [m].
    pub(crate) fn ray(&self, ray: u32, lift: f64) -> Ray {
        let numbers = numbers_of(self.shifts, ray);
        let (point, corner) = self.corner_and_start(numbers);
        let [_, _, u, v] = numbers;
        [point + lift * corner.normal, cosine_direction_across(corner.normal, corner.across, [u, v])]
    }
}

/// Where a ray ends: a patch, [`SPACE`] or [`INSIDE`].
pub(crate) fn end_of(surface: &PatchSurface, patches: &Patches, occluders: &Occluders, [from, direction]: Ray) -> u32 {
    occluders.first(from, direction).map_or(SPACE, |hit| patch_at(surface, patches, hit.triangle, &hit))
}

/// Where a ray ends that meets a triangle: a patch, or [`INSIDE`].
pub(super) fn patch_at(surface: &PatchSurface, patches: &Patches, triangle: usize, hit: &Hit) -> u32 {
    match face_of(&surface.triangles[triangle].map(|node| patches.of_node[node as usize]), hit) {
        NONE => INSIDE,
        patch => patch,
    }
}

/// The patch that a ray meets: the patch of the nearest corner, on the side from which the ray comes. `faces` are the fronts and backs of the
/// corners.
pub(crate) fn face_of(faces: &[[u32; 2]; 3], hit: &Hit) -> u32 {
    let [first, second, third] = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let nearest = if first >= second.max(third) {
        0
    } else if second >= third {
        1
    } else {
        2
    };
    faces[nearest][usize::from(!hit.outside)]
}

/// Where each ray of some patches ends, `rays` for each.
pub(crate) fn cast_rays(
    surface: &PatchSurface,
    patches: &Patches,
    scenery: &Scenery,
    rays: u32,
    range: std::ops::Range<u32>,
) -> Vec<u32> {
    let _casts = span("casting rays");
    let occluders = &scenery.occluders;
    let mut ends = vec![SPACE; range.len() * rays as usize];
    let watch = Watch::begin();
    ends.par_chunks_mut(rays as usize).zip(range).for_each(|(ends, patch)| {
        if watch.is_over() {
            return;
        }
        let joint = patches.all[patch as usize].joint;
        let of_patch = PatchRays::new(surface, patches, patch);
        for (ray, end) in (0..rays).zip(ends) {
            let ray = scenery.placed(of_patch.ray(ray, occluders.start), joint);
            *end = end_of(surface, patches, occluders, ray);
        }
    });
    watch.look();
    ends
}
