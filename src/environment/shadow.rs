//! Shadows of the craft on itself: the share of the Sun that each node sees.
//!
//! There are two methods. [`DepthMap`], the fast method, holds the depth of the parts as seen from the Sun and filters a few texels around each node,
//! so that shadow edges move smoothly (twins: `glsl/solar_depth.vert` and `glsl/solar_visibility.comp`). [`Occluders`], the exact method, sends rays
//! to points of the Sun's disc, through a tree of boxes (twin: `glsl/solar_rays.comp`). The exact method is the reference for the fast one.
//!
//! The triangles of the model cast the shadows, before they are split for more nodes. The surface is the same, and the cost does not depend on the node
//! density.

use glam::DVec3;

mod depth_map;
mod rays;
mod redraw;
mod shadows;
mod tree;

pub use depth_map::DepthMap;
pub use depth_map::SunProjection;
pub use rays::Occluders;
pub(crate) use rays::{Hit, SUN_RAYS, disc_directions};
pub(crate) use redraw::{LightAndPoses, Redraw};
pub(crate) use shadows::Jointed;
pub use shadows::ShadowCasters;
pub use shadows::ShadowMethod;
pub(crate) use tree::{LARGEST_TREE, Tree, tree_boxes};

/// Angular radius of the Sun's disc at 1 au [rad]: 695,700 km (IAU 2015 resolution B3) over 149,597,870.7 km.
pub(crate) const SUN_ANGULAR_RADIUS: f64 = 695_700.0 / 149_597_870.7;

/// The normal of a surface on the side of the Sun: the given normal or its opposite.
fn lit_side(normal: DVec3, sun: DVec3) -> DVec3 {
    if normal.dot(sun) < 0.0 { -normal } else { normal }
}

#[cfg(test)]
mod tests;
