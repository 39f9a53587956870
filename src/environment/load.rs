//! What a plate receives under the load of a step; the f64 twins of the functions of the same names in `glsl/`.

use glam::DVec3;

use super::albedo::{albedo_factor, albedo_table_lookup};
use super::view_factor::{ApparentRadius, plate_view_factor};
use super::{PlanetLoad, StepLoad};

/// Solar flux incident on a plate, mean of the step [W/m2]. `normal` is a unit vector in the body frame.
pub fn solar_flux(load: &StepLoad, normal: DVec3) -> f64 {
    load.sun.iter().map(|sample| sample.flux * normal.dot(sample.direction).max(0.0)).sum()
}

/// Planet infrared incident on a plate [W/m2]. `normal` is a unit vector in the body frame.
pub fn planet_ir_flux(load: &StepLoad, normal: DVec3) -> f64 {
    load.planet.as_ref().map_or(0.0, |planet| {
        let radius = ApparentRadius::new(planet.distance_ratio);
        planet.planet_ir * plate_view_factor(normal.dot(planet.nadir), radius)
    })
}

/// Albedo flux incident on a plate [W/m2], read from the step's table. `normal` is a unit vector in the body frame.
pub fn albedo_flux(load: &StepLoad, normal: DVec3) -> f64 {
    match (&load.planet, &load.albedo) {
        (Some(planet), Some(table)) => {
            planet.albedo_flux * albedo_table_lookup(table, planet_frame_direction(planet, normal))
        }
        _ => 0.0,
    }
}

/// Albedo flux incident on a plate [W/m2], by the exact integral: what `albedo_flux` is measured against.
pub fn exact_albedo_flux(load: &StepLoad, normal: DVec3) -> f64 {
    load.planet.as_ref().map_or(0.0, |planet| {
        let direction = planet_frame_direction(planet, normal);
        planet.albedo_flux * albedo_factor(direction, planet.distance_ratio, planet.sun_zenith)
    })
}

/// A body-frame vector in the planet frame: x to the Sun's side, z to nadir.
pub fn planet_frame_direction(planet: &PlanetLoad, vector: DVec3) -> DVec3 {
    DVec3::new(vector.dot(planet.sunward), vector.dot(planet.nadir.cross(planet.sunward)), vector.dot(planet.nadir))
}
