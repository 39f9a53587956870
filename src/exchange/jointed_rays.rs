//! Rays of a craft whose parts hang on joints, pose after pose.
//!
//! A ray and the surface of its own joint never move against each other, so where they meet is found once. For a pose only the surfaces of other joints
//! are tried, up to that place, each by a tree in its own frame. Patches that no other joint stands before cast nothing, and most rays of others point past the boxes around
//! these joints.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::cast::{PatchRays, SPACE, patch_at};
use super::patches::{PatchSurface, Patches};
use crate::environment::shadow::Occluders;
use crate::stop::Watch;
use crate::trace::span;

/// Most joints with trees of their own. A ray asks each box.
const MOST_JOINTS: usize = 64;
/// Most memory for the places where rays meet the surface of their own joint [B].
const MEMORY: usize = 128 << 20;
/// Growth of the box around a joint, over its diagonal.
const GROWTH: f64 = 1e-6;
/// Share of a distance that is rounding.
const ROUNDING: f64 = 1e-9;

/// The surface of a joint in the file's pose.
#[derive(Debug)]
struct JointSurface {
    occluders: Occluders,
    /// Number of each of its triangles among all.
    numbers: Vec<usize>,
    /// Corners of the box around it [m].
    bounds: [DVec3; 2],
}

/// Where a ray meets the surface of its own joint.
#[derive(Debug, Clone, Copy)]
struct Met {
    /// Distance [m], infinite where the ray leaves the joint.
    distance: f32,
    /// Patch, [`SPACE`] or [`super::cast::INSIDE`].
    end: u32,
}

/// Rays of the patches of a craft with joints.
#[derive(Debug)]
pub(crate) struct JointedRays {
    /// `None` where a joint has no surface.
    joints: Vec<Option<JointSurface>>,
    rays: u32,
    /// Distance between a ray's start and its surface [m].
    start: f64,
    /// Where the rays of all patches meet their own joint. `None` where this takes too much memory.
    met: Option<Vec<Met>>,
}

/// A joint that may stand before a patch, and the way from the frame of the patch into its frame.
struct Before<'a> {
    joint: &'a JointSurface,
    way: &'a DAffine3,
    /// Centre [m], in the frame of the patch, and square of the radius [m2] of a ball around the joint.
    ball: (DVec3, f64),
}

impl JointedRays {
    /// The rays of patches, `rays` for each. `None` where one tree around the whole craft serves: without joints, with a great many, and where a triangle hangs on two.
    pub(crate) fn new(surface: &PatchSurface, patches: &Patches, rays: u32) -> Option<Self> {
        let count = surface.joints.iter().max().map_or(0, |joint| *joint as usize + 1);
        let joint_of = |triangle: &[u32; 3]| triangle.map(|node| surface.joints[node as usize]);
        let spans_two = |triangle: &[u32; 3]| joint_of(triangle).windows(2).any(|pair| pair[0] != pair[1]);
        if !(2..=MOST_JOINTS).contains(&count) || surface.triangles.iter().any(spans_two) {
            return None;
        }
        let of_joint = |joint: u32| {
            let is_own = |number: &usize| joint_of(&surface.triangles[*number])[0] == joint;
            let numbers: Vec<usize> = (0..surface.triangles.len()).filter(is_own).collect();
            let triangles: Vec<[u32; 3]> = numbers.iter().map(|number| surface.triangles[*number]).collect();
            (!triangles.is_empty()).then(|| {
                let occluders = Occluders::new(&surface.positions, &triangles);
                let [low, high] = occluders.bounds;
                let growth = DVec3::splat(GROWTH * low.distance(high));
                JointSurface { occluders, numbers, bounds: [low - growth, high + growth] }
            })
        };
        let joints: Vec<Option<JointSurface>> = (0..count as u32).map(of_joint).collect();
        let start = joints.iter().flatten().map(|joint| joint.occluders.start).fold(0.0, f64::max);
        let mut own = Self { joints, rays, start, met: None };
        let all = patches.all.len() * rays as usize;
        if all * size_of::<Met>() <= MEMORY {
            let mut met = vec![Met { distance: f32::INFINITY, end: SPACE }; all];
            let watch = Watch::begin();
            met.par_chunks_mut(rays as usize).enumerate().for_each(|(patch, met)| {
                let of_patch = PatchRays::new(surface, patches, patch as u32);
                for (ray, met) in (0..rays).zip(met).take_while(|_| !watch.is_over()) {
                    *met = own.meet(surface, patches, (&of_patch, patch), ray);
                }
            });
            watch.look();
            own.met = Some(met);
        }
        Some(own)
    }

    /// Where a ray of a patch with a number meets the surface of its own joint.
    fn meet(&self, surface: &PatchSurface, patches: &Patches, (rays, patch): (&PatchRays, usize), ray: u32) -> Met {
        if let Some(met) = &self.met {
            return met[patch * self.rays as usize + ray as usize];
        }
        let nothing = Met { distance: f32::INFINITY, end: SPACE };
        let Some(own) = &self.joints[patches.all[patch].joint as usize] else { return nothing };
        let [from, direction] = rays.ray(ray, self.start);
        own.occluders.first(from, direction).map_or(nothing, |hit| Met {
            distance: (hit.distance as f32).next_up(),
            end: patch_at(surface, patches, own.numbers[hit.triangle], &hit),
        })
    }

    /// Where each ray of the patches ends, with joints in these poses.
    pub(crate) fn cast(&self, surface: &PatchSurface, patches: &Patches, poses: &[DAffine3]) -> Vec<u32> {
        let _casts = span("casting rays");
        let pose = |joint: usize| poses.get(joint).copied().unwrap_or(DAffine3::IDENTITY);
        let count = self.joints.len();
        // From the frame of each joint into each other one.
        let ways: Vec<Vec<DAffine3>> =
            (0..count).map(|from| (0..count).map(|to| pose(to).inverse() * pose(from)).collect()).collect();
        let mut ends = vec![SPACE; patches.all.len() * self.rays as usize];
        let watch = Watch::begin();
        ends.par_chunks_mut(self.rays as usize).enumerate().for_each(|(patch, ends)| {
            if watch.is_over() {
                return;
            }
            let before = self.before(surface, patches, patch, &ways);
            let of_patch = PatchRays::new(surface, patches, patch as u32);
            for (ray, end) in (0..self.rays).zip(ends) {
                let met = self.meet(surface, patches, (&of_patch, patch), ray);
                *end = met.end;
                if !before.is_empty() {
                    *end = first_end(surface, patches, &before, of_patch.ray(ray, self.start), met);
                }
            }
        });
        watch.look();
        ends
    }

    /// The other joints that may stand before a patch: a corner of the box around them lies above the plane of one of its triangles.
    fn before<'a>(
        &'a self,
        surface: &PatchSurface,
        patches: &Patches,
        patch: usize,
        ways: &'a [Vec<DAffine3>],
    ) -> Vec<Before<'a>> {
        let origin = &patches.all[patch];
        let mut triangles: Vec<u32> =
            patches.corners[origin.corners.clone()].iter().map(|corner| corner.corner / 3).collect();
        triangles.dedup();
        let planes: Vec<[DVec3; 2]> = (triangles.iter())
            .map(|triangle| {
                let [a, b, c] = surface.triangles[*triangle as usize].map(|node| surface.positions[node as usize]);
                let outward = (b - a).cross(c - a);
                [a, if origin.back { -outward } else { outward }]
            })
            .collect();
        let own = origin.joint as usize;
        let others = self.joints.iter().enumerate().filter(|(number, _)| *number != own);
        let before = others.filter_map(|(number, joint)| {
            let joint = joint.as_ref()?;
            let back = ways[number][own];
            let corners: [DVec3; 8] = std::array::from_fn(|k| {
                let axis = |axis: usize| joint.bounds[k >> axis & 1][axis];
                back.transform_point3(DVec3::new(axis(0), axis(1), axis(2)))
            });
            let is_above = |[at, outward]: &[DVec3; 2]| corners.iter().any(|corner| (corner - at).dot(*outward) >= 0.0);
            let ball = (0.5 * (corners[0] + corners[7]), 0.25 * corners[0].distance_squared(corners[7]));
            planes.iter().any(is_above).then_some(Before { joint, way: &ways[own][number], ball })
        });
        before.collect()
    }
}

/// Where a ray ends that meets its own joint at `met`, with other joints before it.
fn first_end(
    surface: &PatchSurface,
    patches: &Patches,
    before: &[Before<'_>],
    [from, direction]: [DVec3; 2],
    met: Met,
) -> u32 {
    let (mut most, mut end) = (f64::from(met.distance), met.end);
    for Before { joint, way, ball } in before {
        if misses(ball, from, direction) {
            continue;
        }
        let [from, direction] = [way.transform_point3(from), way.matrix3 * direction];
        if !reaches(&joint.bounds, from, direction, most) {
            continue;
        }
        if let Some(hit) = joint.occluders.first_within(from, direction, most) {
            most = hit.distance;
            end = patch_at(surface, patches, joint.numbers[hit.triangle], &hit);
        }
    }
    end
}

/// Whether a ray passes a ball by more than rounding. Most rays do, and need not be turned into the frame of another joint.
fn misses((centre, square): &(DVec3, f64), from: DVec3, direction: DVec3) -> bool {
    let to = *centre - from;
    let (along, distance) = (to.dot(direction), to.length_squared());
    let margin = square + ROUNDING * distance;
    distance > margin && (along < 0.0 || distance - along * along > margin)
}

/// Whether a ray meets a box within a distance.
fn reaches([low, high]: &[DVec3; 2], from: DVec3, direction: DVec3, most: f64) -> bool {
    let inverse = direction.recip();
    let [a, b] = [(low - from) * inverse, (high - from) * inverse];
    // A ray in the plane of a side gives no number there, which these functions pass over.
    let side = |of: fn(f64, f64) -> f64| [0, 1, 2].map(|axis| of(a[axis], b[axis]));
    let enters = side(f64::min).into_iter().fold(0.0, f64::max);
    let leaves = side(f64::max).into_iter().fold(most, f64::min);
    enters <= leaves
}
