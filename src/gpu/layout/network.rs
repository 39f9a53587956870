//! Structures of thermal networks.

use super::shared::shared;

shared! {
    /// A step of the heaters of a network in one pass.
    pub struct HeaterStep {
        /// Number of heaters.
        pub heaters: u32,
        /// 1 in the first step of a frame.
        pub first: u32,
        /// 1 in a step that is taken to learn its change, so that the last change is not known.
        pub trial: u32,
        /// Start since that of the frame [s].
        pub start: f32,
        /// Length [s].
        pub step: f32,
    }

    /// A step of a network in one pass, over a range of its groups.
    pub struct NetworkStep {
        /// First group.
        pub first: u32,
        /// Group after the last.
        pub end: u32,
        /// Runge-Kutta steps in a local step of a fast node.
        pub count: u32,
        /// Steps since the last estimate of the error.
        pub since: u32,
        /// Length [s].
        pub step: f32,
        /// Fourth power of the radiative temperature of space [K4].
        pub space_temperature_4: f32,
    }

    /// A stage of the conduction inside large blocks.
    pub struct NetworkStage {
        /// Group after the last of large blocks.
        pub end: u32,
        /// Factor of X of the vector before, times the step [s].
        pub rate: f32,
        /// Factor of the vector before.
        pub here: f32,
        /// Factor of the second vector before.
        pub older: f32,
        /// Share of the vector in the change.
        pub part: f32,
    }
}
