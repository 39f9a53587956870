//! What integrates a network: a device in f32 or its f64 twin. Who calls it decides when and how far.

use std::fmt;

/// An integrator of one sub-step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Forward Euler with a carried residual: one stage, order 1.
    Euler,
    /// Runge-Kutta-Legendre of order 2 in delta form (Meyer, Balsara & Aslam, J. Comput. Phys. 257, 2014): an odd
    /// number of stages, at least 3.
    Rkl2 {
        /// Stages.
        stages: u32,
    },
    /// TR-BDF2 (Hosea & Shampine, Appl. Numer. Math. 20, 1996), its equations solved by conjugate gradients.
    TrBdf2,
}

impl fmt::Display for Method {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Euler => write!(out, "Euler with residual"),
            Self::Rkl2 { stages } => write!(out, "RKL2 with {stages} stages"),
            Self::TrBdf2 => write!(out, "TR-BDF2"),
        }
    }
}

/// What a try left: the state after it is only tentative.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Attempt {
    /// Largest estimate of the error that one sub-step adds to a node [K]. Infinite where a balance did not converge or
    /// a temperature left the range in which the network is defined.
    pub error: f64,
    /// Temperatures of the sensors [K] at the end of every sub-step: the sensors of the first, then of the second.
    pub sensed: Vec<f64>,
}

/// Counts of work so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WorkCounts {
    /// Dispatches; 0 in f64.
    pub dispatches: u64,
    /// Stages, each an evaluation of all exchanges.
    pub stages: u64,
    /// Sub-steps, rejected ones included.
    pub sub_steps: u64,
    /// Iterations of Newton's method and of conjugate gradients.
    pub iterations: u64,
}

/// A network with a state that can be tried, kept or taken back.
///
/// The heat of every node is linear between two calls of [`Stepper::set_heat`]: steps break where it is not.
pub trait Stepper {
    /// What can fail.
    type Error;

    /// From now on the heat of a node is `power + slope * t` [W], t [s] counted from this call's present time.
    ///
    /// # Errors
    /// A call that fails.
    fn set_heat(&mut self, power: &[f64], slope: &[f64]) -> Result<(), Self::Error>;

    /// Balances the arithmetic nodes with the heat at `t` [s] since `set_heat`, in place. Returns whether they did.
    ///
    /// # Errors
    /// A call that fails.
    fn balance(&mut self, t: f64) -> Result<bool, Self::Error>;

    /// Tries `count` sub-steps of `step` [s] each from the kept state, which is that of `t` [s] since `set_heat`, with its
    /// arithmetic nodes balanced.
    ///
    /// # Errors
    /// A call that fails.
    fn attempt(&mut self, method: Method, t: f64, step: f64, count: u32) -> Result<Attempt, Self::Error>;

    /// Keeps what the last try left.
    ///
    /// # Errors
    /// A call that fails.
    fn keep(&mut self) -> Result<(), Self::Error>;

    /// The kept temperatures [K].
    ///
    /// # Errors
    /// A call that fails.
    fn temperatures(&mut self) -> Result<Vec<f64>, Self::Error>;

    /// Replaces the kept state [K].
    ///
    /// # Errors
    /// A call that fails.
    fn set_temperatures(&mut self, temperatures: &[f64]) -> Result<(), Self::Error>;

    /// Solves for the temperatures at which every node that is not a boundary balances the heat at `t` [s], in place.
    /// Returns whether it converged.
    ///
    /// # Errors
    /// A call that fails.
    fn steady(&mut self, t: f64) -> Result<bool, Self::Error>;

    /// The hottest temperature [K] that it holds.
    fn hottest(&self) -> f64 {
        f64::INFINITY
    }

    /// Work so far.
    fn counts(&self) -> WorkCounts;
}
