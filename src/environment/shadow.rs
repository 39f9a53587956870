//! The craft's shadow on itself: what share of the Sun each node sees.
//!
//! Two ways to find it. [`DepthMap`] is fast: the depth of the parts as seen from the Sun, and a filter of a few texels
//! around each node, so that the edge of a shadow moves smoothly; twin of `glsl/solar_depth.vert` and
//! `glsl/solar_visibility.comp`. [`Occluders`] is exact: rays to points of the Sun's disc, against a tree of boxes; twin
//! of `glsl/solar_rays.comp`, and what the fast way is measured against.
//!
//! What casts the shadow are the triangles of the model before they are split for the sake of nodes: the surface is the
//! same, and the cost does not follow the density of nodes.

use glam::DVec3;

mod depth_map;
mod rays;
mod redraw;
mod shadows;
mod tree;

pub use depth_map::{DepthMap, SunView};
pub use rays::{Occluders, SUN_RAYS, disc_directions};
pub use redraw::Redraw;
pub use shadows::{Jointed, Method, Shadows};
pub use tree::{LARGEST_TREE, Tree, TreeNode, tree_boxes};

/// Angular radius of the Sun's disc at 1 au [rad]: 695,700 km (IAU 2015 resolution B3) over 149,597,870.7 km.
pub const SUN_ANGULAR_RADIUS: f64 = 695_700.0 / 149_597_870.7;

/// The side of a surface that the Sun can shine on: its normal, or the opposite one.
fn lit_side(normal: DVec3, sun: DVec3) -> DVec3 {
    if normal.dot(sun) < 0.0 { -normal } else { normal }
}

#[cfg(test)]
mod tests;
