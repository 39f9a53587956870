//! Attitude laws: the rotation from the orbit's frames into the body.

use glam::{DMat3, DVec3};

use crate::scene::{Attitude, CircularOrbit};

/// An attitude law with its constant rotation worked out.
#[derive(Debug, Clone, PartialEq)]
pub enum BodyFrame {
    /// The body keeps its turn against the orbit frame (LVLH).
    FollowsOrbit {
        /// Rotates orbit-frame vectors into the body frame.
        body_from_orbit: DMat3,
    },
    /// The body keeps its turn against the inertial frame; so does a Sun-pointing one, for the Sun stands still there.
    Fixed {
        /// Rotates inertial vectors into the body frame.
        body_from_inertial: DMat3,
    },
}

impl BodyFrame {
    /// The rotation of an attitude law over an orbit; `None` where two axes are parallel or an axis or quaternion is
    /// zero or not finite.
    ///
    /// Sun-pointing with the Sun along the orbit normal (beta = 90 deg) leaves the second axis free: it then points to
    /// orbit noon.
    pub fn new(attitude: &Attitude, orbit: &CircularOrbit) -> Option<Self> {
        match attitude {
            Attitude::Nadir { nadir_axis, forward_axis } => {
                let body_from_orbit = triad(*nadir_axis, *forward_axis)?;
                Some(Self::FollowsOrbit { body_from_orbit })
            }
            Attitude::Inertial { inertial_from_body } => {
                let usable = inertial_from_body.is_finite() && inertial_from_body.length() > 0.0;
                usable.then(|| Self::Fixed {
                    body_from_inertial: DMat3::from_quat(inertial_from_body.normalize()).transpose(),
                })
            }
            Attitude::Sun { sun_axis, north_axis } => {
                let body_from_axes = triad(*sun_axis, *north_axis)?;
                let sun = orbit.sun_direction();
                let inertial_from_axes = triad(sun, DVec3::Z).or_else(|| triad(sun, DVec3::X))?;
                Some(Self::Fixed { body_from_inertial: body_from_axes * inertial_from_axes.transpose() })
            }
        }
    }

    /// Rotations into the body at this time [s]: from the inertial frame, and from the orbit frame.
    pub fn rotations(&self, orbit: &CircularOrbit, time: f64) -> (DMat3, DMat3) {
        let inertial_from_orbit = orbit.inertial_from_orbit(time);
        match *self {
            Self::FollowsOrbit { body_from_orbit } => {
                (body_from_orbit * inertial_from_orbit.transpose(), body_from_orbit)
            }
            Self::Fixed { body_from_inertial } => (body_from_inertial, body_from_inertial * inertial_from_orbit),
        }
    }
}

/// Sine of the angle below which two axes count as parallel.
const PARALLEL: f64 = 1e-9;

/// Right-handed axes with Z along `primary` and X along the part of `secondary` at right angles to it, as columns;
/// `None` where the two are parallel, zero or not finite.
fn triad(primary: DVec3, secondary: DVec3) -> Option<DMat3> {
    let z = primary.try_normalize()?;
    let across = z.cross(secondary.try_normalize()?);
    (across.length() > PARALLEL).then(|| {
        let y = across.normalize();
        DMat3::from_cols(y.cross(z), y, z)
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use glam::DQuat;

    use super::*;

    const ORBIT: CircularOrbit = CircularOrbit { altitude: 408e3, period: 5560.0, beta: 0.4, phase: 0.2 };

    fn assert_close(found: DVec3, expected: DVec3) {
        assert!(found.distance(expected) < 1e-12, "{found} is not {expected}");
    }

    #[test]
    fn nadir_pointing_holds_its_axes_on_nadir_and_velocity() {
        let attitude = Attitude::Nadir { nadir_axis: -DVec3::Y, forward_axis: DVec3::new(1.0, 0.5, 0.0) };
        let frame = BodyFrame::new(&attitude, &ORBIT).unwrap();
        for time in [0.0, 1234.5, 1e6] {
            let (body_from_inertial, body_from_orbit) = frame.rotations(&ORBIT, time);
            assert_close(body_from_inertial * -ORBIT.zenith(time), -DVec3::Y);
            assert_close(body_from_orbit * DVec3::Z, -DVec3::Y);
            assert_close(body_from_orbit * DVec3::X, DVec3::X);
            assert_close(body_from_inertial * ORBIT.inertial_from_orbit(time).x_axis, DVec3::X);
            assert!((body_from_inertial.determinant() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn sun_pointing_holds_the_sun_and_leans_to_the_orbit_normal() {
        let attitude = Attitude::Sun { sun_axis: DVec3::X, north_axis: DVec3::Z };
        let (body_from_inertial, body_from_orbit) = BodyFrame::new(&attitude, &ORBIT).unwrap().rotations(&ORBIT, 777.0);
        assert_close(body_from_inertial * ORBIT.sun_direction(), DVec3::X);
        let north = body_from_inertial * DVec3::Z;
        assert!(north.z > 0.9 && north.y.abs() < 1e-12, "{north}");
        assert_close(body_from_orbit * DVec3::Z, body_from_inertial * -ORBIT.zenith(777.0));

        let sun_over_the_pole = CircularOrbit { beta: FRAC_PI_2, ..ORBIT };
        let frame = BodyFrame::new(&attitude, &sun_over_the_pole).unwrap();
        let (body_from_inertial, _) = frame.rotations(&sun_over_the_pole, 0.0);
        assert_close(body_from_inertial * DVec3::Z, DVec3::X);
        assert_close(body_from_inertial * DVec3::X, DVec3::Z);
    }

    #[test]
    fn an_inertial_attitude_is_the_inverse_of_its_quaternion() {
        let inertial_from_body = DQuat::from_axis_angle(DVec3::Z, FRAC_PI_2);
        let frame = BodyFrame::new(&Attitude::Inertial { inertial_from_body }, &ORBIT).unwrap();
        let (body_from_inertial, _) = frame.rotations(&ORBIT, 50.0);
        assert_close(body_from_inertial * DVec3::Y, DVec3::X);
    }

    #[test]
    fn parallel_axes_and_a_zero_quaternion_give_nothing() {
        let parallel = Attitude::Nadir { nadir_axis: DVec3::Z, forward_axis: -DVec3::Z };
        assert_eq!(BodyFrame::new(&parallel, &ORBIT), None);
        let zero = Attitude::Inertial { inertial_from_body: DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0) };
        assert_eq!(BodyFrame::new(&zero, &ORBIT), None);
        let not_finite = Attitude::Sun { sun_axis: DVec3::X, north_axis: DVec3::new(f64::NAN, 0.0, 0.0) };
        assert_eq!(BodyFrame::new(&not_finite, &ORBIT), None);
    }
}
