//! Finds triangles that lie in the face of another surface, such as a panel that was drawn exactly in the skin of a box.
//!
//! A ray starts a little off its surface. From one face it begins behind the other, so neither of the two exchanges heat or takes light as it should, and
//! an image shows now one, now the other. Two skins that touch back to back are no such faces: nobody sees either.

use glam::DVec3;
use rayon::prelude::*;

use super::patches::PatchSurface;
use crate::environment::shadow::Occluders;

/// Least cosine between normals of faces that lie in each other: 2.6 deg. Surfaces that cross at a larger angle lie in each other along a line alone.
const PARALLEL: f64 = 0.999;

/// For each triangle, whether its centre lies in the face of another triangle that is seen from the same side. `single` says which triangles have an outer
/// face only. A triangle with the same corners is not counted: `same` tells those.
pub(super) fn lie_in_others(
    surface: &PatchSurface,
    single: impl Fn(usize) -> bool + Sync,
    same: impl Fn(usize, usize) -> bool + Sync,
) -> Vec<bool> {
    let occluders = Occluders::new(&surface.positions, &surface.triangles);
    let normal = |triangle: usize| {
        let [_, one, other] = occluders.triangles[triangle];
        one.cross(other).normalize_or_zero()
    };
    let seen_alike = |triangle: usize, other: usize| {
        let both = single(triangle) && single(other);
        let along = normal(triangle).dot(normal(other));
        if both { along > PARALLEL } else { along.abs() > PARALLEL }
    };
    let lies = |triangle: usize| {
        let [corner, one, other] = occluders.triangles[triangle];
        let centre = corner + (one + other) / 3.0;
        let away = normal(triangle);
        let counts = |other: usize| other != triangle && seen_alike(triangle, other) && !same(triangle, other);
        let ray = [centre + occluders.start * away, -away];
        away != DVec3::ZERO && occluders.first_among(ray, 2.0 * occluders.start, counts).is_some()
    };
    (0..surface.triangles.len()).into_par_iter().map(lies).collect()
}
