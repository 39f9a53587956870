//! Why a network has no temperatures, in words.

use crate::simulation::engine_error::EngineError;
use crate::thermal::network::control::{ControlError, MOST_SUB_STEPS};
use crate::thermal::network::steady::SteadyError;

/// A network that fails at a time [s].
pub(super) fn failure(time: f64, reason: &str) -> EngineError {
    EngineError::Network { time, reason: reason.to_owned() }
}

/// Why no steady state was found, in words.
pub(super) fn unsteady(error: &SteadyError) -> String {
    match error {
        SteadyError::Closed { node } => format!("the heat of node {node} has no path to a boundary or to space"),
        SteadyError::NotFound { node } => format!(
            "no steady state was found (node {node} is furthest from it): state initial.temperature to start elsewhere"
        ),
        SteadyError::Cycles { thermostat } => format!(
            "no steady state: thermostat {thermostat} has none, on or off; state initial.temperature to start elsewhere"
        ),
    }
}

/// The cause of an integration error, in words.
pub(crate) fn unfinished(error: &ControlError) -> String {
    match error {
        ControlError::Unbalanced { node, .. } => format!("the arithmetic nodes do not balance, worst at node {node}"),
        ControlError::NoStep { node, temperature, .. } => {
            format!("no sub-step is short enough; node {node} is at {temperature} K")
        }
        ControlError::Stiff { nodes: [a, b], conductance, .. } => {
            format!("no sub-step is short enough; nodes {a} and {b} have a GL of {conductance:e} W/K")
        }
        ControlError::Chatter { thermostat, switches, within, .. } => {
            format!("thermostat {thermostat} switches {switches} times within {within:.1e} s")
        }
        ControlError::TooLong { step, .. } => {
            format!("it took {MOST_SUB_STEPS:e} sub-steps, the most of a run; the last was {step:.1e} s long")
        }
        ControlError::Stopped => "it was stopped".to_owned(),
    }
}
