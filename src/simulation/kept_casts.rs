//! Findings of rays for the poses of a craft, as a file keeps them, and their way back into a craft for which rays would find the same.

use std::sync::Arc;

use bytemuck::NoUninit;
use glam::DAffine3;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::exchange::ExchangeCraft;
use crate::exchange::packed::{PackedExchange, PoseFinding};
use crate::exchange::patches::{Corner, Patch, PatchSurface, Patches};
use crate::exchange::step::ExchangeSettings;
use crate::thermal::material::{Gloss, Optics};

/// Number of the way in which rays are cast and reflections are found. Raise it where the same craft gets other numbers, so that earlier files serve no more.
const WAY: u64 = 1;

/// Findings for poses of a craft.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct KeptCasts {
    /// SHA-256 of all on which a finding depends.
    craft: String,
    /// Poses of the joints, each with its finding.
    poses: Vec<KeptPose>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct KeptPose {
    poses: Vec<DAffine3>,
    #[serde(serialize_with = "write_finding", deserialize_with = "read_finding")]
    found: Arc<PoseFinding>,
}

fn write_finding<S: serde::Serializer>(found: &Arc<PoseFinding>, to: S) -> Result<S::Ok, S::Error> {
    found.as_ref().serialize(to)
}

fn read_finding<'de, D: serde::Deserializer<'de>>(from: D) -> Result<Arc<PoseFinding>, D::Error> {
    PoseFinding::deserialize(from).map(Arc::new)
}

/// Why a craft takes nothing that was kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum CastsMisfit {
    #[error("is of another craft, of other settings of [exchange] or of another way to cast rays")]
    Craft,
    #[error("is damaged: a finding has other lengths or numbers than the patches of the craft")]
    Content,
}

impl ExchangeCraft {
    /// How many times something was found for a pose, or taken from a file. A difference tells that it changed.
    pub(crate) fn found_so_far(&self) -> u64 {
        self.in_use.added()
    }

    /// The findings that are in memory.
    pub(crate) fn kept_casts(&self) -> KeptCasts {
        let kept = |(poses, packed): (Vec<DAffine3>, Arc<PackedExchange>)| KeptPose {
            poses,
            found: Arc::clone(packed.found()),
        };
        KeptCasts { craft: self.sum(), poses: self.in_use.latest().into_iter().map(kept).collect() }
    }

    /// Takes findings that were kept, so that nothing is cast for their poses. Returns their number.
    ///
    /// # Errors
    /// They are of another craft, or damaged. Those before a damaged one serve.
    pub(crate) fn take_casts(&self, kept: &KeptCasts) -> Result<usize, CastsMisfit> {
        if kept.craft != self.sum() {
            return Err(CastsMisfit::Craft);
        }
        for KeptPose { poses, found } in &kept.poses {
            let packed = PackedExchange::of_kept(found, &self.patches, self.settings.rays, self.bundles());
            self.in_use.add(poses, packed.ok_or(CastsMisfit::Content)?);
        }
        Ok(kept.poses.len())
    }

    /// SHA-256 of all on which the finding of a pose depends.
    fn sum(&self) -> String {
        let mut sum = CraftSum(Sha256::new());
        sum.add(&[WAY]);
        // Functions of other systems round otherwise.
        sum.add(std::env::consts::ARCH.as_bytes());
        sum.add(std::env::consts::OS.as_bytes());
        sum.add_settings(&self.settings);
        sum.add_surface(&self.surface);
        sum.add_patches(&self.patches);
        sum.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// A checksum over lists, each with its length before it.
struct CraftSum(Sha256);

impl CraftSum {
    fn add<T: NoUninit>(&mut self, values: &[T]) {
        self.0.update((values.len() as u64).to_le_bytes());
        self.0.update(bytemuck::cast_slice(values));
    }

    fn add_settings(&mut self, settings: &ExchangeSettings) {
        // The last two say when something is found.
        let ExchangeSettings { rays, patch_edge, bounces, specular_sunlight, redraw_angle: _, hold: _ } = *settings;
        self.add(&[rays, bounces.map_or(u32::MAX, |most| most), u32::from(bounces.is_some())]);
        self.add(&[patch_edge.unwrap_or(f64::NAN)]);
        self.add(&[u8::from(specular_sunlight)]);
    }

    fn add_surface(&mut self, surface: &PatchSurface) {
        let PatchSurface { positions, normals, areas, parts, materials, joints, triangles } = surface;
        self.add(positions);
        self.add(normals);
        self.add(areas);
        [parts, materials, joints].into_iter().for_each(|numbers| self.add(numbers));
        self.add(triangles);
    }

    /// The slopes follow from patches and positions.
    fn add_patches(&mut self, patches: &Patches) {
        let Patches { all, nodes, corners, of_node, slopes: _ } = patches;
        self.add(&[all.len()]);
        all.iter().for_each(|patch| self.add_patch(patch));
        self.add(&nodes.iter().map(|(node, _)| *node).collect::<Vec<_>>());
        self.add(&nodes.iter().map(|(_, share)| *share).collect::<Vec<_>>());
        self.add(&corners.iter().map(|Corner { corner, .. }| *corner).collect::<Vec<_>>());
        self.add(&corners.iter().map(|Corner { up_to, .. }| *up_to).collect::<Vec<_>>());
        self.add(of_node);
    }

    fn add_patch(&mut self, patch: &Patch) {
        // How fast a patch cools says when something is found.
        let Patch { joint, part, material, back, buried, optics, gloss, cooling: _, .. } = patch;
        let Patch { area, normal, centre, nodes, corners, .. } = patch;
        let Optics { absorptivity, emissivity } = *optics;
        let Gloss { specular, roughness, slope_variance, drawn_variance, seed } = *gloss;
        self.add(&[*joint, *part, *material, u32::from(*back), u32::from(*buried), seed]);
        self.add(&[absorptivity, emissivity, specular, roughness, slope_variance, drawn_variance, *area]);
        self.add(&[*normal, *centre]);
        self.add(&[nodes.start, nodes.end, corners.start, corners.end]);
    }
}

#[cfg(test)]
mod tests;
