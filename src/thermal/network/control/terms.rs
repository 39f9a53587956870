//! Settings, results and errors of an integration.

use std::fmt;

use crate::thermal::network::schedule::Schedule;
use crate::thermal::network::stepper::WorkCounts;

/// Choice of methods and of the default tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// Euler where it is allowed and good enough, RKL2 otherwise, TR-BDF2 where RKL2 would need too many stages. The network of a scene takes one pass a step
    /// where it fits.
    #[default]
    Default,
    /// The default at ten times its tolerance, with Euler wherever it is stable and accurate enough.
    Cheap,
    /// TR-BDF2 at a tenth of the default's tolerance. RKL2 at that tolerance where it needs few stages.
    Accurate,
    /// One pass a step ([`super::super::one_pass`]), for the network of a scene. Sub-steps of the default where it does not fit.
    OnePass,
}

/// Default tolerance of the network of a scene in one pass [K].
pub(crate) const ONE_PASS_TOLERANCE: f64 = 5e-2;

impl Integrator {
    /// Default tolerance of sub-steps [K].
    pub(crate) fn tolerance(self) -> f64 {
        match self {
            Self::Default | Self::OnePass => 5e-3,
            Self::Cheap => 5e-2,
            Self::Accurate => 5e-4,
        }
    }

    /// Whether the network of a scene takes one pass a step where it fits.
    pub fn takes_one_pass(self) -> bool {
        matches!(self, Self::Default | Self::OnePass)
    }
}

/// Settings of an integration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntegrationSettings {
    /// Choice of methods.
    pub integrator: Integrator,
    /// Tolerance: the error to which sub-steps may add up [K].
    pub tolerance: f64,
}

impl IntegrationSettings {
    /// Settings with the default tolerance of an integrator.
    pub fn of(integrator: Integrator) -> Self {
        Self { integrator, tolerance: integrator.tolerance() }
    }
}

/// A switch of a thermostat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Switch {
    /// Time [s].
    pub time: f64,
    /// Number of the thermostat.
    pub thermostat: usize,
    /// New state.
    pub on: bool,
}

/// Use of a method: time and sub-steps.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct MethodUse {
    /// Number of kept sub-steps.
    pub(crate) sub_steps: u64,
    /// Time covered [s].
    pub(crate) time: f64,
    /// Shortest and longest sub-step [s].
    pub(crate) range: [f64; 2],
    /// Fewest and most stages of a sub-step.
    pub(crate) stages: [u32; 2],
}

impl MethodUse {
    /// The uses of methods in two integrations together.
    pub(crate) fn sums(one: [Option<Self>; 3], other: [Option<Self>; 3]) -> [Option<Self>; 3] {
        std::array::from_fn(|method| match (one[method], other[method]) {
            (Some(a), Some(b)) => Some(Self {
                sub_steps: a.sub_steps + b.sub_steps,
                time: a.time + b.time,
                range: [a.range[0].min(b.range[0]), a.range[1].max(b.range[1])],
                stages: [a.stages[0].min(b.stages[0]), a.stages[1].max(b.stages[1])],
            }),
            (a, b) => a.or(b),
        })
    }
}

/// Results of an integration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Temperatures [K] of all nodes at every output time.
    pub rows: Vec<Vec<f64>>,
    /// Switches in the order of time.
    pub switches: Vec<Switch>,
    /// Use of Euler, RKL2 and TR-BDF2.
    pub(crate) uses: [Option<MethodUse>; 3],
    /// Slowest and fastest bound of the relaxation rate [1/s].
    pub(crate) rates: Option<[f64; 2]>,
    pub(crate) rejected: u64,
    /// Total work.
    pub counts: WorkCounts,
    pub(crate) on: Vec<bool>,
    /// Sub-step proposed by the last estimate [s].
    pub(crate) step: f64,
    /// Sub-step proposed by the first estimate [s]. Where the heat jumps equally at the start of each leg, the next leg may begin with it.
    pub(crate) first_step: Option<f64>,
}

/// State of one leg among many consecutive ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Leg {
    /// Time over which errors accumulate [s].
    pub(crate) horizon: f64,
    /// First sub-step to try [s].
    pub(crate) step: f64,
    /// Whether thermostats shorten the sub-steps, so that switching times hold over a long run.
    pub(crate) tight_switches: bool,
}

impl Leg {
    /// The only leg of a schedule.
    pub(crate) fn whole(schedule: &Schedule) -> Self {
        let horizon = schedule.times.last().copied().unwrap_or(1.0);
        Self { horizon, step: f64::INFINITY, tight_switches: true }
    }
}

/// An error of an integration.
#[derive(Debug, Clone, PartialEq)]
pub enum ControlError {
    /// Arithmetic nodes that do not balance.
    Unbalanced {
        /// Time [s].
        time: f64,
        /// The node with the largest residual.
        node: usize,
    },
    /// A sub-step below the shortest.
    NoStep {
        /// Time [s].
        time: f64,
        /// The coldest node, which most likely loses too much heat.
        node: usize,
        /// Temperature [K].
        temperature: f64,
    },
    /// A conductor that equalises its nodes faster than the shortest sub-step.
    Stiff {
        /// Time [s].
        time: f64,
        /// Its nodes.
        nodes: [usize; 2],
        /// Conductance GL [W/K].
        conductance: f64,
        /// GL over the capacitance of its lighter diffusive node [1/s].
        rate: f64,
    },
    /// A thermostat whose band can not hold: it switches too fast.
    Chatter {
        /// Time [s].
        time: f64,
        /// Number of the thermostat.
        thermostat: usize,
        /// Number of its last switches.
        switches: u32,
        /// Time that they took [s].
        within: f64,
    },
    /// As many sub-steps as an integration may take.
    TooLong {
        /// Time that was reached [s].
        time: f64,
        /// Sub-step at that time [s].
        step: f64,
    },
    /// A stop requested by the caller.
    Stopped,
}

impl fmt::Display for Integrator {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Default => "default",
            Self::Cheap => "cheap",
            Self::Accurate => "accurate",
            Self::OnePass => "one_pass",
        })
    }
}
