//! What a case's temperatures are: the same network in f64 with far shorter sub-steps, and how far that is from exact.

use super::cases::Case;
use super::integrators::{Differences, in_frames};
use super::schemes::{Fixed, Scheme};
use crate::thermal::network::reference::ReferenceStepper;

/// Temperatures [K] of all nodes at the end of every frame.
pub type Rows = Vec<Vec<f64>>;

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
            let mut stepper = ReferenceStepper::new(case.network.clone(), &[]);
            let mut rows = Rows::new();
            let scheme = Scheme::Fixed(Fixed::Rkl2, count);
            in_frames(&mut stepper, case, scheme, 0.0, |_, temperatures| {
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
