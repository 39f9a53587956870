//! The reference temperatures of a case: f64 with much shorter sub-steps, and an estimate of their error.

use serde::Serialize;

use super::cases::NetworkCase;
use super::integrators::{FrameError, in_frames};
use super::schemes::{Fixed, Scheme};
use crate::thermal::network::NodeKind;
use crate::thermal::network::reference::ReferenceStepper;

/// Temperatures [K] of all nodes at the end of every frame.
pub(crate) type FrameTemperatures = Vec<Vec<f64>>;

/// A summary of an integrator case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseSummary {
    /// Short name.
    pub(crate) key: String,
    /// Description.
    pub(crate) title: String,
    pub(crate) nodes: usize,
    /// Number of nodes without heat capacity.
    pub(crate) arithmetic: usize,
    /// Number of linear and radiative conductors.
    pub(crate) conductors: usize,
    pub(crate) frames: usize,
    /// Length of a frame [s].
    pub(crate) frame_s: f64,
    /// Frame length over the longest stable step of forward Euler.
    pub(crate) stiffness: f64,
    /// Stiffness of the case in docs/numerics.md 3.
    pub(crate) published_stiffness: f64,
    /// RKL2 sub-steps a frame of the f64 reference.
    pub(crate) reference_sub_steps: u32,
    /// Error of the reference, estimated with half as many sub-steps.
    pub(crate) reference_error: FrameError,
}

impl CaseSummary {
    /// The summary of a case and its reference.
    pub fn of((case, truth): &(NetworkCase, Truth)) -> Self {
        Self {
            key: case.key.to_owned(),
            title: case.title.clone(),
            nodes: case.network.len(),
            arithmetic: case.network.kinds.iter().filter(|kind| **kind == NodeKind::Arithmetic).count(),
            conductors: case.network.linear.len() + case.network.radiative.len(),
            frames: case.frames.len(),
            frame_s: case.frame,
            stiffness: case.stiffness(),
            published_stiffness: case.published_stiffness,
            reference_sub_steps: truth.sub_steps,
            reference_error: truth.error,
        }
    }
}

/// The reference of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Temperatures at the ends of frames.
    pub rows: FrameTemperatures,
    /// RKL2 sub-steps a frame in f64.
    pub(crate) sub_steps: u32,
    /// Error of the reference itself: a third of the difference from half as many sub-steps, because the method has order 2.
    pub error: FrameError,
}

impl Truth {
    /// Integrates in f64 with a number of sub-steps a frame and with half as many. `None` on failure.
    pub fn of(case: &NetworkCase, sub_steps: u32) -> Option<Self> {
        let rows = |count: u32| -> Option<FrameTemperatures> {
            let mut stepper = ReferenceStepper::new(case.network.clone(), &[]);
            let mut rows = FrameTemperatures::new();
            let scheme = Scheme::Fixed(Fixed::Rkl2, count);
            in_frames(&mut stepper, case, scheme, |_, temperatures| {
                rows.push(temperatures);
                true
            })
            .ok()?;
            Some(rows)
        };
        let [fine, coarse] = [rows(sub_steps)?, rows(sub_steps / 2)?];
        let apart = FrameError::between(&coarse, &fine);
        Some(Self { rows: fine, sub_steps, error: FrameError { rms: apart.rms / 3.0, max: apart.max / 3.0 } })
    }
}
