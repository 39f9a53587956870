//! Structures of thermal networks.

use super::shared::shared;

shared! {
    /// Heat exchange of a node with one neighbour.
    pub struct NetworkLink {
        /// Number of the neighbour.
        pub neighbour: u32,
        /// Linear conductor GL [W/K].
        pub conductance: f32,
        /// Stefan-Boltzmann constant x radiative conductor GR [W/K4].
        pub exchange: f32,
    }

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

    /// Push constants of a pass over a network.
    pub struct NetworkPass {
        /// Number of active invocations. A solver decision reads this number of partial sums instead.
        pub count: u32,
        /// Index of the sensor temperatures of this sub-step.
        pub sensed_at: u32,
        /// Update: 1 in the first iteration. Solver decision: which one.
        pub mode: u32,
        /// Time of the stage since the heat was set [s].
        pub time: f32,
        /// Radiative temperature of space [K].
        pub space_temperature: f32,
        /// Weight of the previous stage. Error estimate: of the change. Right-hand side: of the present heat.
        pub mu: f32,
        /// Weight of the stage before the previous one. Right-hand side: of the heat at the start.
        pub nu: f32,
        /// Weight of the previous stage's rate [s]. Right-hand side: of the heat stored by the change.
        pub mu_step: f32,
        /// Weight of the start rate [s]. Right-hand side: of the heat stored by the first stage's change.
        pub gamma_step: f32,
        /// 1 / (alpha h), with the step length h [1/s].
        pub inverse_step: f32,
        /// Tolerance. Conjugate gradients: squared residual relative to the first one. Newton's method: relative
        /// temperature change, four times as large after `mu` iterations.
        pub accuracy: f32,
    }

    /// State of the solver of a network.
    pub struct NetworkSolver {
        /// Product of residual and preconditioned residual [W K].
        pub gamma: f32,
        /// Step length along the search direction.
        pub alpha: f32,
        /// Step length that the solution uses; 0 after convergence.
        pub step: f32,
        /// Share of the last direction in the next one.
        pub beta: f32,
        /// `gamma` in the first iteration.
        pub gamma_start: f32,
        /// `gamma` at the start of the first system of a stage.
        pub gamma_first: f32,
        /// Iterations of conjugate gradients in this system.
        pub gradients: f32,
        /// 1 if conjugate gradients have converged.
        pub gradients_done: f32,
        /// Iterations of Newton's method in this stage.
        pub newtons: f32,
        /// 1 if Newton's method has converged.
        pub newtons_done: f32,
        /// Most iterations of conjugate gradients in one system.
        pub most_gradients: f32,
        /// Most iterations of Newton's method in one stage.
        pub most_newtons: f32,
        /// Total iterations of conjugate gradients.
        pub iterations: f32,
        /// 1 if a system needed more iterations than were recorded.
        pub short_gradients: f32,
        /// 1 if a stage needed more iterations than were recorded.
        pub short_newtons: f32,
        /// 1 if a value is not finite.
        pub lost: f32,
        /// Largest relative temperature change in the last iteration.
        pub largest_move: f32,
    }
}
