//! What an integration is told, what it leaves, and why it ends early.

use std::fmt;

use crate::thermal::network::stepper::WorkCounts;

/// Which methods may be chosen, and how tight the default tolerance is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// Euler where it is allowed and good enough, RKL2 otherwise, TR-BDF2 where RKL2 would need too many stages.
    #[default]
    Default,
    /// As the default at ten times its tolerance, with Euler wherever it is stable and good enough.
    Cheap,
    /// TR-BDF2 at a tenth of the default's tolerance; RKL2 at that tolerance where few stages do.
    Accurate,
}

impl Integrator {
    /// Tolerance where none is given [K].
    pub fn tolerance(self) -> f64 {
        match self {
            Self::Default => 5e-3,
            Self::Cheap => 5e-2,
            Self::Accurate => 5e-4,
        }
    }
}

/// How to integrate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Which methods.
    pub integrator: Integrator,
    /// Aim for the error that sub-steps add up to [K].
    pub tolerance: f64,
    /// Estimates below this are rounding [K]: no sub-step is asked to err by less.
    pub floor: f64,
}

/// The floor in f64 [K]: ten times what Newton's method leaves.
pub const FLOOR: f64 = 1e-9;

impl Settings {
    /// The integrator at its own tolerance, in f64.
    pub fn of(integrator: Integrator) -> Self {
        Self { integrator, tolerance: integrator.tolerance(), floor: FLOOR }
    }
}

/// A thermostat that switched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Switch {
    /// [s].
    pub time: f64,
    /// Number of the thermostat.
    pub thermostat: usize,
    /// Its state from then on.
    pub on: bool,
}

/// How much of the time a method took, and in what sub-steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Use {
    /// Kept sub-steps.
    pub sub_steps: u64,
    /// Time they cover [s].
    pub time: f64,
    /// Shortest and longest [s].
    pub range: [f64; 2],
    /// Fewest and most stages of a sub-step.
    pub stages: [u32; 2],
}

/// What an integration leaves.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Temperatures [K] of all nodes at every output time.
    pub rows: Vec<Vec<f64>>,
    /// Switching events in the order of time.
    pub switches: Vec<Switch>,
    /// Use of Euler, RKL2 and TR-BDF2.
    pub uses: [Option<Use>; 3],
    /// Slowest and fastest bound of the relaxation rate [1/s] that was met.
    pub rates: Option<[f64; 2]>,
    /// Tries that were taken back.
    pub rejected: u64,
    /// All work.
    pub counts: WorkCounts,
    /// States of the thermostats at the end.
    pub on: Vec<bool>,
    /// Sub-step that the last estimate proposes [s].
    pub step: f64,
    /// The same of the first estimate by which sub-steps were chosen: where legs in a row begin with jumps of their heat
    /// of like size, the next may begin with it.
    pub first_step: Option<f64>,
}

/// Where an integration stands that is one of many in a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// Time over which errors add up [s].
    pub horizon: f64,
    /// First sub-step to try [s].
    pub step: f64,
    /// Whether thermostats tighten the sub-steps, so that their switching times hold over a long run.
    pub tight_switches: bool,
}

/// Why an integration ends early.
#[derive(Debug, Clone, PartialEq)]
pub enum ControlError<E> {
    /// The stepper failed.
    Stepper(E),
    /// Arithmetic nodes have no balance.
    Unbalanced {
        /// [s].
        time: f64,
        /// The node whose balance is furthest from closing.
        node: usize,
    },
    /// No sub-step is short enough.
    NoStep {
        /// [s].
        time: f64,
        /// The coldest node, which most likely runs out of heat.
        node: usize,
        /// Its temperature [K].
        temperature: f64,
    },
    /// A conductor evens out its nodes faster than the shortest sub-step.
    Stiff {
        /// [s].
        time: f64,
        /// Its nodes.
        nodes: [usize; 2],
        /// Its GL [W/K].
        conductance: f64,
        /// GL over capacitance of the lighter node that stores heat [1/s].
        rate: f64,
    },
    /// A node is hotter than the stepper holds.
    TooHot {
        /// [s].
        time: f64,
        /// The node.
        node: usize,
        /// Its temperature [K].
        temperature: f64,
    },
    /// A thermostat switches without end.
    Chatter {
        /// [s].
        time: f64,
        /// Number of the thermostat.
        thermostat: usize,
    },
    /// The caller asked to stop.
    Stopped,
}

impl<E> From<E> for ControlError<E> {
    fn from(error: E) -> Self {
        Self::Stepper(error)
    }
}

impl fmt::Display for Integrator {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Default => "default",
            Self::Cheap => "cheap",
            Self::Accurate => "accurate",
        })
    }
}
