//! Attitude laws: the rotation from the orbit's frames into the body.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};

use super::orbit_point::OrbitPoint;
use super::placements::Placements;
use super::rotation_history::{HistoryFrame, RotationHistory};

/// Attitude law.
#[derive(Debug, Clone, PartialEq)]
pub enum Attitude {
    /// One body axis points to the planet's centre. A second, made orthogonal, points towards the velocity.
    Nadir {
        /// Unit body axis that points to nadir.
        nadir_axis: DVec3,
        /// Unit body axis that points along the velocity.
        forward_axis: DVec3,
    },
    /// Fixed in the orbit's inertial frame.
    Inertial {
        /// Rotates body vectors into the inertial frame.
        inertial_from_body: DQuat,
    },
    /// One body axis points to the Sun. A second, made orthogonal, points towards the orbit normal.
    Sun {
        /// Unit body axis that points to the Sun.
        sun_axis: DVec3,
        /// Unit body axis that points towards the orbit normal.
        north_axis: DVec3,
    },
    /// The body turns about an axis that is fixed in the inertial frame.
    Spin {
        /// Rotates body vectors into the inertial frame at time 0.
        inertial_from_body: DQuat,
        /// Unit axis in the body.
        axis: DVec3,
        /// Rate of the turn [rad/s].
        rate: f64,
    },
    /// The body spins freely, so that every orientation is as likely. Its loads are means over all of them. Where a direction is needed, as for an image, the
    /// body stands along the axes of the inertial frame.
    Tumble,
    /// The attitude of a file.
    History(Arc<RotationHistory>),
}

/// An attitude law with its constant rotations computed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum BodyFrame {
    /// The rotation against the orbit frame (LVLH) is constant.
    FollowsOrbit {
        /// Rotates orbit-frame vectors into the body frame.
        body_from_orbit: DMat3,
    },
    /// The rotation against the inertial frame is constant.
    Fixed {
        body_from_inertial: DMat3,
    },
    /// The body follows the Sun and leans to the orbit normal.
    FollowsSun {
        /// Rotates vectors from the axes with Z to the Sun and X towards the orbit normal into the body frame.
        body_from_axes: DMat3,
    },
    /// The body turns at a constant rate.
    Spins {
        /// Rotates body vectors into the inertial frame at time 0.
        inertial_from_body: DQuat,
        /// Unit axis in the body.
        axis: DVec3,
        /// Rate of the turn [rad/s].
        rate: f64,
    },
    History(Arc<RotationHistory>),
    Given(Arc<Placements>),
}

impl BodyFrame {
    /// The body frame of an attitude law. `None` where two axes are parallel, or an axis or quaternion is zero or not finite.
    pub(crate) fn new(attitude: &Attitude) -> Option<Self> {
        let usable = |quaternion: &DQuat| quaternion.is_finite() && quaternion.length() > 0.0;
        match attitude {
            Attitude::Nadir { nadir_axis, forward_axis } => {
                triad(*nadir_axis, *forward_axis).map(|body_from_orbit| Self::FollowsOrbit { body_from_orbit })
            }
            Attitude::Inertial { inertial_from_body } => usable(inertial_from_body).then(|| Self::Fixed {
                body_from_inertial: DMat3::from_quat(inertial_from_body.normalize()).transpose(),
            }),
            Attitude::Sun { sun_axis, north_axis } => {
                triad(*sun_axis, *north_axis).map(|body_from_axes| Self::FollowsSun { body_from_axes })
            }
            Attitude::Spin { inertial_from_body, axis, rate } => {
                let axis = axis.try_normalize()?;
                (usable(inertial_from_body) && rate.is_finite()).then(|| Self::Spins {
                    inertial_from_body: inertial_from_body.normalize(),
                    axis,
                    rate: *rate,
                })
            }
            Attitude::Tumble => Some(Self::Fixed { body_from_inertial: DMat3::IDENTITY }),
            Attitude::History(history) => Some(Self::History(Arc::clone(history))),
        }
    }

    pub(crate) fn repeats_with_the_orbit(&self) -> bool {
        !matches!(self, Self::Spins { .. } | Self::History(_) | Self::Given(_))
    }

    /// Period of a spinning body [s]. `None` for any other.
    pub(crate) fn spin_period(&self) -> Option<f64> {
        match self {
            Self::Spins { rate, .. } if *rate != 0.0 => Some(TAU / rate.abs()),
            _ => None,
        }
    }

    /// Rotations into the body frame: from the inertial frame, and from the orbit frame. Their values are NaN where a table of rotations
    /// does not cover the time.
    ///
    /// A Sun-pointing attitude whose Sun lies along the orbit normal (beta = 90 deg) uses the inertial X as its second axis.
    pub(crate) fn rotations(&self, point: &OrbitPoint) -> (DMat3, DMat3) {
        let inertial_from_orbit = point.inertial_from_orbit;
        let from_inertial = |body_from_inertial: DMat3| (body_from_inertial, body_from_inertial * inertial_from_orbit);
        let from_orbit = |body_from_orbit: DMat3| (body_from_orbit * inertial_from_orbit.transpose(), body_from_orbit);
        match self {
            Self::FollowsOrbit { body_from_orbit } => from_orbit(*body_from_orbit),
            Self::Fixed { body_from_inertial } => from_inertial(*body_from_inertial),
            Self::FollowsSun { body_from_axes } => {
                let normal = -inertial_from_orbit.y_axis;
                let axes = triad(point.sun_direction, normal).or_else(|| triad(point.sun_direction, DVec3::X));
                axes.map_or_else(nowhere, |axes| from_inertial(*body_from_axes * axes.transpose()))
            }
            Self::Spins { inertial_from_body, axis, rate } => {
                let turned = *inertial_from_body * DQuat::from_axis_angle(*axis, (rate * point.time) % TAU);
                from_inertial(DMat3::from_quat(turned).transpose())
            }
            Self::Given(places) => from_inertial(DMat3::from_quat(places.inertial_from_body(point.time)).transpose()),
            Self::History(history) => history.rotation(point.time).map_or_else(nowhere, |frame_from_body| {
                let body_from_frame = DMat3::from_quat(frame_from_body).transpose();
                match history.frame {
                    HistoryFrame::Inertial => from_inertial(body_from_frame),
                    HistoryFrame::Orbit => from_orbit(body_from_frame),
                }
            }),
        }
    }
}

fn nowhere() -> (DMat3, DMat3) {
    (DMat3::NAN, DMat3::NAN)
}

/// Sine of the angle below which two axes count as parallel.
const PARALLEL: f64 = 1e-9;

/// Right-handed axes as columns: Z along `primary`, X along the component of `secondary` at right angles to it. `None` where the two are
/// parallel, zero or not finite.
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

    use super::*;
    use crate::environment::{CircularOrbit, Orbit};

    const ORBIT: CircularOrbit = CircularOrbit { altitude: 408e3, period: 5560.0, beta: 0.4, phase: 0.2 };

    fn point(orbit: &CircularOrbit, time: f64) -> OrbitPoint {
        Orbit::from(orbit).point(time, 6.371e6).unwrap()
    }

    fn assert_close(computed: DVec3, expected: DVec3) {
        assert!(computed.distance(expected) < 1e-12, "{computed} is not {expected}");
    }

    #[test]
    fn nadir_pointing_holds_its_axes_on_nadir_and_velocity() {
        let attitude = Attitude::Nadir { nadir_axis: -DVec3::Y, forward_axis: DVec3::new(1.0, 0.5, 0.0) };
        let frame = BodyFrame::new(&attitude).unwrap();
        for time in [0.0, 1234.5, 1e6] {
            let (body_from_inertial, body_from_orbit) = frame.rotations(&point(&ORBIT, time));
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
        let (body_from_inertial, body_from_orbit) = BodyFrame::new(&attitude).unwrap().rotations(&point(&ORBIT, 777.0));
        assert_close(body_from_inertial * ORBIT.sun_direction(), DVec3::X);
        let north = body_from_inertial * DVec3::Z;
        assert!(north.z > 0.9 && north.y.abs() < 1e-12, "{north}");
        assert_close(body_from_orbit * DVec3::Z, body_from_inertial * -ORBIT.zenith(777.0));

        let sun_over_the_pole = CircularOrbit { beta: FRAC_PI_2, ..ORBIT };
        let frame = BodyFrame::new(&attitude).unwrap();
        let (body_from_inertial, _) = frame.rotations(&point(&sun_over_the_pole, 0.0));
        assert_close(body_from_inertial * DVec3::Z, DVec3::X);
        assert_close(body_from_inertial * DVec3::X, DVec3::Z);
    }

    #[test]
    fn an_inertial_attitude_is_the_inverse_of_its_quaternion() {
        let inertial_from_body = DQuat::from_axis_angle(DVec3::Z, FRAC_PI_2);
        let frame = BodyFrame::new(&Attitude::Inertial { inertial_from_body }).unwrap();
        let (body_from_inertial, _) = frame.rotations(&point(&ORBIT, 50.0));
        assert_close(body_from_inertial * DVec3::Y, DVec3::X);
    }

    #[test]
    fn parallel_axes_and_a_zero_quaternion_give_nothing() {
        let parallel = Attitude::Nadir { nadir_axis: DVec3::Z, forward_axis: -DVec3::Z };
        assert_eq!(BodyFrame::new(&parallel), None);
        let zero = Attitude::Inertial { inertial_from_body: DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0) };
        assert_eq!(BodyFrame::new(&zero), None);
        let not_finite = Attitude::Sun { sun_axis: DVec3::X, north_axis: DVec3::new(f64::NAN, 0.0, 0.0) };
        assert_eq!(BodyFrame::new(&not_finite), None);
    }

    #[test]
    fn a_spinning_body_turns_about_its_own_axis() {
        let inertial_from_body = DQuat::from_axis_angle(DVec3::X, 0.7);
        let attitude = Attitude::Spin { inertial_from_body, axis: DVec3::Z, rate: 0.01 };
        let frame = BodyFrame::new(&attitude).unwrap();
        let inertial_from_body_at = |time: f64| frame.rotations(&point(&ORBIT, time)).0.transpose();
        assert_close(inertial_from_body_at(0.0) * DVec3::Y, inertial_from_body * DVec3::Y);
        assert_close(inertial_from_body_at(1234.0) * DVec3::Z, inertial_from_body * DVec3::Z);
        assert_close(inertial_from_body_at(50.0 * std::f64::consts::PI) * DVec3::X, inertial_from_body * DVec3::Y);
    }
}
