//! Faces of nodes that lie inside other parts, so that they share no patch with faces in the open.
//!
//! A part that reaches into another one has nodes on both sides of its skin. In one patch the light that comes back from the inner face would also warm the nodes outside.

use rayon::prelude::*;

use super::cast::{INSIDE, Scenery, cast_rays};
use super::patches::{NONE, PatchSurface, Patches};
use crate::thermal::material::Material;

/// Rays of each face. More would only place the border between two nodes more evenly.
const RAYS: u32 = 16;

/// Size of patches [m] of which each has the nodes of a single place.
const ONE_PLACE: f64 = 1e-6;

/// Whether the front and the back of each node see mostly inner faces, in the file's pose.
pub fn buried(surface: &PatchSurface, materials: &[Material]) -> Vec<[bool; 2]> {
    let faces = Patches::new(surface, materials, ONE_PLACE, &[]);
    let count = faces.all.len() as u32;
    let ends = cast_rays(surface, &faces, &Scenery::new(surface, &[]), RAYS, 0..count);
    let inside = |ends: &[u32]| 2 * ends.iter().filter(|end| **end == INSIDE).count() > RAYS as usize;
    let of_face: Vec<bool> = ends.par_chunks(RAYS as usize).map(inside).collect();
    let of_node = |faces: &[u32; 2]| faces.map(|face| face != NONE && of_face[face as usize]);
    faces.of_node.iter().map(of_node).collect()
}
