//! State of a craft at one time.

use glam::DVec3;

/// Difference between two times that counts as rounding [s], such as between 541.8 s and 5418 steps of 0.1 s.
pub(crate) const SLACK: f64 = 1e-6;

/// Position and velocity of a craft, GCRF, from the planet's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateVector {
    /// Position [m].
    pub position: DVec3,
    /// Velocity [m/s].
    pub(crate) velocity: DVec3,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct EphemerisSample {
    /// Time since the start of the scene [s].
    pub time: f64,
    /// Position [m], GCRF.
    pub(crate) position: DVec3,
    /// Velocity [m/s], GCRF, where it is stated.
    pub(crate) velocity: Option<DVec3>,
}
