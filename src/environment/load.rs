//! Incident fluxes on a plate under the load of a step: the f64 twins of the functions of the same names in `glsl/`.

use glam::DVec3;

use super::albedo::{albedo_factor, albedo_table_lookup};
use super::view_factor::{ApparentRadius, plate_view_factor};
use super::{PlanetLoad, StepLoad};

/// Incident solar flux, averaged over the step [W/m2]. `normal` is a unit vector in the body frame.
pub fn solar_flux(load: &StepLoad, normal: DVec3) -> f64 {
    load.sun.iter().map(|sample| sample.flux * normal.dot(sample.direction).max(0.0)).sum()
}

/// Incident planet infrared [W/m2]. `normal` is a unit vector in the body frame.
pub fn planet_ir_flux(load: &StepLoad, normal: DVec3) -> f64 {
    load.planet.as_ref().map_or(0.0, |planet| {
        if planet.is_mean() {
            return planet.planet_ir;
        }
        let radius = ApparentRadius::new(planet.distance_ratio);
        planet.planet_ir * plate_view_factor(normal.dot(planet.nadir), radius)
    })
}

/// Incident albedo flux from the step's table [W/m2]. `normal` is a unit vector in the body frame.
pub fn albedo_flux(load: &StepLoad, normal: DVec3) -> f64 {
    match (&load.planet, &load.albedo) {
        (Some(planet), _) if planet.is_mean() => planet.albedo_flux,
        (Some(planet), Some(table)) => {
            planet.albedo_flux * albedo_table_lookup(table, planet_frame_direction(planet, normal))
        }
        _ => 0.0,
    }
}

/// Incident albedo flux by the exact integral [W/m2]. Tests compare `albedo_flux` with it.
pub fn exact_albedo_flux(load: &StepLoad, normal: DVec3) -> f64 {
    load.planet.as_ref().map_or(0.0, |planet| {
        let direction = planet_frame_direction(planet, normal);
        planet.albedo_flux * albedo_factor(direction, planet.distance_ratio, planet.sun_zenith)
    })
}

/// Transforms a body-frame vector into the planet frame (x to the Sun's side, z to nadir).
pub(crate) fn planet_frame_direction(planet: &PlanetLoad, vector: DVec3) -> DVec3 {
    DVec3::new(vector.dot(planet.sunward), vector.dot(planet.nadir.cross(planet.sunward)), vector.dot(planet.nadir))
}
