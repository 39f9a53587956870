//! Structures of shadows: the view from the Sun, and rays against the triangles of the craft.

use super::shared::shared;
use crate::environment::shadow::Occluders;

shared! {
    /// Orthographic view of the craft from the Sun.
    pub(crate) struct SunView {
        /// Row of the transform from a point to its column in the shadow map [texels].
        pub(crate) texel_from_body_x: [f32; 4],
        /// Row of the transform from a point to its row in the shadow map [texels].
        pub(crate) texel_from_body_y: [f32; 4],
        /// Row of the transform from a point to its depth, 0 to 1.
        pub(crate) texel_from_body_z: [f32; 4],
        /// Unit vector to the Sun, body frame; w: offset of a node from its surface [m].
        pub(crate) sun: [f32; 4],
        /// Unit vector along texel rows; w: side of a texel in units of depth.
        pub(crate) right: [f32; 4],
        /// Unit vector along texel columns; w: texels along a side of the map.
        pub(crate) down: [f32; 4],
    }

    /// A node of the bounding box tree for shadow rays.
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

    /// A triangle that casts a shadow.
    pub(crate) struct ShadowTriangle {
        /// A corner [m].
        pub(crate) corner: [f32; 4],
        /// Edge from that corner to the second one [m].
        pub(crate) first: [f32; 4],
        /// Edge from that corner to the third one [m].
        pub(crate) second: [f32; 4],
    }

    /// Push constants of one shadow ray dispatch, for one point of the Sun's disc.
    pub struct SunRay {
        /// Unit vector to the Sun's centre; w: offset of the ray's start from its surface [m].
        pub(crate) sun: [f32; 4],
        /// Unit vector to the point; w: share of the disc that the point stands for.
        pub(crate) direction: [f32; 4],
        /// Number of boxes in the tree.
        pub(crate) boxes: u32,
        /// Padding to the alignment of GLSL.
        pub(crate) unused: [u32; 3],
    }
}

impl SunView {
    /// Rounds a view to f32.
    pub(crate) fn new(view: &crate::environment::shadow::SunProjection) -> Self {
        let with = |v: glam::DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
        let [x, y, z] = view.rows().map(|row| row.map(|value| value as f32));
        Self {
            texel_from_body_x: x,
            texel_from_body_y: y,
            texel_from_body_z: z,
            sun: with(view.sun, view.lift),
            right: with(view.right, view.texel_depth()),
            down: with(view.down, f64::from(view.resolution)),
        }
    }
}

/// Rows of a rigid motion, rounded to f32. Shadow rays get the rows of body_from_joint after `SunRay`.
pub(crate) fn rows(motion: &glam::DAffine3) -> [[f32; 4]; 3] {
    [0, 1, 2].map(|i| {
        let rotation = motion.matrix3.row(i);
        [rotation.x as f32, rotation.y as f32, rotation.z as f32, motion.translation[i] as f32]
    })
}

/// Boxes and triangles of the tree, rounded to f32. Boxes grow by the rounding error.
pub(crate) fn shadow_tree(occluders: &Occluders) -> (Vec<ShadowBox>, Vec<ShadowTriangle>) {
    let low = |value: f64| (value as f32).next_down();
    let high = |value: f64| (value as f32).next_up();
    let boxes = occluders.tree.nodes.iter().map(|node| ShadowBox {
        low: node.low.to_array().map(low),
        skip: node.skip,
        high: node.high.to_array().map(high),
        triangles: node.first << 3 | node.count,
    });
    let padded = |v: glam::DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
    let triangles = occluders.triangles.iter().map(|[corner, first, second]| ShadowTriangle {
        corner: padded(*corner),
        first: padded(*first),
        second: padded(*second),
    });
    (boxes.collect(), triangles.collect())
}
