//! Casts the rays of patches on the device. Twin: `crate::exchange::cast`.

use std::ops::Range;
use std::sync::Arc;

use glam::DAffine3;

use super::bindings::Bindings;
use super::context::Context;
use super::error::GpuError;
use super::layout::{self, ExchangePass, ShadowTriangle};
use super::lists::{
    self, RAY_BOXES, RAY_CORNERS, RAY_ENDS, RAY_LEAVES, RAY_PATCHES, RAY_PLACED, RAY_POSES, RAY_TRIANGLES,
};
use super::once::Once;
use super::store::Resources;
use crate::environment::shadow::{LARGEST_TREE, tree_boxes};
use crate::exchange::cast::{INSIDE, Scenery};
use crate::exchange::patches::{NONE, PatchSurface, Patches};

/// Most rays of a dispatch, few enough that no driver stops it as hanging.
const AT_ONCE: u32 = 1 << 20;

/// Whether the device can walk the tree of a scenery. lavapipe ends the loops of an invocation after 65,535 turns.
pub(crate) fn can_walk(scenery: &Scenery) -> bool {
    tree_boxes(scenery.occluders.triangles.len()) <= LARGEST_TREE
}

/// Casts rays of the patches of a craft in one pose.
pub(crate) struct Caster {
    once: Once,
    resources: Resources,
    bindings: Bindings,
    /// Patches, rays of each, boxes of the tree, and patches of a dispatch.
    sizes: [u32; 4],
    start: f32,
}

impl Caster {
    /// Brings the craft to the device.
    ///
    /// # Errors
    /// Buffers beyond the device, or a call that fails.
    pub(crate) fn new(
        context: &Arc<Context>,
        surface: &PatchSurface,
        patches: &Patches,
        scenery: &Scenery,
        rays: u32,
    ) -> Result<Self, GpuError> {
        let count = patches.all.len() as u32;
        let together = (AT_ONCE / rays).clamp(1, count.max(1));
        let mut resources = Resources::new(context);
        fill(&mut resources, surface, patches, scenery)?;
        resources.make_of(&RAY_ENDS, (together * rays) as usize)?;
        let mut bindings = Bindings::plain(context);
        bindings
            .add(&resources, lists::rays(&ExchangePass { end: together, rays, ..ExchangePass::default() }).passes())?;
        let occluders = &scenery.occluders;
        let (boxes, start) = (tree_boxes(occluders.triangles.len()) as u32, occluders.start as f32);
        Ok(Self { once: Once::new(context)?, resources, bindings, sizes: [count, rays, boxes, together], start })
    }

    /// Where the rays of some patches end.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn ends(&mut self, of: Range<u32>) -> Result<Vec<u32>, GpuError> {
        let [count, rays, boxes, together] = self.sizes;
        let (start, last) = (self.start, of.end.min(count));
        let mut ends = Vec::with_capacity(of.len() * rays as usize);
        for first in of.step_by(together as usize) {
            let end = last.min(first + together);
            let list = lists::rays(&ExchangePass { first, end, rays, boxes, start });
            self.once.run([&list], &self.resources, Some(&self.bindings))?;
            ends.extend_from_slice(self.resources.read(&RAY_ENDS, 0, ((end - first) * rays) as usize));
        }
        Ok(ends)
    }
}

/// Casts the rays of all patches: where each ends, `rays` for each patch.
///
/// # Errors
/// Buffers beyond the device, or a call that fails.
pub fn cast(
    context: &Arc<Context>,
    surface: &PatchSurface,
    patches: &Patches,
    scenery: &Scenery,
    rays: u32,
) -> Result<Vec<u32>, GpuError> {
    let count = patches.all.len() as u32;
    if count == 0 || rays == 0 {
        return Ok(Vec::new());
    }
    Caster::new(context, surface, patches, scenery, rays)?.ends(0..count)
}

fn fill(
    resources: &mut Resources,
    surface: &PatchSurface,
    patches: &Patches,
    scenery: &Scenery,
) -> Result<(), GpuError> {
    let tree = scenery.occluders.tree();
    let (boxes, placed) = layout::shadow_tree(&tree, &scenery.occluders);
    let of_patch = |patch: &crate::exchange::patches::Patch| {
        [patch.corners.start as u32, patch.corners.end as u32, patch.joint, u32::from(patch.back)]
    };
    let triangle = |nodes: &[u32; 3]| {
        let [a, b, c] = nodes.map(|node| surface.positions[node as usize]);
        let four = |v: glam::DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
        ShadowTriangle { corner: four(a), first: four(b - a), second: four(c - a) }
    };
    let leaf = |number: &u32| {
        let nodes = surface.triangles[*number as usize];
        [0, 1].map(|back| {
            let [a, b, c] = nodes.map(|node| match patches.of_node[node as usize][back] {
                NONE => INSIDE,
                patch => patch,
            });
            [a, b, c, 0]
        })
    };
    let joints = patches.all.iter().map(|patch| patch.joint + 1).max().unwrap_or(1) as usize;
    let pose = |joint: usize| layout::rows(&scenery.poses.get(joint).copied().unwrap_or(DAffine3::IDENTITY));
    let corners = patches.corners.iter().map(|corner| [corner.corner, (corner.up_to as f32).to_bits()]);
    resources.make_with(&RAY_PATCHES, &patches.all.iter().map(of_patch).collect::<Vec<_>>())?;
    resources.make_with(&RAY_CORNERS, &corners.collect::<Vec<_>>())?;
    resources.make_with(&RAY_TRIANGLES, &surface.triangles.iter().map(triangle).collect::<Vec<_>>())?;
    resources.make_with(&RAY_POSES, &(0..joints).map(pose).collect::<Vec<_>>())?;
    resources.make_with(&RAY_LEAVES, &tree.order.iter().map(leaf).collect::<Vec<_>>())?;
    resources.make_with(&RAY_BOXES, &boxes)?;
    resources.make_with(&RAY_PLACED, &placed)
}
