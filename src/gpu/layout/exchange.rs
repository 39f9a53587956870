//! Structures of radiation between surfaces.

use super::shared::shared;

shared! {
    /// A patch of a surface that radiates to others.
    pub(crate) struct ExchangePatch {
        /// Unit normal away from the face, in the frame of its joint.
        pub(crate) normal: [f32; 3],
        /// Emissivity.
        pub(crate) emissivity: f32,
        /// Absorptivity of sunlight.
        pub(crate) absorptivity: f32,
        /// 1 over the area [1/m2].
        pub(crate) per_area: f32,
        /// First of its nodes.
        pub(crate) first_node: u32,
        /// The node after the last.
        pub(crate) end_node: u32,
        /// Joint; 0 is the body.
        pub(crate) joint: u32,
        /// Share of reflected sunlight that leaves in the mirror direction, where patches mirror sunlight.
        pub(crate) specular: f32,
        /// 1 where the patch is the face against the normals.
        pub(crate) back: u32,
        /// How fast its material cools [1/(s K3)].
        pub(crate) cooling: f32,
        /// Way of its farthest node from its centre [m]. 0 where fluxes do not differ within patches.
        pub(crate) radius: f32,
        /// Padding to the alignment of GLSL.
        pub(crate) unused: [f32; 3],
    }

    /// Rows of a patch as they were found for poses of the joints.
    pub(crate) struct ExchangeRow {
        /// First four entries of its row of infrared.
        pub(crate) first_entry: u32,
        /// The four after the last.
        pub(crate) end_entry: u32,
        /// First four entries of its row of sunlight.
        pub(crate) first_reflected: u32,
        /// The four after the last.
        pub(crate) end_reflected: u32,
        /// Exchange area of infrared with itself [m2].
        pub(crate) itself: f32,
        /// The same of sunlight [m2].
        pub(crate) itself_reflected: f32,
        /// Share of the patch outside other parts, which sunlight can reach.
        pub(crate) exposed: f32,
    }

    /// Push constants of a pass over patches.
    pub(crate) struct ExchangePass {
        /// First patch.
        pub first: u32,
        /// Patch after the last.
        pub end: u32,
        /// Bundles of rays of each patch.
        pub rays: u32,
        /// Time for which the last infrared was held [s]. 0 where none came before.
        pub held: f32,
        /// Part of the change since light was found before by which its light goes on.
        pub lead: f32,
        /// Number of patches: rows and skies of slot 1 stand so many behind slot 0.
        pub patches: u32,
        /// Share of the second finding.
        pub share: f32,
        /// Slot of the first finding.
        pub slot: u32,
    }
}
