//! Structures of thermal networks.

use super::shared::shared;

shared! {
    /// A step of the heaters of a network in one pass.
    pub(crate) struct HeaterStep {
        /// Number of heaters.
        pub(crate) heaters: u32,
        /// 1 in the first step of a frame.
        pub(crate) first: u32,
        /// 1 in a step that is taken to learn its change, so that the last change is not known.
        pub(crate) trial: u32,
        /// Start, counted from the start of the frame [s].
        pub(crate) start: f32,
        /// Length [s].
        pub(crate) step: f32,
    }

    /// A step of a network in one pass, over a range of its groups.
    pub(crate) struct NetworkStep {
        /// First group.
        pub(crate) first: u32,
        /// Group after the last.
        pub(crate) end: u32,
        /// Runge-Kutta steps in a local step of a fast node.
        pub(crate) count: u32,
        /// Steps since the last estimate of the error.
        pub(crate) since: u32,
        /// Length [s].
        pub(crate) step: f32,
        /// Fourth power of the radiative temperature of space [K4].
        pub(crate) space_temperature_4: f32,
    }

    /// A stage of the conduction inside large blocks.
    pub struct NetworkStage {
        /// Group after the last of large blocks.
        pub(crate) end: u32,
        /// Factor of X of the vector before, times the step [s].
        pub(crate) rate: f32,
        /// Factor of the vector before.
        pub(crate) here: f32,
        /// Factor of the second vector before.
        pub(crate) older: f32,
        /// Share of the vector in the change.
        pub(crate) part: f32,
    }
}
