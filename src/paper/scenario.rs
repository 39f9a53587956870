//! What the paper says of its orbit and of its faces under insulation, as far as no heat capacity or conduction is
//! needed to check it: insulation without a heat capacity is at the balance temperature of the moment.
//!
//! Hollow cube in a circular orbit of 6017 s in 360 steps, beta 0, 224 km; goldized MLI with absorptivity 0.19 and
//! emissivity 0.02 (REFERENCES.md 1). Orbit noon at step 340 places the start 20 degrees after noon.

use glam::DVec3;

use super::checks::{Check, Tolerance};
use crate::environment::load::{planet_ir_flux, solar_flux};
use crate::environment::orbit::kepler_period;
use crate::environment::sky::SkyError;
use crate::environment::tick::TickLoads;
use crate::scene::{Attitude, CircularOrbit, Environment};
use crate::thermal::balance::{Incident, absorbed_by_face, balance_temperature};
use crate::thermal::material::Optics;

const STEPS: u32 = 360;
const PERIOD: f64 = 6017.0;
/// Altitude that the paper states [m], and the one that its period means (NUMERICS.md 2).
const ALTITUDES: [f64; 2] = [224e3, 772e3];
/// Equatorial radius [m], that of the rows of NUMERICS.md 2.
const PLANET_RADIUS: f64 = 6_378_137.0;
const MLI: Optics = Optics { absorptivity: 0.19, emissivity: 0.02 };
const SPACE: f64 = 2.7;
const ZENITH: DVec3 = DVec3::NEG_Z;
/// A face that looks along the orbit normal; with beta 0 the Sun never reaches it.
const SIDE: DVec3 = DVec3::Y;

/// The rows of NUMERICS.md 2 that need no network.
///
/// # Errors
/// None that the paper's own values cause.
pub fn checks() -> Result<Vec<Check>, SkyError> {
    let mut checks = Vec::new();
    let mut state = |statement: &str, expected: f64, computed: f64, unit, reading| {
        let (statement, tolerance) = (format!("scenario: {statement}"), Tolerance::Reading(reading));
        checks.push(Check { statement, expected, computed, tolerance, unit });
    };
    let period = kepler_period(PLANET_RADIUS + ALTITUDES[0]);
    state("period of a circular orbit at the stated 224 km", PERIOD, period, "s", 1.0);

    let sun_only = Environment { planet_ir: None, eclipse: false, ..environment() };
    let zenith = temperatures(ALTITUDES[0], &sun_only, ZENITH)?;
    let (peak_step, peak) =
        zenith.iter().enumerate().fold((0, 0.0), |best, (step, &t)| if t > best.1 { (step, t) } else { best });
    let coldest = zenith.iter().copied().fold(f64::INFINITY, f64::min);
    state("MLI, zenith face: highest temperature", 700.0, peak, "K", 10.0);
    state("MLI, zenith face: lowest temperature", 0.0, coldest, "K", 10.0);
    state("MLI, zenith face: step of the highest temperature", 340.0, peak_step as f64, "steps", 1.0);

    let night = |t: &f64| *t < SPACE + 1.0;
    let begins = zenith.iter().position(night).unwrap_or(0);
    let ends = zenith.iter().skip(begins).position(|t| !night(t)).map_or(zenith.len(), |steps| begins + steps);
    state("eclipse begins, taken as the zenith face's own night", 75.0, begins as f64, "steps", 5.0);
    state("eclipse ends, taken as the zenith face's own night", 250.0, ends as f64, "steps", 5.0);
    for altitude in ALTITUDES {
        let place = format!("taken as the planet's shadow at {} km", altitude / 1e3);
        let [begins, ends] = shadow(altitude)?;
        state(&format!("eclipse begins, {place}"), 75.0, begins, "steps", 5.0);
        state(&format!("eclipse ends, {place}"), 250.0, ends, "steps", 5.0);
    }
    for altitude in ALTITUDES {
        let side = temperatures(altitude, &environment(), SIDE)?;
        // Half an orbit after noon, where no ground in view is lit: all loads are then the planet's infrared.
        let statement = format!("MLI, +Y face, all loads: temperature in eclipse at {} km", altitude / 1e3);
        state(&statement, 180.0, side[160], "K", 10.0);
    }
    Ok(checks)
}

fn orbit(altitude: f64) -> CircularOrbit {
    CircularOrbit { altitude, period: PERIOD, beta: 0.0, phase: 20f64.to_radians() }
}

fn environment() -> Environment {
    Environment {
        solar_constant: Some(1361.0),
        albedo: None,
        planet_ir: Some(237.0),
        planet_radius: PLANET_RADIUS,
        eclipse: true,
        background_temperature: Some(SPACE),
    }
}

fn loads(altitude: f64, environment: &Environment) -> Result<TickLoads, SkyError> {
    let attitude = Attitude::Nadir { nadir_axis: DVec3::Z, forward_axis: DVec3::X };
    TickLoads::new(&orbit(altitude), &attitude, environment)
}

/// Balance temperature [K] of an insulated face at every step of an orbit.
fn temperatures(altitude: f64, environment: &Environment, normal: DVec3) -> Result<Vec<f64>, SkyError> {
    let loads = loads(altitude, environment)?;
    let temperature = |step: u32| {
        let time = f64::from(step) * PERIOD / f64::from(STEPS);
        let load = loads.tick_load(time, time);
        let (solar, planet_ir) = (solar_flux(&load, normal), planet_ir_flux(&load, normal));
        let incident = Incident { solar, planet_ir, ..Incident::default() };
        balance_temperature(absorbed_by_face(MLI, incident), MLI.emissivity, SPACE)
    };
    Ok((0..STEPS).map(temperature).collect())
}

/// Steps at which half of the Sun is hidden by the planet and seen again.
fn shadow(altitude: f64) -> Result<[f64; 2], SkyError> {
    let loads = loads(altitude, &environment())?;
    let steps: Vec<f64> =
        loads.sky_model().contacts(0.0, PERIOD).iter().map(|time| time / PERIOD * f64::from(STEPS)).collect();
    Ok(match steps[..] {
        [penumbra, umbra, umbra_end, penumbra_end] => [0.5 * (penumbra + umbra), 0.5 * (umbra_end + penumbra_end)],
        _ => [f64::NAN; 2],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NUMERICS.md 2, column "computed", and whether it calls the paper's number reproduced.
    #[test]
    fn the_rows_are_those_of_numerics_2() {
        let expected = [
            (5339.0, 1.0, false),
            (691.0, 0.1, true),
            (2.7, 1e-3, true),
            (340.0, 0.1, true),
            (70.0, 1.1, true),
            (250.0, 1.1, true),
            (85.0, 0.6, false),
            (235.0, 0.6, false),
            (97.0, 0.6, false),
            (223.0, 0.6, false),
            (193.8, 0.1, false),
            (174.6, 0.1, true),
        ];
        let checks = checks().unwrap();
        assert_eq!(checks.len(), expected.len());
        for (check, (value, margin, agrees)) in checks.iter().zip(expected) {
            assert!((check.computed - value).abs() <= margin, "{check:?}");
            assert_eq!(check.agrees(), agrees, "{check:?}");
        }
        let mut moved = checks[1].clone();
        moved.computed -= 2.0;
        assert!(!moved.agrees());
    }
}
