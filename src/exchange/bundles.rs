//! The bundles of rays that keep the sky of every patch. Their directions never change in the frame of a patch, so for a pose only what is open is counted.

use std::sync::Arc;

use rayon::prelude::*;

use super::cast::{PatchRays, SPACE};
use super::directions::fractions;
use super::patches::{PatchSurface, Patches};
use super::sky::{PatchRay, bundles_of, gathered, opened};

/// Most rays of a patch that keep its sky.
pub(crate) const SKY_RAYS: u32 = 4096;

/// The bundles of all patches.
#[derive(Debug)]
pub(crate) struct SkyBundles {
    /// Rays of each patch, and how many of them keep its sky.
    rays: [usize; 2],
    /// Numbers of the rays of each patch, one bundle after the other.
    order: Vec<u16>,
    /// Words of the bundles, of which nothing is open.
    pub(super) words: Arc<Vec<u32>>,
}

impl SkyBundles {
    /// The bundles of patches with so many rays each.
    pub(crate) fn new(surface: &PatchSurface, patches: &Patches, rays: u32) -> Self {
        let kept = rays.min(SKY_RAYS);
        let of_patch = |patch: u32| {
            let rays = PatchRays::new(surface, patches, patch);
            let ray = |ray| {
                let [.., s, t] = fractions(patch, ray);
                PatchRay { place: [s, t], direction: rays.ray(ray, 0.0)[1] }
            };
            gathered(&(0..kept).map(ray).collect::<Vec<_>>())
        };
        let (order, words): (Vec<Vec<u16>>, Vec<Vec<u32>>) =
            (0..patches.all.len() as u32).into_par_iter().map(of_patch).unzip();
        Self { rays: [rays as usize, kept as usize], order: order.concat(), words: Arc::new(words.concat()) }
    }

    /// Bundles of a patch.
    pub(super) fn of_patch(&self) -> usize {
        bundles_of(self.rays[1])
    }

    /// Words of the bundles of all patches whose rays end at `ends`.
    pub(super) fn opened(&self, ends: &[u32]) -> Vec<u32> {
        let [rays, kept] = self.rays;
        let patches =
            ends.par_chunks(rays).zip(self.order.par_chunks(kept)).zip(self.words.par_chunks(self.of_patch()));
        let words = patches.flat_map_iter(|((ends, order), words)| {
            opened(order, words, |ray| ends[usize::from(ray)] == SPACE).collect::<Vec<_>>()
        });
        words.collect()
    }
}
