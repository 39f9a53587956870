//! `isotherm environment plate`: exact planet loads on one plate.

use glam::DVec3;
use serde_json::json;

use super::error::CliError;
use crate::environment::albedo::albedo_factor;
use crate::environment::orbit::LOWEST_ALTITUDE;
use crate::environment::view_factor::{ApparentRadius, plate_view_factor};
use crate::output::console::answer;
use crate::output::finite::finite;

/// Print the view factor of a plate to the planet, and the incident planet infrared and albedo.
///
/// The planet is a Lambert sphere of uniform temperature in parallel sunlight.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  isotherm environment plate --altitude 408e3 --nadir-angle 90 --sun-zenith 60 --json"
)]
pub(crate) struct Arguments {
    /// Height above the planet's surface [m]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    altitude: f64,
    /// Angle between the plate's normal and nadir [deg]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    nadir_angle: f64,
    /// Zenith angle of the Sun at the point below the craft [deg]
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    sun_zenith: f64,
    /// Direction in which the normal is tilted [deg]: 0 tilts it towards the Sun
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    azimuth: f64,
    /// Infrared that the planet emits [W/m2]
    #[arg(long, value_name = "W", default_value_t = 237.0, allow_negative_numbers = true)]
    planet_ir: f64,
    /// Share of sunlight that the planet reflects
    #[arg(long, value_name = "A", default_value_t = 0.3, allow_negative_numbers = true)]
    albedo: f64,
    /// Flux of sunlight [W/m2]
    #[arg(long, value_name = "W", default_value_t = 1361.0, allow_negative_numbers = true)]
    solar: f64,
    /// Radius of the planet [m]
    #[arg(long, value_name = "M", default_value_t = 6.371e6, allow_negative_numbers = true)]
    planet_radius: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Arguments {
    fn check(&self) -> Result<(), CliError> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let flux = |value: f64| (0.0..=1e9).contains(&value);
        let angle = |value: f64| (-1e9..=1e9).contains(&value);
        let rules = [
            ("altitude", self.altitude, positive(self.altitude) && self.altitude < 1e13, "above 0 m and below 1e13 m"),
            ("nadir-angle", self.nadir_angle, angle(self.nadir_angle), "from -1e9 to 1e9 deg"),
            ("sun-zenith", self.sun_zenith, angle(self.sun_zenith), "from -1e9 to 1e9 deg"),
            ("azimuth", self.azimuth, angle(self.azimuth), "from -1e9 to 1e9 deg"),
            ("planet-ir", self.planet_ir, flux(self.planet_ir), "from 0 to 1e9 W/m2"),
            ("albedo", self.albedo, (0.0..=1.0).contains(&self.albedo), "within 0 and 1"),
            ("solar", self.solar, flux(self.solar), "from 0 to 1e9 W/m2"),
            (
                "planet-radius",
                self.planet_radius,
                positive(self.planet_radius) && self.planet_radius <= 1e13,
                "above 0 m and at most 1e13 m",
            ),
        ];
        match rules.iter().find(|(_, _, allowed, _)| !allowed) {
            Some((name, value, _, rule)) => Err(CliError::Usage(format!("--{name} must be {rule}, found {value}"))),
            None if self.altitude < LOWEST_ALTITUDE * self.planet_radius => Err(CliError::Usage(format!(
                "--altitude {} m is less than a thousandth of the planet's radius ({} m); it is in metres",
                self.altitude, self.planet_radius
            ))),
            None => Ok(()),
        }
    }
}

/// Loads on a plate, as shares of a full flux.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PlateShares {
    view_factor: f64,
    albedo_factor: f64,
}

/// `tilt` is the angle between normal and nadir, `azimuth` the direction of the tilt from the Sun's side. All angles in
/// [rad].
fn received(distance_ratio: f64, tilt: f64, azimuth: f64, sun_zenith: f64) -> PlateShares {
    // The integrals need a zenith angle in [0, pi]. Beyond pi the Sun is on the other side.
    let (sin_sun, cos_sun) = sun_zenith.sin_cos();
    let azimuth = if sin_sun < 0.0 { azimuth + std::f64::consts::PI } else { azimuth };
    let (sin_tilt, cos_tilt) = tilt.sin_cos();
    let normal = DVec3::new(sin_tilt * azimuth.cos(), sin_tilt * azimuth.sin(), cos_tilt);
    PlateShares {
        view_factor: plate_view_factor(cos_tilt, ApparentRadius::new(distance_ratio)),
        albedo_factor: albedo_factor(normal, distance_ratio, sin_sun.abs().atan2(cos_sun)),
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    arguments.check()?;
    let PlateShares { view_factor, albedo_factor } = received(
        1.0 + arguments.altitude / arguments.planet_radius,
        arguments.nadir_angle.to_radians(),
        arguments.azimuth.to_radians(),
        arguments.sun_zenith.to_radians(),
    );
    let planet_ir = arguments.planet_ir * view_factor;
    let albedo = arguments.solar * arguments.albedo * albedo_factor;
    for value in [view_factor, planet_ir, albedo, albedo_factor] {
        finite(value, || "a load on the plate".to_owned())?;
    }
    if arguments.json {
        let value = json!({
            "view_factor": view_factor,
            "planet_ir_w_m2": planet_ir,
            "albedo_w_m2": albedo,
            "albedo_factor": albedo_factor,
        });
        answer!("{value:#}");
    } else {
        answer!("view factor      {view_factor:.6}");
        answer!("planet infrared  {planet_ir:.4} W/m2 incident");
        answer!("albedo           {albedo:.4} W/m2 incident");
        answer!("albedo factor    {albedo_factor:.6} of albedo x solar");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    use super::*;

    #[test]
    fn angles_beyond_half_a_turn_mean_the_same_directions() {
        let close = |a: PlateShares, b: PlateShares| {
            (a.view_factor - b.view_factor).abs() < 1e-12 && (a.albedo_factor - b.albedo_factor).abs() < 1e-12
        };
        let base = received(1.064, 1.2, 0.4, 1.3);
        assert!(close(base, received(1.064, -1.2, 0.4 + PI, 1.3)));
        assert!(close(base, received(1.064, 1.2, 0.4 + PI, -1.3)));
        assert!(close(base, received(1.064, 1.2 + TAU, 0.4 - TAU, 1.3 + TAU)));
        assert!(close(base, received(1.064, 1.2, -0.4, 1.3)), "the two sides of the Sun's plane are alike");
        assert!(!close(base, received(1.064, 1.2, 0.4 + PI, 1.3)));
    }

    #[test]
    fn azimuth_0_tilts_to_the_sun() {
        let towards = received(1.064, FRAC_PI_2, 0.0, 1.2).albedo_factor;
        let away = received(1.064, FRAC_PI_2, PI, 1.2).albedo_factor;
        assert!(towards > 1.2 * away && away > 0.0, "{towards} {away}");
    }
}
