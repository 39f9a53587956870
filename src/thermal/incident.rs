//! What falls on a plate under the load of a tick.

use glam::DVec3;

use crate::environment::TickLoad;
use crate::environment::load::{albedo_flux, planet_ir_flux, solar_flux};
use crate::thermal::balance::Incident;

/// Fluxes on a plate, by the twins of the device's functions.
pub fn incident(load: &TickLoad, normal: DVec3) -> Incident {
    Incident {
        solar: solar_flux(load, normal),
        albedo: albedo_flux(load, normal),
        planet_ir: planet_ir_flux(load, normal),
    }
}

/// How the reference finds what falls on a plate.
pub type IncidentFunction = fn(&TickLoad, DVec3) -> Incident;
