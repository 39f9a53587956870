//! Incident fluxes on a plate under the load of a step.

use glam::DVec3;

use crate::environment::StepLoad;
use crate::environment::load::{albedo_flux, planet_ir_flux, solar_flux};
use crate::thermal::balance::Incident;

/// Incident fluxes on a plate, by the twins of the device's functions.
pub fn incident(load: &StepLoad, normal: DVec3) -> Incident {
    Incident {
        solar: solar_flux(load, normal),
        albedo: albedo_flux(load, normal),
        planet_ir: planet_ir_flux(load, normal),
    }
}

/// Function by which the reference finds the incident fluxes on a plate.
pub type IncidentFunction = fn(&StepLoad, DVec3) -> Incident;
