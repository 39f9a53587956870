//! A circular orbit in its inertial frame, the direction of the Sun, and Kepler's law for its period.

use std::f64::consts::TAU;
use std::fmt;

use glam::{DMat3, DVec3};

/// Earth's gravitational parameter [m3/s2] (IERS Conventions 2010, table 1.1).
pub(crate) const EARTH_GRAVITATIONAL_PARAMETER: f64 = 3.986_004_418e14;

/// Distance of the Sun from the planet, one astronomical unit [m] (IAU 2012 resolution B2).
pub(crate) const SUN_DISTANCE: f64 = 149_597_870_700.0;

/// Radius of the Sun [m] (IAU 2015 resolution B3, nominal).
pub(crate) const SUN_RADIUS: f64 = 6.957e8;

/// Lowest altitude as a share of the planet's radius. A lower value is probably in kilometres by mistake. For the Earth
/// it is 6.4 km.
pub(crate) const LOWEST_ALTITUDE: f64 = 1e-3;

/// A circular orbit. Altitude and period are separate inputs. The program prints a disagreement between them.
#[derive(Debug, Clone, PartialEq)]
pub struct CircularOrbit {
    /// Height above the planet radius [m].
    pub altitude: f64,
    /// Period [s].
    pub period: f64,
    /// Angle between the Sun's direction and the orbit plane [rad].
    pub beta: f64,
    /// Angle from orbit noon at time 0, in the direction of motion [rad].
    pub phase: f64,
}

impl CircularOrbit {
    /// Angle from orbit noon [rad], in [0, 2 pi) up to rounding.
    pub(crate) fn angle(&self, time: f64) -> f64 {
        (self.phase + TAU * (time / self.period).fract()).rem_euclid(TAU)
    }

    /// Unit vector to the Sun, inertial frame.
    pub(crate) fn sun_direction(&self) -> DVec3 {
        DVec3::new(self.beta.cos(), 0.0, self.beta.sin())
    }

    /// Unit vector from the planet's centre to the craft, inertial frame.
    pub(crate) fn zenith(&self, time: f64) -> DVec3 {
        let (sin, cos) = self.angle(time).sin_cos();
        DVec3::new(cos, sin, 0.0)
    }

    /// Rotates orbit-frame (LVLH: X velocity, Y against the orbit normal, Z nadir) vectors into the inertial frame.
    pub(crate) fn inertial_from_orbit(&self, time: f64) -> DMat3 {
        let zenith = self.zenith(time);
        DMat3::from_cols(DVec3::new(-zenith.y, zenith.x, 0.0), -DVec3::Z, -zenith)
    }
}

/// The Kepler period [s] of a circular orbit of Earth with this radius [m].
pub(crate) fn kepler_period(orbit_radius: f64) -> f64 {
    TAU * (orbit_radius.powi(3) / EARTH_GRAVITATIONAL_PARAMETER).sqrt()
}

/// The radius [m] of a circular orbit of Earth with this period [s].
pub(crate) fn kepler_radius(period: f64) -> f64 {
    (EARTH_GRAVITATIONAL_PARAMETER * (period / TAU).powi(2)).cbrt()
}

/// An altitude and a period that do not agree (docs/numerics.md 2). The disagreement is printed, not corrected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PeriodDisagreement {
    /// Altitude of the scene [m].
    pub(crate) altitude: f64,
    /// Period of the scene [s].
    pub(crate) period: f64,
    /// Period of a circular orbit at this altitude around Earth [s].
    pub(crate) kepler_period: f64,
    /// Altitude of a circular orbit with this period around Earth [m].
    pub(crate) kepler_altitude: f64,
}

impl fmt::Display for PeriodDisagreement {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            out,
            "an altitude of {:.0} km means a period of {:.0} s around Earth; the scene says {:.0} s, which is {:.0} km \
             (both are used as given)",
            self.altitude / 1e3,
            self.kepler_period,
            self.period,
            self.kepler_altitude / 1e3
        )
    }
}

/// Disagreement of the altitude and the period of an orbit around a planet of this radius [m]. `None` where they agree within [`PERIOD_TOLERANCE`].
pub(crate) fn period_disagreement(orbit: &CircularOrbit, planet_radius: f64) -> Option<PeriodDisagreement> {
    // The gravitational parameter of another planet is not known.
    if !EARTH_RADII.contains(&planet_radius) {
        return None;
    }
    let kepler_period = kepler_period(planet_radius + orbit.altitude);
    ((kepler_period - orbit.period).abs() > PERIOD_TOLERANCE).then(|| PeriodDisagreement {
        altitude: orbit.altitude,
        period: orbit.period,
        kepler_period,
        kepler_altitude: kepler_radius(orbit.period) - planet_radius,
    })
}

/// Planet radii that count as Earth's [m].
pub(crate) const EARTH_RADII: std::ops::RangeInclusive<f64> = 6.350e6..=6.385e6;

/// Greatest difference between period and Kepler period that is not reported [s]. Users round to a second.
pub(crate) const PERIOD_TOLERANCE: f64 = 1.0;

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// Earth's mean radius [m].
    const MEAN_RADIUS: f64 = 6.371e6;

    fn paper_orbit() -> CircularOrbit {
        CircularOrbit { altitude: 224e3, period: 6017.0, beta: 0.0, phase: 0.0 }
    }

    #[test]
    fn the_paper_disagrees_with_kepler_as_numerics_2_says() {
        let with_equatorial_radius = period_disagreement(&paper_orbit(), 6.378_137e6).unwrap();
        let text = with_equatorial_radius.to_string();
        assert!(text.contains("224 km means a period of 5339 s"), "{text}");
        assert!(text.contains("6017 s, which is 772 km"), "{text}");

        let with_mean_radius = period_disagreement(&paper_orbit(), MEAN_RADIUS).unwrap().to_string();
        assert!(with_mean_radius.contains("5330 s") && with_mean_radius.contains("779 km"), "{with_mean_radius}");
    }

    #[test]
    fn a_kepler_orbit_is_not_reported() {
        let period = kepler_period(MEAN_RADIUS + 408e3);
        let orbit = |period| CircularOrbit { altitude: 408e3, period, beta: 0.0, phase: 0.0 };
        assert_eq!(period_disagreement(&orbit(period.round()), MEAN_RADIUS), None);
        assert!(period_disagreement(&orbit(period + 2.0), MEAN_RADIUS).is_some());
    }

    #[test]
    fn the_craft_goes_from_noon_towards_y_with_lvlh_axes() {
        let orbit = CircularOrbit { beta: 0.3, ..paper_orbit() };
        assert!(orbit.zenith(0.0).distance(DVec3::X) < 1e-15);
        assert!(orbit.zenith(6017.0 / 4.0).distance(DVec3::Y) < 1e-15);
        assert!(orbit.zenith(6017.0 * 1e6).distance(DVec3::X) < 1e-9);
        let time = 700.0;
        let axes = orbit.inertial_from_orbit(time);
        let velocity = (orbit.zenith(time + 0.5) - orbit.zenith(time - 0.5)).normalize();
        assert!(axes.x_axis.distance(velocity) < 1e-6);
        assert!(axes.y_axis.distance(-DVec3::Z) < 1e-15);
        assert!(axes.z_axis.distance(-orbit.zenith(time)) < 1e-15);
        assert!((axes.determinant() - 1.0).abs() < 1e-14);
        assert!((orbit.sun_direction().angle_between(DVec3::Z) - (FRAC_PI_2 - 0.3)).abs() < 1e-12);
    }
}
