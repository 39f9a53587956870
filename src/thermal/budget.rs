//! The budget of a surface: what the surface gains by each cause.

use super::balance::{Incident, emissivity_sum};
use super::material::{Material, Sides};
use super::network::radiated;
use super::received::FaceLoad;

/// Causes of a budget.
pub const CAUSES: usize = 8;

/// Channels of the causes, in their order.
pub const CHANNELS: [&str; CAUSES] =
    ["Q_sun", "Q_albedo", "Q_planet", "Q_exchange", "Q_conduction", "Q_heater", "Q_stored", "Q_emitted"];

/// Places of some causes in a budget.
pub(crate) const SUN: usize = 0;
pub(crate) const STORED: usize = 6;
pub(crate) const EMITTED: usize = 7;

/// Gains of a surface [W/m2], over the area of one of its faces, in the order of [`CHANNELS`]. Their sum is 0.
pub(crate) type Budget = [f64; CAUSES];

/// Gains of a surface by all causes but storage [W/m2].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct SurfaceGains {
    pub(crate) sun: f64,
    pub(crate) albedo: f64,
    pub(crate) planet: f64,
    pub(crate) exchange: f64,
    pub(crate) conduction: f64,
    pub(crate) heater: f64,
    pub(crate) emitted: f64,
}

impl SurfaceGains {
    /// Light that a material absorbs, from the light on its front and back, and on the faces from the craft.
    pub(crate) fn absorbed(material: &Material, on_faces: [Incident; 2], received: [FaceLoad; 2]) -> Self {
        let back = match material.sides {
            Sides::Outside => None,
            Sides::Both { back } => Some(back),
        };
        let mut gains = Self { exchange: received[0].absorbed + received[1].absorbed, ..Self::default() };
        for (optics, incident) in [Some(material.front), back].into_iter().flatten().zip(on_faces) {
            gains.sun += optics.absorptivity * incident.solar;
            gains.albedo += optics.absorptivity * incident.albedo;
            gains.planet += optics.emissivity * incident.planet_ir;
        }
        gains
    }

    /// The same with the emission to space at a temperature [K]. The background is a temperature [K].
    pub(crate) fn at(self, material: &Material, temperature: f64, background: f64) -> Self {
        Self { emitted: emissivity_sum(material) * radiated(background, temperature), ..self }
    }

    /// Sum of all gains [W/m2].
    pub(crate) fn sum(&self) -> f64 {
        let Self { sun, albedo, planet, exchange, conduction, heater, emitted } = self;
        sun + albedo + planet + exchange + conduction + heater + emitted
    }

    /// The budget. What the surface gains and does not emit is stored, so storage is the loss that closes the budget.
    pub(crate) fn closed(&self) -> Budget {
        let Self { sun, albedo, planet, exchange, conduction, heater, emitted } = *self;
        [sun, albedo, planet, exchange, conduction, heater, 0.0 - self.sum(), emitted]
    }
}
