//! The light that a face receives from the rest of the craft, and the share of the planet's light that passes the
//! craft.

use crate::thermal::balance::Incident;

/// Shares of the planet's light that a face sees.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PlanetShares {
    /// Share of the planet's infrared.
    pub planet_ir: f64,
    /// Share of the planet's albedo.
    pub albedo: f64,
}

impl PlanetShares {
    /// A face from which nothing is hidden.
    pub(crate) const ALL: Self = Self { planet_ir: 1.0, albedo: 1.0 };
}

/// The light of the rest of the craft on a face, and the shares of other light that reach it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FaceLoad {
    /// Flux from other surfaces that the face absorbs [W/m2].
    pub absorbed: f64,
    /// Shares of the planet's light that it sees.
    pub planet_shares: PlanetShares,
    /// Share of the face outside other parts, which sunlight can reach.
    pub exposed: f64,
}

impl FaceLoad {
    /// A face that sees nothing of the craft.
    pub(crate) const NOTHING: Self = Self { absorbed: 0.0, planet_shares: PlanetShares::ALL, exposed: 1.0 };

    /// The part of an incident flux on an open face that the craft lets through.
    pub(crate) fn through(&self, open: Incident) -> Incident {
        let PlanetShares { planet_ir, albedo } = self.planet_shares;
        Incident {
            solar: self.exposed * open.solar,
            planet_ir: planet_ir * open.planet_ir,
            albedo: albedo * open.albedo,
        }
    }
}
