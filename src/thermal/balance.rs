//! The balance temperature, at which a surface radiates as much as it absorbs.

use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::material::{Material, Optics, Sides};

/// Incident fluxes on one face [W/m2].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Incident {
    pub(crate) solar: f64,
    pub(crate) albedo: f64,
    pub(crate) planet_ir: f64,
}

/// Flux that one face absorbs [W/m2]: sunlight times its absorptivity, infrared times its emissivity (grey, Kirchhoff's law).
pub(crate) fn absorbed_by_face(optics: Optics, incident: Incident) -> f64 {
    optics.absorptivity * (incident.solar + incident.albedo) + optics.emissivity * incident.planet_ir
}

/// Flux that a surface absorbs per area of one face [W/m2]. `back` gives the incident flux on the face against the normal, and is called only where
/// that face exchanges heat.
pub fn absorbed_flux(material: &Material, front: Incident, back: impl FnOnce() -> Incident) -> f64 {
    let outside = absorbed_by_face(material.front, front);
    match material.sides {
        Sides::Outside => outside,
        Sides::Both { back: optics } => outside + absorbed_by_face(optics, back()),
    }
}

/// Sum of the emissivities of the faces that exchange heat.
pub fn emissivity_sum(material: &Material) -> f64 {
    match material.sides {
        Sides::Outside => material.front.emissivity,
        Sides::Both { back } => material.front.emissivity + back.emissivity,
    }
}

/// Temperature [K] at which eps sigma (T^4 - T_background^4) equals the absorbed flux [W/m2]. The background is a temperature [K]. With an `emissivity_sum`
/// of 0 there is no balance and the result is infinite.
pub(crate) fn balance_temperature(absorbed: f64, emissivity_sum: f64, background_temperature: f64) -> f64 {
    let background_squared = background_temperature * background_temperature;
    let fourth_power = absorbed / (emissivity_sum * STEFAN_BOLTZMANN) + background_squared * background_squared;
    fourth_power.sqrt().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::material::{Bulk, Response};

    fn material(absorptivity: f64, emissivity: f64, sides: Sides) -> Material {
        let front = Optics { absorptivity, emissivity };
        let (bulk, response) = (Bulk::default(), Response::Instant);
        Material {
            name: "test".into(),
            front,
            sides,
            gloss: Default::default(),
            in_band: Default::default(),
            bulk,
            response,
            transition: None,
            ranges: [None; 2],
            source: "test".into(),
        }
    }

    const NOON: Incident = Incident { solar: 1367.0, albedo: 0.0, planet_ir: 0.0 };

    #[test]
    fn mli_in_full_sun_is_692_k() {
        // Figure 3 of Vural et al. 2023 (docs/numerics.md 2): the zenith face's maximum, S 1367, alpha 0.19, eps 0.02.
        let mli = material(0.19, 0.02, Sides::Outside);
        let t = balance_temperature(absorbed_flux(&mli, NOON, Incident::default), emissivity_sum(&mli), 2.7);
        assert!((t - 691.8).abs() < 0.05, "docs/numerics.md 2 states 691.8 K: {t}");
        let dim = balance_temperature(0.19 * 1361.0, 0.02, 2.7);
        assert!((dim - 691.0).abs() < 0.05 && (dim - 691.8).abs() > 0.05, "and 691.0 K at 1361 W/m2: {dim}");
    }

    #[test]
    fn in_the_dark_it_is_the_background() {
        assert!((balance_temperature(0.0, 0.8, 2.7) - 2.7).abs() < 1e-15);
        assert_eq!(balance_temperature(0.0, 0.8, 0.0), 0.0);
    }

    #[test]
    fn a_sheet_takes_its_back_into_account() {
        let back = Optics { absorptivity: 0.4, emissivity: 0.7 };
        let sheet = material(0.9, 0.8, Sides::Both { back });
        let behind = Incident { solar: 0.0, albedo: 100.0, planet_ir: 200.0 };
        let absorbed = absorbed_flux(&sheet, NOON, || behind);
        assert!((absorbed - (0.9 * 1367.0 + 0.4 * 100.0 + 0.7 * 200.0)).abs() < 1e-9);
        assert!((emissivity_sum(&sheet) - 1.5).abs() < 1e-15);
        let t = balance_temperature(absorbed, emissivity_sum(&sheet), 0.0);
        assert!((1.5 * STEFAN_BOLTZMANN * t.powi(4) - absorbed).abs() < 1e-9);
        let skin = balance_temperature(0.9 * 1367.0, 0.8, 0.0);
        assert!(skin - t > 40.0, "one face alone would run hotter: {skin} against {t}");
    }
}
