//! Interface of a network integrator: a device in f32 or its f64 twin. The caller chooses sub-steps and methods.

use std::fmt;

/// Method of a sub-step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepMethod {
    /// Forward Euler with a carried residual: one stage, order 1.
    Euler,
    /// Runge-Kutta-Legendre of order 2 in delta form (Meyer, Balsara & Aslam, J. Comput. Phys. 257, 2014), with an odd number of stages of at least 3.
    Rkl2 {
        /// Number of stages.
        stages: u32,
    },
    /// TR-BDF2 (Hosea & Shampine, Appl. Numer. Math. 20, 1996), solved by conjugate gradients.
    TrBdf2,
}

impl fmt::Display for StepMethod {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Euler => write!(out, "Euler with residual"),
            Self::Rkl2 { stages } => write!(out, "RKL2 with {stages} stages"),
            Self::TrBdf2 => write!(out, "TR-BDF2"),
        }
    }
}

/// Results of a try. The state after it is tentative.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Attempt {
    /// Largest estimate of the error of one sub-step at a node [K]. Infinite where a balance did not converge, or where a temperature left the range of the
    /// network.
    pub error: f64,
    /// Temperatures of the sensors [K] at the end of every sub-step. All sensors of the first sub-step come first.
    pub sensed: Vec<f64>,
}

/// Counts of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WorkCounts {
    /// Dispatches. 0 in f64.
    pub(crate) dispatches: u64,
    /// Stages. Each evaluates all exchanges.
    pub stages: u64,
    /// Sub-steps, including rejected ones.
    pub sub_steps: u64,
    /// Iterations of Newton's method and of conjugate gradients.
    pub iterations: u64,
}

/// A network whose state can be tried, kept or rejected.
///
/// The heat of every node is linear between two calls of [`Stepper::set_heat`]. Sub-steps end where it is not.
pub trait Stepper {
    /// Error of a call.
    type Error;

    /// Sets the heat of the nodes to `power + slope * t` [W], with t [s] since this call.
    ///
    /// # Errors
    /// A call that fails.
    fn set_heat(&mut self, power: &[f64], slope: &[f64]) -> Result<(), Self::Error>;

    /// Balances the arithmetic nodes in place with the heat at `t` [s] since `set_heat`. Returns whether they converged.
    ///
    /// # Errors
    /// A call that fails.
    fn balance(&mut self, t: f64) -> Result<bool, Self::Error>;

    /// Tries `count` sub-steps of `step` [s] each from the kept state, with its arithmetic nodes balanced. The kept state is at `t` [s] since `set_heat`.
    ///
    /// # Errors
    /// A call that fails.
    fn attempt(&mut self, method: StepMethod, t: f64, step: f64, count: u32) -> Result<Attempt, Self::Error>;

    /// Keeps the state of the last try.
    ///
    /// # Errors
    /// A call that fails.
    fn keep(&mut self) -> Result<(), Self::Error>;

    /// The kept temperatures [K].
    ///
    /// # Errors
    /// A call that fails.
    fn temperatures(&mut self) -> Result<Vec<f64>, Self::Error>;

    /// Replaces the kept temperatures [K].
    ///
    /// # Errors
    /// A call that fails.
    fn set_temperatures(&mut self, temperatures: &[f64]) -> Result<(), Self::Error>;

    /// Solves in place for the steady state under the heat at `t` [s]: every node but boundaries balances. Returns whether it converged.
    ///
    /// # Errors
    /// A call that fails.
    fn steady(&mut self, t: f64) -> Result<bool, Self::Error>;

    /// Highest temperature of the stepper [K].
    fn hottest(&self) -> f64 {
        f64::INFINITY
    }

    /// Work so far.
    fn counts(&self) -> WorkCounts;
}
