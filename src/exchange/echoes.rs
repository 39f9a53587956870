//! Light that goes to and fro between shiny surfaces close together, as in a gap between two foils.
//!
//! A patch reflects from all of its surface. So each reflection moves light by the width of the patch, where it truly moves by a few widths of the gap. Where light is reflected
//! many times, patches wider than the gap thus spread it too far. Finding where it truly goes asks for patches as small as the gap. How much is spread is told as an error
//! ([`super::slopes::Slopes::errors`]).

use rayon::prelude::*;

use super::cast::{PatchRays, Scenery};
use super::patches::{Patch, PatchSurface, Patches};

/// Share of light that comes back after two reflections below which a face has no echo.
const LEAST: f64 = 0.3;
/// Rays of a face that tell how far light goes between two reflections.
const RAYS: u32 = 32;

/// How light comes back to a face.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Echo {
    /// Share of the light of the face that comes back after two reflections, the larger one of infrared and sunlight.
    pub(super) share: f64,
    /// Mean way from the face to what it sees of the craft [m].
    pub(super) way: f64,
}

impl Echo {
    /// Share of what a patch of this area [m2] absorbs of others that reflections carry too far. A reflection by squares with the side s moves light along the surface by s^2 / 6
    /// in the mean of squares, and within a gap of the width g by about 2 g^2, where ways are 2 g long.
    fn spread(&self, area: f64) -> f64 {
        if self.share == 0.0 { 0.0 } else { self.share * self.share * area / (area + 3.0 * self.way * self.way) }
    }
}

/// The echo of each face, each of a single node, whose rays end on these faces.
pub(super) fn echoes(
    surface: &PatchSurface,
    faces: &Patches,
    scenery: &Scenery,
    ends: &[u32],
    rays: usize,
) -> Vec<Echo> {
    let lost = |face: &Patch| [face.optics.emissivity, face.optics.absorptivity];
    let echo = |(number, ends): (usize, &[u32])| {
        let mut back = [0.0; 2];
        for face in ends.iter().filter_map(|end| faces.all.get(*end as usize)) {
            back.iter_mut().zip(lost(face)).for_each(|(back, lost)| *back += (1.0 - lost) / rays as f64);
        }
        let own = lost(&faces.all[number]);
        let share = (0..2).map(|kind| back[kind] * (1.0 - own[kind])).fold(0.0, f64::max);
        if share < LEAST {
            return Echo::default();
        }
        let of_face = PatchRays::new(surface, faces, number as u32);
        let way = |ray: u32| {
            let ray = scenery.placed(of_face.ray(ray, scenery.occluders.start), faces.all[number].joint);
            scenery.occluders.first(ray[0], ray[1]).map(|hit| hit.distance)
        };
        let ways: Vec<f64> = (0..RAYS).filter_map(way).collect();
        Echo { share, way: ways.iter().sum::<f64>() / ways.len().max(1) as f64 }
    };
    ends.par_chunks(rays).enumerate().map(echo).collect()
}

/// Share of what each patch absorbs of others that reflections carry too far, from the echoes of the front and the back of each node. Empty where no patch has an echo.
pub(super) fn spread(patches: &Patches, of_nodes: &[[Echo; 2]]) -> Vec<f64> {
    let of_patch = |patch: &Patch| -> f64 {
        let nodes = &patches.nodes[patch.nodes.clone()];
        nodes
            .iter()
            .map(|(node, share)| share * of_nodes[*node as usize][usize::from(patch.back)].spread(patch.area))
            .sum()
    };
    let all: Vec<f64> = patches.all.par_iter().map(of_patch).collect();
    if all.iter().any(|share| *share > 0.0) { all } else { Vec::new() }
}
