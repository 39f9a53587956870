//! Beta angle and distance of the Sun from the day of the year and the plane of the orbit.
//!
//! The Sun goes round a circle at a constant rate, so its direction errs by up to 2 deg, which is little beside the range of the drawn days.

use std::f64::consts::TAU;

use super::distribution::Distribution;
use super::random::RandomSource;
use super::reader::SpecTable;
use crate::scene::SceneError;

/// Keys of `[season]`.
pub(crate) const SEASON: &[&str] = &["day", "inclination_deg", "node_deg"];

/// Length of the year [d].
const YEAR: f64 = 365.2422;
/// Day of the year of the equinox in March.
const EQUINOX: f64 = 79.6;
/// Day of the year on which the Earth is nearest to the Sun.
const PERIHELION: f64 = 3.5;
/// Eccentricity of the Earth's orbit.
const ECCENTRICITY: f64 = 0.0167;
/// Obliquity of the ecliptic [deg].
const OBLIQUITY: f64 = 23.44;

/// Day of the year and plane of the orbit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Season {
    day: Distribution,
    inclination: Distribution,
    node: Distribution,
}

impl Season {
    pub(super) fn read(root: &SpecTable) -> Result<Option<Self>, SceneError> {
        let Some(table) = root.table("season", SEASON)? else { return Ok(None) };
        let take =
            |key: &str, range, unit: &str, what: &str| table.required(key, table.drawn_number(key, range, unit)?, what);
        Ok(Some(Self {
            day: take("day", 0.0..=366.0, "d", "the day of the year, from 0")?,
            inclination: take("inclination_deg", 0.0..=180.0, "deg", "the inclination of the orbit [deg]")?,
            node: take("node_deg", -360.0..=360.0, "deg", "the right ascension of the ascending node [deg]")?,
        }))
    }

    /// Names of the numbers of an orbit.
    pub(crate) fn names(&self) -> Vec<String> {
        [("day", &self.day), ("inclination_deg", &self.inclination), ("node_deg", &self.node)]
            .iter()
            .flat_map(|(key, drawn)| drawn.names(&format!("season.{key}")))
            .collect()
    }

    /// The drawn values by name: day, inclination and node, and the beta angle [deg] and the factor of the solar constant that follow.
    pub(crate) fn draw(&self, source: &RandomSource) -> [(&'static str, f64); 5] {
        let day = self.day.number("season.day", source);
        let inclination = self.inclination.number("season.inclination_deg", source);
        let node = self.node.number("season.node_deg", source);
        [
            ("day", day),
            ("inclination_deg", inclination),
            ("node_deg", node),
            ("beta_deg", beta_deg(day, inclination, node)),
            ("solar_scale", solar_scale(day)),
        ]
    }
}

/// Angle between the Sun and the plane of an orbit [deg].
fn beta_deg(day: f64, inclination: f64, node: f64) -> f64 {
    let [longitude, tilt] = [TAU * (day - EQUINOX) / YEAR, OBLIQUITY.to_radians()];
    let sun = [libm::cos(longitude), libm::sin(longitude) * libm::cos(tilt), libm::sin(longitude) * libm::sin(tilt)];
    let [inclination, node] = [inclination, node].map(f64::to_radians);
    let normal =
        [libm::sin(inclination) * libm::sin(node), -libm::sin(inclination) * libm::cos(node), libm::cos(inclination)];
    let sine: f64 = sun.iter().zip(normal).map(|(a, b)| a * b).sum();
    libm::asin(sine.clamp(-1.0, 1.0)).to_degrees()
}

/// Sunlight of a day, as a multiple of the sunlight at one astronomical unit.
fn solar_scale(day: f64) -> f64 {
    let distance = 1.0 - ECCENTRICITY * libm::cos(TAU * (day - PERIHELION) / YEAR);
    1.0 / (distance * distance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beta_is_that_of_known_orbits() {
        // The equator at the equinox and at the solstice.
        assert!(beta_deg(EQUINOX, 0.0, 40.0).abs() < 1e-9);
        assert!((beta_deg(EQUINOX + YEAR / 4.0, 0.0, 40.0) - OBLIQUITY).abs() < 1e-9);
        // A polar orbit over the terminator sees the Sun along its normal.
        assert!((beta_deg(EQUINOX, 90.0, 90.0) - 90.0).abs() < 1e-5);
        assert!((beta_deg(EQUINOX, 90.0, 0.0)).abs() < 1e-9);
        // The greatest beta angle of an orbit is inclination + obliquity: 75.04 deg for the ISS (51.6 deg).
        let greatest = (0..360).map(|node| beta_deg(EQUINOX + YEAR / 4.0, 51.6, f64::from(node))).fold(0.0, f64::max);
        assert!((greatest - 75.04).abs() < 0.01, "{greatest}");
    }

    #[test]
    fn sunlight_varies_by_a_thirtieth() {
        // 1361 W/m2 at 1 au: 1408 in January and 1316 in July (NASA, Earth fact sheet; ASTM E490 gives 1412 and 1321 for 1366).
        assert!((1361.0 * solar_scale(PERIHELION) - 1408.0).abs() < 1.0);
        assert!((1361.0 * solar_scale(PERIHELION + YEAR / 2.0) - 1316.5).abs() < 1.0);
    }
}
