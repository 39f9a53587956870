//! Structures of rays against the triangles of the craft.

use super::shared::shared;
use crate::environment::shadow::{Occluders, Tree};

shared! {
    /// A node of the bounding box tree for rays.
    pub(crate) struct ShadowBox {
        /// Lower corner [m].
        pub(crate) low: [f32; 3],
        /// Index of the next box if the ray misses this one.
        pub(crate) skip: u32,
        /// Upper corner [m].
        pub(crate) high: [f32; 3],
        /// First triangle times 8 plus the number of triangles. The number is 0 for an inner box.
        pub(crate) triangles: u32,
    }

    /// A triangle that rays may meet.
    pub(crate) struct ShadowTriangle {
        /// A corner [m].
        pub(crate) corner: [f32; 4],
        /// Edge from that corner to the second one [m].
        pub(crate) first: [f32; 4],
        /// Edge from that corner to the third one [m].
        pub(crate) second: [f32; 4],
    }
}

/// Rows of a rigid motion, rounded to f32.
pub(crate) fn rows(motion: &glam::DAffine3) -> [[f32; 4]; 3] {
    [0, 1, 2].map(|i| {
        let rotation = motion.matrix3.row(i);
        [rotation.x as f32, rotation.y as f32, rotation.z as f32, motion.translation[i] as f32]
    })
}

/// Boxes and triangles of the tree, rounded to f32. Boxes grow by the rounding error.
pub(crate) fn shadow_tree(tree: &Tree, occluders: &Occluders) -> (Vec<ShadowBox>, Vec<ShadowTriangle>) {
    let low = |value: f64| (value as f32).next_down();
    let high = |value: f64| (value as f32).next_up();
    let boxes = tree.nodes.iter().map(|node| ShadowBox {
        low: node.low.to_array().map(low),
        skip: node.skip,
        high: node.high.to_array().map(high),
        triangles: node.first << 3 | node.count,
    });
    let padded = |v: glam::DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
    let triangles = tree.order.iter().map(|number| {
        let [corner, first, second] = occluders.triangles[*number as usize].map(padded);
        ShadowTriangle { corner, first, second }
    });
    (boxes.collect(), triangles.collect())
}
