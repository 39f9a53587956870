//! What a case's temperatures are: the same network in f64 with far shorter sub-steps, and how far that is from exact.

use serde::Serialize;

use super::cases::Case;
use super::integrators::{Differences, in_frames};
use super::schemes::{Fixed, Scheme};
use crate::simulation::stepper::AnyStepper;
use crate::thermal::network::NodeKind;

/// Temperatures [K] of all nodes at the end of every frame.
pub type Rows = Vec<Vec<f64>>;

/// A case of the integrators.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseSummary {
    /// Short name.
    pub key: String,
    /// What it is.
    pub title: String,
    /// Nodes.
    pub nodes: usize,
    /// Nodes among them that store no heat.
    pub arithmetic: usize,
    /// Linear and radiative conductors.
    pub conductors: usize,
    /// Frames.
    pub frames: usize,
    /// Length of a frame [s].
    pub frame_s: f64,
    /// Frame over the longest stable step of forward Euler.
    pub stiffness: f64,
    /// The same of the case in NUMERICS.md 3.
    pub published_stiffness: f64,
    /// Sub-steps a frame of RKL2 in f64 that the temperatures are held against.
    pub reference_sub_steps: u32,
    /// The error of that reference itself, estimated from half as many sub-steps.
    pub reference_error: Differences,
}

impl CaseSummary {
    /// Of a case and its reference.
    pub fn of((case, truth): &(Case, Truth)) -> Self {
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
            reference_error: truth.own,
        }
    }
}

/// The reference of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Temperatures at the ends of frames.
    pub rows: Rows,
    /// Sub-steps a frame of RKL2 in f64.
    pub sub_steps: u32,
    /// Its own error: a third of its difference from half as many sub-steps, as for a method of order 2.
    pub own: Differences,
}

impl Truth {
    /// Integrates in f64 with so many sub-steps a frame, and with half as many. `None` where that fails.
    pub fn of(case: &Case, sub_steps: u32) -> Option<Self> {
        let rows = |count: u32| -> Option<Rows> {
            let mut stepper = AnyStepper::reference(&case.network, &[]);
            let mut rows = Rows::new();
            let scheme = Scheme::Fixed(Fixed::Rkl2, count);
            in_frames(&mut stepper, case, scheme, |_, temperatures| {
                rows.push(temperatures);
                true
            })
            .ok()?;
            Some(rows)
        };
        let [fine, coarse] = [rows(sub_steps)?, rows(sub_steps / 2)?];
        let apart = Differences::between(&coarse, &fine);
        Some(Self { rows: fine, sub_steps, own: Differences { rms: apart.rms / 3.0, max: apart.max / 3.0 } })
    }
}
