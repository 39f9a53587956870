//! Casts the rays of every patch and finds where each ends. Every device takes these rays.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::directions::{cosine_direction, fractions};
use super::patches::{NONE, PatchSurface, Patches};
use crate::environment::shadow::{Hit, Occluders, point_near_corner};
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

    fn placed(&self, [from, direction]: Ray, joint: u32) -> Ray {
        match self.poses.get(joint as usize) {
            Some(pose) => [pose.transform_point3(from), pose.matrix3 * direction],
            None => [from, direction],
        }
    }
}

/// A ray: its start [m] and its direction, a unit vector.
pub(crate) type Ray = [DVec3; 2];

/// A ray of a patch in the file's pose, its start lifted off the surface by `start` [m].
pub(crate) fn ray_of(surface: &PatchSurface, patches: &Patches, start: f64, patch: u32, ray: u32) -> Ray {
    let numbers = fractions(patch, ray);
    let [point, normal] = start_at(surface, patches, patch, numbers);
    let [_, _, u, v] = numbers;
    [point + start * normal, cosine_direction(normal, [u, v])]
}

/// Where a ray with these numbers ([`fractions`]) starts on a patch in the file's pose, and the unit normal of its face there.
pub(crate) fn start_at(surface: &PatchSurface, patches: &Patches, patch: u32, [place, s, ..]: [f64; 4]) -> Ray {
    let origin = &patches.all[patch as usize];
    let corners = &patches.corners[origin.corners.clone()];
    let at = corners.partition_point(|corner| corner.up_to < place).min(corners.len() - 1);
    let before = if at == 0 { 0.0 } else { corners[at - 1].up_to };
    // The place within its corner, scaled to [0, 1], is as evenly spread as the place itself.
    let within = ((place - before) / (corners[at].up_to - before)).clamp(0.0, 1.0);
    let corner = corners[at].corner as usize;
    let [a, b, c] = surface.triangles[corner / 3].map(|node| surface.positions[node as usize]);
    let [second, third] = point_near_corner([within, s], corner % 3);
    let outward = (b - a).cross(c - a).normalize_or(DVec3::Z);
    let normal = if origin.back { -outward } else { outward };
    [a + second * (b - a) + third * (c - a), normal]
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
pub fn cast_rays(
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
        for (ray, end) in (0..rays).zip(ends) {
            let ray = scenery.placed(ray_of(surface, patches, occluders.start, patch, ray), joint);
            *end = end_of(surface, patches, occluders, ray);
        }
    });
    watch.look();
    ends
}
