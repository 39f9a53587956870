//! Sunlight on the craft: the lit area vector of every node. The host finds it (docs/numerics.md), so a frame has no pass of it.

use crate::gpu::resource::Pieces::Always;
use crate::gpu::resource::Role::Storage;
use crate::gpu::resource::{GROUP, Per, Resource, resources};
use crate::gpu::scene_data::{SceneData, only};

resources! {
    /// x of the lit area vector of every node.
    LIT_X = Resource::new("LitX", GROUP, Storage, Per::Node, lit_groups).in_pieces(Always);
    /// y of the lit area vector of every node.
    LIT_Y = Resource::new("LitY", GROUP, Storage, Per::Node, lit_groups).in_pieces(Always);
    /// z of the lit area vector of every node.
    LIT_Z = Resource::new("LitZ", GROUP, Storage, Per::Node, lit_groups).in_pieces(Always);
    /// Share of the sunlight of every node that falls on its front.
    LIT_FRONT = Resource::new("LitFront", GROUP, Storage, Per::Node, lit_groups).in_pieces(Always);
}

fn lit_groups(data: &SceneData<'_>) -> usize {
    only(data.light.is_some(), data.groups())
}
