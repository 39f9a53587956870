//! Sunlight on the craft: the lit area vector of every node, and the shadows of the craft on itself.
//!
//! Rays tell what hides the Sun ([`Occluders`]). The triangles of the model cast the shadows, before they are split for more nodes: the surface is the same,
//! and the cost of a ray hardly depends on the node density.

mod boxes;
mod closed;
pub(crate) mod corner;
mod joint_trees;
mod jointed;
mod kept_light;
mod lit_area;
mod lit_corners;
mod lit_surface;
mod occluder;
mod outline;
mod points;
mod rays;
mod redraw;
mod sunlit;
mod sunward;
mod tree;

pub(crate) use joint_trees::JointTrees;
pub(crate) use jointed::Jointed;
pub(crate) use kept_light::KeptLight;
pub(crate) use lit_area::NodesInSun;
pub use lit_area::{Lit, LitAreas};
pub(crate) use lit_corners::CornerLight;
pub(crate) use lit_surface::{LitNode, LitSurface};
pub(crate) use points::{fractions, point_near_corner};
pub(crate) use rays::Hit;
pub use rays::Occluders;
pub(crate) use redraw::{LightAndPoses, Redraw, turn_between};
pub use sunlit::LitArea;
pub(crate) use sunward::Caster;
pub(crate) use tree::{LARGEST_TREE, Tree, tree_boxes};

/// Angular radius of the Sun's disc at 1 au [rad]: 695,700 km (IAU 2015 resolution B3) over 149,597,870.7 km.
pub(crate) const SUN_ANGULAR_RADIUS: f64 = 695_700.0 / 149_597_870.7;

#[cfg(test)]
mod tests;
