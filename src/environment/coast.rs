//! Motion of a craft under gravity alone (a *coast*) between two samples of an ephemeris.

use glam::DVec3;

use super::orbit::EARTH_GRAVITATIONAL_PARAMETER;
use super::state::{EphemerisSample, SLACK};

/// Earth's second zonal coefficient, and its equatorial radius [m] (EGM96).
const J2: f64 = 1.082_626_7e-3;
const EQUATOR: f64 = 6.378_136_3e6;

/// Acceleration by the Earth's gravity with its oblateness [m/s2] (Vallado, eq. 8-30). The equator of GCRF serves as the Earth's.
pub(crate) fn gravity(position: DVec3) -> DVec3 {
    let mu = EARTH_GRAVITATIONAL_PARAMETER;
    let r2 = position.length_squared();
    let central = -mu / (r2 * r2.sqrt());
    let oblate = 1.5 * J2 * EQUATOR * EQUATOR / r2;
    let sin2 = position.z * position.z / r2;
    let (across, along) = (1.0 + oblate * (1.0 - 5.0 * sin2), 1.0 + oblate * (3.0 - 5.0 * sin2));
    central * position * DVec3::new(across, across, along)
}

/// A change of velocity between two samples [m/s].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Residual {
    /// The part that gravity does not explain.
    pub(crate) unexplained: f64,
    /// The part that gravity explains at the lower of the two samples.
    pub(crate) falling: f64,
}

/// Compares the velocity of a sample with a coast from the sample before. `None` without velocities, and for spans beyond [`LONGEST_COAST`].
pub(crate) fn residual(from: &EphemerisSample, to: &EphemerisSample) -> Option<Residual> {
    let (mut velocity, end) = (from.velocity?, to.velocity?);
    let span = to.time - from.time;
    let mut position = from.position;
    let turn = span * velocity.length() / position.length();
    if span <= SLACK || turn > LONGEST_COAST {
        return None;
    }
    let steps = (turn / 0.02).ceil().max(1.0);
    let h = span / steps;
    for _ in 0..steps as usize {
        // Runge-Kutta of order 4.
        let (k1, l1) = (velocity, gravity(position));
        let (k2, l2) = (velocity + l1 * (0.5 * h), gravity(position + k1 * (0.5 * h)));
        let (k3, l3) = (velocity + l2 * (0.5 * h), gravity(position + k2 * (0.5 * h)));
        let (k4, l4) = (velocity + l3 * h, gravity(position + k3 * h));
        position += (k1 + 2.0 * k2 + 2.0 * k3 + k4) * (h / 6.0);
        velocity += (l1 + 2.0 * l2 + 2.0 * l3 + l4) * (h / 6.0);
    }
    let falling = span * gravity(from.position).length().max(gravity(to.position).length());
    Some(Residual { unexplained: velocity.distance(end), falling })
}

/// Largest angle of the orbit that a coast may cover [rad]. Longer spacings are not compared.
pub(crate) const LONGEST_COAST: f64 = 1.0;

/// Angle by which the craft goes round the planet between two positions [rad]: the mean motion of the circular orbit through the farther one.
pub(crate) fn turn(from: &EphemerisSample, to: &EphemerisSample) -> f64 {
    let radius = from.position.length().max(to.position.length());
    (to.time - from.time) * (EARTH_GRAVITATIONAL_PARAMETER / radius.powi(3)).sqrt()
}
