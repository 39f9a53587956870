//! The sky at an instant: where Sun and planet stand in the body frame, and when eclipses begin and end.

use std::f64::consts::TAU;

use glam::DVec3;
use thiserror::Error;

use super::Sky;
use super::attitude::BodyFrame;
use super::eclipse::{Discs, sign_change};
use super::orbit::SUN_DISTANCE;
use crate::scene::{Attitude, CircularOrbit, Environment};

/// Values from which no sky can be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SkyError {
    /// A length or time that must be positive and finite.
    #[error("{what} must be positive and finite, not {value}")]
    NotPositive {
        /// Which one, with its unit.
        what: &'static str,
        /// What was given.
        value: f64,
    },
    /// An altitude that rounding would lose against the planet's radius.
    #[error("the altitude of {altitude} m is nothing beside the planet radius of {planet_radius} m")]
    OnTheGround {
        /// Altitude [m].
        altitude: f64,
        /// Radius [m].
        planet_radius: f64,
    },
    /// An angle that is not finite.
    #[error("{what} must be finite, not {value}")]
    NotFinite {
        /// Which one.
        what: &'static str,
        /// What was given.
        value: f64,
    },
    /// An attitude that does not say how the body is turned.
    #[error("the two axes of the attitude are parallel, or an axis or its quaternion is zero or not finite")]
    Attitude,
}

/// Least altitude over planet radius (6 mm over Earth): below, `distance_ratio - 1` has too few digits left.
const LEAST_RELATIVE_ALTITUDE: f64 = 1e-9;

/// Orbit, attitude and planet of a scene, ready to say where the Sun stands at any time.
///
/// The Sun's direction is that from the planet's centre, the same for every place of the orbit: the parallax (5e-5 rad
/// in low orbits) is a hundredth of the Sun's own width. Eclipses use the Sun's finite distance.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyModel {
    orbit: CircularOrbit,
    body: BodyFrame,
    planet_radius: f64,
    eclipse: bool,
}

impl SkyModel {
    /// The sky of a scene.
    ///
    /// # Errors
    /// Where altitude, period or planet radius are not positive, an angle is not finite, or the attitude is degenerate.
    pub fn new(orbit: &CircularOrbit, attitude: &Attitude, environment: &Environment) -> Result<Self, SkyError> {
        let positive = [
            ("the altitude [m]", orbit.altitude),
            ("the period [s]", orbit.period),
            ("the planet radius [m]", environment.planet_radius),
        ];
        for (what, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(SkyError::NotPositive { what, value });
            }
        }
        let (altitude, planet_radius) = (orbit.altitude, environment.planet_radius);
        if altitude / planet_radius < LEAST_RELATIVE_ALTITUDE {
            return Err(SkyError::OnTheGround { altitude, planet_radius });
        }
        for (what, value) in [("beta", orbit.beta), ("the phase", orbit.phase)] {
            if !value.is_finite() {
                return Err(SkyError::NotFinite { what, value });
            }
        }
        let body = BodyFrame::new(attitude, orbit).ok_or(SkyError::Attitude)?;
        Ok(Self { orbit: orbit.clone(), body, planet_radius: environment.planet_radius, eclipse: environment.eclipse })
    }

    /// Period after which everything in the body frame repeats [s].
    pub fn period(&self) -> f64 {
        self.orbit.period
    }

    /// Distance to the planet's centre over its radius.
    pub fn distance_ratio(&self) -> f64 {
        1.0 + self.orbit.altitude / self.planet_radius
    }

    /// The sky at this time [s].
    pub fn sky(&self, time: f64) -> Sky {
        let (body_from_inertial, body_from_orbit) = self.body.rotations(&self.orbit, time);
        let zenith = self.orbit.zenith(time);
        let sun = self.orbit.sun_direction();
        Sky {
            time,
            body_from_inertial,
            body_from_orbit,
            sun_direction: body_from_inertial * sun,
            nadir_direction: body_from_inertial * -zenith,
            lit_fraction: self.lit_fraction(time),
            distance_ratio: self.distance_ratio(),
            sun_zenith: zenith.cross(sun).length().atan2(zenith.dot(sun)),
        }
    }

    /// Unit vector to the Sun, body frame.
    pub fn sun_direction(&self, time: f64) -> DVec3 {
        self.body.rotations(&self.orbit, time).0 * self.orbit.sun_direction()
    }

    /// Share of the Sun's disc that the planet leaves visible, in [0, 1]; 1 where the scene has no eclipse.
    pub fn lit_fraction(&self, time: f64) -> f64 {
        if self.eclipse { self.discs(time).lit_fraction() } else { 1.0 }
    }

    /// Times in (`start`, `end`) [s] at which penumbra or umbra begins or ends, in order.
    ///
    /// The separation of Sun and planet moves one way from orbit noon to midnight and back the other way, so between
    /// two of these each contact happens at most once, and a change of sign finds it.
    pub fn contacts(&self, start: f64, end: f64) -> Vec<f64> {
        let mut contacts = Vec::new();
        if !self.eclipse {
            return contacts;
        }
        let half = 0.5 * self.orbit.period;
        let since_noon = self.orbit.angle(start) / TAU * self.orbit.period;
        let mut turn = start - since_noon.rem_euclid(half) + half;
        let mut low = start;
        while low < end {
            let high = turn.min(end);
            contacts.extend(sign_change(|time| self.discs(time).outer_gap(), low, high));
            contacts.extend(sign_change(|time| self.discs(time).inner_gap(), low, high));
            low = high;
            turn += half;
        }
        contacts.retain(|&time| start < time && time < end);
        contacts.sort_by(f64::total_cmp);
        contacts
    }

    /// Angle that the Sun's direction sweeps in the body frame between two times [rad], by its chords.
    pub fn sun_sweep(&self, start: f64, end: f64) -> f64 {
        const CHORDS: u32 = 16;
        let direction = |index: u32| self.sun_direction(start + (end - start) * f64::from(index) / f64::from(CHORDS));
        let chord = |index: u32| 2.0 * (0.5 * direction(index).distance(direction(index + 1))).min(1.0).asin();
        (0..CHORDS).map(chord).sum::<f64>().min(TAU * ((end - start) / self.orbit.period).max(1.0))
    }

    fn discs(&self, time: f64) -> Discs {
        let craft = self.orbit.zenith(time) * (self.planet_radius + self.orbit.altitude);
        Discs::seen_from(craft, self.orbit.sun_direction() * SUN_DISTANCE, self.planet_radius)
    }
}

/// Angle of the planet's horizon from the point below the craft, at the planet's centre [rad].
pub fn horizon_angle(distance_ratio: f64) -> f64 {
    (distance_ratio * distance_ratio - 1.0).max(0.0).sqrt().atan()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DQuat;

    use super::*;

    fn orbit(altitude: f64, period: f64) -> CircularOrbit {
        CircularOrbit { altitude, period, beta: 0.0, phase: 20f64.to_radians() }
    }

    fn environment() -> Environment {
        Environment {
            solar_constant: Some(1361.0),
            albedo: Some(0.3),
            planet_ir: Some(237.0),
            planet_radius: 6.378_137e6,
            eclipse: true,
            background_temperature: Some(2.7),
        }
    }

    fn model(altitude: f64, beta: f64) -> SkyModel {
        let orbit = CircularOrbit { beta, ..orbit(altitude, 6017.0) };
        SkyModel::new(&orbit, &Attitude::Inertial { inertial_from_body: DQuat::IDENTITY }, &environment()).unwrap()
    }

    /// NUMERICS.md 2: the planet's shadow is steps 85-235 of 360 at 224 km and 97-223 at 772 km, with phase 20 deg.
    #[test]
    fn the_papers_shadow_begins_and_ends_where_numerics_2_says() {
        for (altitude, entry, exit) in [(224e3, 85.0, 235.0), (772e3, 97.0, 223.0)] {
            let step = 6017.0 / 360.0;
            let contacts: Vec<f64> =
                model(altitude, 0.0).contacts(0.0, 6017.0).into_iter().map(|time| time / step).collect();
            let [penumbra, umbra, umbra_end, penumbra_end] = contacts[..] else { panic!("{contacts:?}") };
            assert!(penumbra < umbra && umbra < umbra_end && umbra_end < penumbra_end, "{contacts:?}");
            assert!((0.5 * (penumbra + umbra) - entry).abs() < 0.6, "{altitude} m: {contacts:?}");
            assert!((0.5 * (umbra_end + penumbra_end) - exit).abs() < 0.6, "{altitude} m: {contacts:?}");
            let other = model(996e3 - altitude, 0.0).contacts(0.0, 6017.0);
            assert!((other[0] / step - entry).abs() > 5.0, "the other altitude must not pass");
        }
    }

    #[test]
    fn contacts_are_where_the_lit_fraction_changes() {
        for beta in [0.0, 0.7, -1.0] {
            let model = model(224e3, beta);
            let contacts = model.contacts(-5500.0, 24_500.0);
            assert_eq!(contacts.len(), if beta == 0.0 { 20 } else { contacts.len() / 4 * 4 }, "beta {beta}");
            assert!(contacts.len() >= 16, "beta {beta}");
            for quad in contacts.chunks(4) {
                assert_eq!(model.lit_fraction(quad[0] - 1e-6), 1.0);
                assert!(model.lit_fraction(quad[0] + 1e-2) < 1.0);
                assert_eq!(model.lit_fraction(quad[1] + 1e-6), 0.0);
                assert!(model.lit_fraction(quad[1] - 1e-2) > 0.0);
                assert_eq!(model.lit_fraction(quad[2] - 1e-6), 0.0);
                assert!(model.lit_fraction(quad[2] + 1e-2) > 0.0);
                assert!(model.lit_fraction(quad[3] - 1e-2) < 1.0);
                assert_eq!(model.lit_fraction(quad[3] + 1e-6), 1.0);
            }
        }
    }

    #[test]
    fn contacts_do_not_depend_on_how_time_is_cut() {
        let model = model(408e3, 0.5);
        let whole = model.contacts(0.0, 12_000.0);
        let cut: Vec<f64> =
            (0..1200).flat_map(|tick| model.contacts(f64::from(tick) * 10.0, f64::from(tick + 1) * 10.0)).collect();
        assert_eq!(whole.len(), cut.len());
        for (a, b) in whole.iter().zip(&cut) {
            assert!((a - b).abs() < 1e-7, "{a} {b}");
        }
    }

    #[test]
    fn high_beta_and_a_scene_without_eclipse_stay_lit() {
        for beta in [1.4, std::f64::consts::FRAC_PI_2] {
            assert_eq!(model(772e3, beta).contacts(0.0, 6017.0), Vec::<f64>::new());
            assert_eq!(model(772e3, beta).lit_fraction(3000.0), 1.0);
        }
        let without = Environment { eclipse: false, ..environment() };
        let attitude = Attitude::Sun { sun_axis: DVec3::X, north_axis: DVec3::Z };
        let model = SkyModel::new(&orbit(224e3, 6017.0), &attitude, &without).unwrap();
        assert_eq!(model.contacts(0.0, 6017.0), Vec::<f64>::new());
        assert_eq!(model.sky(2600.0).lit_fraction, 1.0);
    }

    #[test]
    fn the_sky_agrees_with_its_parts() {
        let attitude = Attitude::Nadir { nadir_axis: DVec3::Z, forward_axis: DVec3::X };
        let orbit = CircularOrbit { beta: 0.4, ..orbit(408e3, 5560.0) };
        let model = SkyModel::new(&orbit, &attitude, &environment()).unwrap();
        for time in [0.0, 900.0, 2500.0] {
            let sky = model.sky(time);
            assert!(sky.nadir_direction.distance(DVec3::Z) < 1e-12);
            assert!((sky.sun_zenith.cos() + sky.sun_direction.z).abs() < 1e-12);
            assert!((sky.body_from_orbit * DVec3::Z).distance(sky.nadir_direction) < 1e-12);
            assert!(sky.sun_direction.distance(model.sun_direction(time)) < 1e-15);
        }
        let sweep = model.sun_sweep(100.0, 200.0);
        assert!((sweep - TAU * 100.0 / 5560.0 * 0.4f64.cos()).abs() < 1e-3, "{sweep}");
        let turned = CircularOrbit { phase: orbit.phase + PI, ..orbit };
        let other = SkyModel::new(&turned, &attitude, &environment()).unwrap();
        assert!((other.sky(0.0).sun_zenith - model.sky(0.0).sun_zenith).abs() > 0.5);
    }

    #[test]
    fn unusable_values_are_named() {
        let attitude = Attitude::Sun { sun_axis: DVec3::X, north_axis: DVec3::Z };
        let error = |orbit: CircularOrbit| SkyModel::new(&orbit, &attitude, &environment()).unwrap_err().to_string();
        assert!(error(orbit(-1.0, 6017.0)).contains("altitude"));
        assert!(error(orbit(408e3, 0.0)).contains("period"));
        assert!(error(orbit(1e-4, 6017.0)).contains("nothing beside the planet radius"));
        assert!(error(CircularOrbit { beta: f64::NAN, ..orbit(408e3, 5560.0) }).contains("beta"));
        let parallel = Attitude::Sun { sun_axis: DVec3::X, north_axis: DVec3::X };
        assert_eq!(SkyModel::new(&orbit(408e3, 5560.0), &parallel, &environment()), Err(SkyError::Attitude));
    }
}
