//! Methods of a sub-step, results of a try, and counts of work.

use std::fmt;

/// Method of a sub-step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepMethod {
    /// Forward Euler: one stage, order 1.
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
            Self::Euler => write!(out, "Euler"),
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub struct WorkCounts {
    /// Stages. Each evaluates all exchanges.
    pub stages: u64,
    /// Sub-steps, including rejected ones.
    pub sub_steps: u64,
    /// Iterations of Newton's method and of conjugate gradients.
    pub iterations: u64,
}
