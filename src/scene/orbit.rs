//! `[orbit]`: a circular orbit with separate altitude and period, or a trajectory from a file.

use std::f64::consts::TAU;
use std::path::PathBuf;

use hifitime::Epoch;

use super::ephemeris::{self, Options, read_file};
use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use crate::environment::divided_differences::HIGHEST_DEGREE;
use crate::environment::orbit::LOWEST_ALTITUDE;
use crate::environment::{CircularOrbit, Orbit};

/// Keys of a circular orbit, and the keys of a trajectory except `file`.
const CIRCULAR: &[&str] = &["altitude", "period", "beta_deg", "phase_deg"];
const OF_A_FILE: &[&str] = &["object", "frame", "time_system", "interpolation", "degree"];

/// Gravitational parameter of the Earth [m3/s2] (WGS 84, IERS Conventions 2010).
const EARTH_GRAVITATIONAL_PARAMETER: f64 = 3.986_004_418e14;

/// Planet radii that count as the Earth's [m]. The range includes the polar, mean and equatorial radius.
const EARTH_RADII: std::ops::RangeInclusive<f64> = 6.35e6..=6.385e6;

/// Relative difference between the stated period and Kepler's above which the user gets a warning.
const PERIOD_TOLERANCE: f64 = 1e-3;

/// Reads `[orbit]`. `planet_radius` is in [m]. `start` is the start of `[time]`.
pub(super) fn read(
    section: &Section,
    planet_radius: f64,
    start: Option<Epoch>,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Orbit, SceneError> {
    if section.has("file")
        && let Some(key) = CIRCULAR.iter().find(|key| section.has(key))
    {
        return Err(section.clash(key, &["file"], "belongs to a circular orbit, and orbit.file states a trajectory"));
    }
    let Some(path) = section.path("file")? else {
        if let Some(key) = OF_A_FILE.iter().find(|key| section.has(key)) {
            return Err(section.clash(key, &["file"], "belongs to a trajectory, and orbit.file is missing"));
        }
        return circular(section, planet_radius, assumptions).map(Orbit::Circular);
    };
    if !EARTH_RADII.contains(&planet_radius) {
        let message = format!("is a trajectory around the Earth, but environment.planet_radius is {planet_radius} m");
        return Err(section.clash("file", &["environment.planet_radius"], message));
    }
    let text = read_file(path.clone(), files).map_err(|error| section.error("file", error))?;
    let word = |key: &str| -> Result<Option<String>, SceneError> { Ok(section.string(key)?.map(str::to_owned)) };
    let options = Options {
        object: word("object")?,
        frame: word("frame")?,
        time_system: word("time_system")?,
        interpolation: section
            .choice("interpolation", &[("hermite", "HERMITE"), ("lagrange", "LAGRANGE"), ("linear", "LINEAR")])?
            .map(str::to_owned),
        degree: section.whole("degree", 1..=HIGHEST_DEGREE as u32)?,
        start,
        elsewhere: false,
    };
    let others = [OF_A_FILE, &["time.start"]].concat();
    let trajectory = section.blame("file", &others, ephemeris::read(&path, &text, &options, assumptions))?;
    Ok(Orbit::Trajectory(trajectory))
}

fn circular(section: &Section, planet_radius: f64, assumptions: &mut Vec<String>) -> Result<CircularOrbit, SceneError> {
    let altitude = section.number("altitude", Quantity::between(0.0, 1e13, "m"))?;
    let altitude =
        section.required("altitude", altitude, "the height above the planet's radius [m], or a trajectory's file")?;
    if altitude < LOWEST_ALTITUDE * planet_radius {
        let message = format!(
            "{altitude} m is less than a thousandth of the planet's radius ({planet_radius} m); altitude is in metres"
        );
        return Err(section.clash("altitude", &["environment.planet_radius"], message));
    }
    let period = period(section, altitude, planet_radius, assumptions)?;
    let mut angle = |key: &str, quantity, meaning: &str| -> Result<f64, SceneError> {
        let degrees = section.number(key, quantity)?.unwrap_or_else(|| {
            assumptions.push(format!("{meaning} (orbit.{key} is absent)."));
            0.0
        });
        Ok(degrees.to_radians())
    };
    let beta = angle("beta_deg", Quantity::within(-90.0, 90.0, "deg"), "The Sun lies in the orbit plane")?;
    let phase = angle("phase_deg", Quantity::any("deg"), "Time 0 is orbit noon")?;
    Ok(CircularOrbit { altitude, period, beta, phase })
}

fn period(
    section: &Section,
    altitude: f64,
    planet_radius: f64,
    assumptions: &mut Vec<String>,
) -> Result<f64, SceneError> {
    let stated = section.number("period", Quantity::between(0.0, 1e12, "s"))?;
    let kepler = EARTH_RADII.contains(&planet_radius).then(|| kepler_period(altitude, planet_radius));
    match (stated, kepler) {
        (Some(period), Some(kepler)) if (period / kepler - 1.0).abs() > PERIOD_TOLERANCE => {
            assumptions.push(format!(
                "The stated period {period} s is used although a circular orbit at the stated altitude takes \
                 {kepler:.1} s."
            ));
            Ok(period)
        }
        (Some(period), _) => Ok(period),
        (None, Some(kepler)) => {
            assumptions.push(format!(
                "The period is Kepler's for the altitude, {kepler:.1} s (orbit.period is absent; \
                 mu = 3.986004418e14 m3/s2)."
            ));
            Ok(kepler)
        }
        (None, None) => {
            let message = format!(
                "the period [s] can be computed for the Earth only, and environment.planet_radius is \
                 {planet_radius} m"
            );
            Err(section.missing("period", &["environment.planet_radius"], &message))
        }
    }
}

/// Period of a circular orbit around the Earth [s]: 2 pi sqrt(a^3 / mu), with a = altitude + radius [m].
fn kepler_period(altitude: f64, planet_radius: f64) -> f64 {
    TAU * ((altitude + planet_radius).powi(3) / EARTH_GRAVITATIONAL_PARAMETER).sqrt()
}

#[cfg(test)]
mod tests {
    use super::kepler_period;

    /// docs/numerics.md 2: 224 km gives 5339 s (R = 6378.137 km) or 5330 s (6371 km). 6017 s gives 772 or 779 km.
    #[test]
    fn kepler_periods_are_those_of_the_paper_s_two_altitudes() {
        let rounded = |altitude, radius| kepler_period(altitude, radius).round();
        assert_eq!(rounded(224e3, 6378.137e3), 5339.0);
        assert_eq!(rounded(224e3, 6371e3), 5330.0);
        assert!((kepler_period(772e3, 6378.137e3) - 6017.0).abs() < 1.0);
        assert!((kepler_period(779e3, 6371e3) - 6017.0).abs() < 1.0);
        assert!((kepler_period(772e3, 6371e3) - 6017.0).abs() > 1.0, "the radius must matter");
    }
}
