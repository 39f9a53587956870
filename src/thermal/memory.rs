//! How fast a surface forgets its past: what it radiates to all sides over what it stores.

use super::STEFAN_BOLTZMANN;
use super::balance::emissivity_sum;
use super::material::{Material, Response};

/// Sum of the emissivities of the faces, and of a blanket to what lies below it.
pub(crate) fn emissivity_to_all_sides(material: &Material) -> f64 {
    let below = match &material.response {
        Response::Radiative(plate) => plate.over.map_or(0.0, |over| over.effective_emittance),
        Response::Network => material.bulk.over.map_or(0.0, |over| over.effective_emittance),
        _ => 0.0,
    };
    emissivity_sum(material) + below
}

/// Heat capacity [J/(m2 K)]. 0 follows its load at once. `None` follows a function of time.
pub(crate) fn capacity(material: &Material) -> Option<f64> {
    match &material.response {
        Response::Instant | Response::Given => Some(0.0),
        Response::Radiative(plate) => Some(plate.capacity),
        Response::Network => Some(material.bulk.capacity_per_area().unwrap_or(0.0)),
        Response::Transition(_) => None,
    }
}

/// 1 over the time constant of radiation, over the third power of temperature [1/(s K3)]: 4 eps sigma / C. Infinite where a surface stores no heat.
pub(crate) fn cooling(material: &Material) -> f64 {
    match capacity(material) {
        Some(capacity) if capacity > 0.0 => 4.0 * emissivity_to_all_sides(material) * STEFAN_BOLTZMANN / capacity,
        _ => f64::INFINITY,
    }
}
