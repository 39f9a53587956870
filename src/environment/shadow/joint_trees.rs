//! The triangles that cast shadows, with a tree for each joint in its own frame. Where a joint turns, rays turn, and no tree is built.

use glam::{DAffine3, DVec3};

use super::Occluders;
use super::sunward::Caster;

/// The triangles that cast shadows.
pub(crate) struct JointTrees {
    /// Joint and triangles.
    trees: Vec<(usize, Occluders)>,
    /// Distance between a ray's start and its surface [m].
    pub(crate) start: f64,
}

impl JointTrees {
    pub(super) fn new(casters: &[Caster]) -> Self {
        let tree = |caster: &Caster| {
            let positions: Vec<DVec3> = caster.triangles().flatten().collect();
            let corners: Vec<[u32; 3]> =
                (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            (caster.joint as usize, Occluders::new(&positions, &corners))
        };
        let trees: Vec<(usize, Occluders)> = casters.iter().map(tree).collect();
        let start = trees.iter().map(|(_, tree)| tree.start).fold(0.0, f64::max);
        Self { trees, start }
    }

    /// Whether a triangle lies in a direction from a point, at most so far away [m]. `frame` takes places of the body into the frame of a joint. Without it the joint has not moved.
    pub(crate) fn hide<'a>(
        &self,
        from: DVec3,
        direction: DVec3,
        most: f64,
        frame: impl Fn(usize) -> Option<&'a DAffine3>,
    ) -> bool {
        self.trees.iter().any(|(joint, tree)| {
            let (from, direction) = frame(*joint)
                .map_or((from, direction), |frame| (frame.transform_point3(from), frame.transform_vector3(direction)));
            if most < f64::INFINITY {
                tree.first_within(from, direction, most).is_some()
            } else {
                tree.is_hidden(from, direction)
            }
        })
    }
}
