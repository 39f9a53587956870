//! How uncertain the flux is that a patch absorbs from others [W/m2], one standard deviation for each cause.
//!
//! - Noise of rays: the variance of what a ray brings, over the number of rays ([`Exchange::errors`]), times what even spreading leaves of it ([`evenness`]). Light of pairs that
//!   were left out counts here.
//! - Size of patches: a patch receives one flux, so its nodes miss the gradient of what arrives. Patches of the same side of the same part around it tell the gradient, and the
//!   spread of the patch's nodes about its centre makes a flux of it ([`PatchSizes`]). A patch of a single node has no such error.
//! - Held light: what was held too long ([`Exchange::held_too_long`]), and rows that were held while a joint moved ([`held_rows`]).
//!
//! A flux becomes kelvin by [`Exchange::kelvin_per_flux`], in balance; a node with heat capacity sees less of it.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::directions::evenness;
use super::errors::FluxError;
use super::patches::{PatchSurface, Patches, bin};
use super::step::Exchange;

/// Standard deviations of the flux that a patch absorbs from others [W/m2].
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct FluxUncertainty {
    /// By the noise of rays, and by pairs that were left out.
    pub rays: f64,
    /// By the size of patches.
    pub size: f64,
    /// By light, infrared and rows that are held.
    pub held: f64,
}

/// Uncertainty of the flux by rows that are held for a share of the way between two poses: the flux by the rows of either, absorbed by each patch [W/m2].
/// A pose lies anywhere within the share, and rows are those of its middle, so the standard deviation is the share over the root of twelve.
pub(crate) fn held_rows(from: &[f64], to: &[f64], hold: f64) -> Vec<f64> {
    from.iter().zip(to).map(|(from, to)| (to - from).abs() * hold / 12f64.sqrt()).collect()
}

/// Neighbours from which the gradient over a patch is taken.
const NEIGHBOURS: usize = 8;
/// Part of the trace that is added to a matrix of distances, so that a direction in which neighbours hardly differ has no gradient: a row of patches tells none across itself.
const FLAT: f64 = 1e-2;

/// Extents of patches, and their neighbours.
#[derive(Debug, Clone, Default)]
pub(crate) struct PatchSizes {
    patches: Vec<PatchSize>,
}

/// A patch among its neighbours.
#[derive(Debug, Clone, Default)]
struct PatchSize {
    /// Second moments of the places of the nodes about the centre, by area [m2].
    moments: DMat3,
    /// Number of a neighbour, and the vector by which its difference in flux counts for the gradient [1/m].
    neighbours: Vec<(u32, DVec3)>,
}

impl PatchSizes {
    /// The patches of a surface, in the file's pose.
    pub(crate) fn new(surface: &PatchSurface, patches: &Patches) -> Self {
        let mut sides: BTreeMap<_, Vec<u32>> = BTreeMap::new();
        let key =
            |patch: &super::patches::Patch| (patch.joint, patch.part, patch.back, patch.buried, bin(patch.normal));
        for (number, patch) in (0..).zip(patches.all.iter()) {
            sides.entry(key(patch)).or_default().push(number);
        }
        let size = |(number, patch): (usize, &super::patches::Patch)| {
            let outer = |d: DVec3| DMat3::from_cols(d * d.x, d * d.y, d * d.z);
            let nodes = &patches.nodes[patch.nodes.clone()];
            let moment = |(node, share): &(u32, f64)| outer(surface.positions[*node as usize] - patch.centre) * *share;
            let moments = nodes.iter().map(moment).fold(DMat3::ZERO, |sum, one| sum + one);
            let mut near: Vec<(u32, DVec3)> = (sides[&key(patch)].iter())
                .filter(|other| **other as usize != number)
                .map(|other| (*other, patches.all[*other as usize].centre - patch.centre))
                .filter(|(_, way)| way.length_squared() > 0.0)
                .collect();
            near.sort_by(|a, b| a.1.length_squared().total_cmp(&b.1.length_squared()));
            near.truncate(NEIGHBOURS);
            // Patches around the same centre, such as rings, tell no gradient, so a distance counts against the spread of the patch.
            let spread = moments.x_axis.x + moments.y_axis.y + moments.z_axis.z;
            let weight = |way: DVec3| (way.length_squared() + spread).recip();
            let square = |(_, way): &(u32, DVec3)| outer(*way) * weight(*way);
            let squares = near.iter().map(square).fold(DMat3::ZERO, |sum, one| sum + one);
            let trace = squares.x_axis.x + squares.y_axis.y + squares.z_axis.z;
            let inverse = (squares + DMat3::from_diagonal(DVec3::splat((FLAT * trace).max(FLAT)))).inverse();
            let counted = |(other, way): (u32, DVec3)| (other, inverse * way * weight(way));
            PatchSize { moments, neighbours: near.into_iter().map(counted).collect() }
        };
        Self { patches: patches.all.par_iter().enumerate().map(size).collect() }
    }

    /// Uncertainty of the flux on the nodes of each patch [W/m2], where patches absorb these fluxes [W/m2].
    pub(crate) fn flux(&self, absorbed: &[f64]) -> Vec<f64> {
        let of = |(number, size): (usize, &PatchSize)| {
            let apart = |(other, weight): &(u32, DVec3)| *weight * (absorbed[*other as usize] - absorbed[number]);
            let gradient: DVec3 = size.neighbours.iter().map(apart).sum();
            gradient.dot(size.moments * gradient).max(0.0).sqrt()
        };
        self.patches.par_iter().enumerate().map(of).collect()
    }
}

impl Exchange {
    /// Uncertainty of the flux that each patch absorbs [W/m2], with its errors ([`Exchange::errors`]). `held` is the excess by what is held [W/m2], where it is known.
    pub(crate) fn uncertainty(
        &self,
        errors: &[FluxError],
        absorbed: &[f64],
        sizes: &PatchSizes,
        held: Option<&[f64]>,
    ) -> Vec<FluxUncertainty> {
        let even = evenness(self.factors.rays);
        let size = sizes.flux(absorbed);
        let of = |(number, error): (usize, &FluxError)| FluxUncertainty {
            rays: (even * error.noise).hypot(error.left_out),
            size: size[number],
            held: held.map_or(0.0, |held| held[number].abs()),
        };
        errors.iter().enumerate().map(of).collect()
    }
}
