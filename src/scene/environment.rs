//! `[environment]`: Sun, planet and space background. A missing key switches its effect off.

use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use crate::environment::Environment;

/// Mean radius of the Earth [m] (docs/numerics.md 4).
const EARTH_RADIUS: f64 = 6371e3;

pub(super) fn read(section: &Section, assumptions: &mut Vec<String>) -> Result<Environment, SceneError> {
    // Every flux in this range has a balance temperature that an f32 can hold.
    let flux = Quantity::within(0.0, 1e9, "W/m2");
    let environment = Environment {
        solar_constant: section.number("solar_constant", flux)?,
        albedo: section.number("albedo", Quantity::within(0.0, 1.0, ""))?,
        planet_ir: section.number("planet_ir", flux)?,
        planet_radius: section.number("planet_radius", Quantity::positive("m"))?.unwrap_or_else(|| {
            assumptions.push("The planet's radius is 6371 km (environment.planet_radius is absent).".to_string());
            EARTH_RADIUS
        }),
        eclipse: section.boolean("eclipse")?.unwrap_or(true),
        background_temperature: section.number("background_temperature", Quantity::within(0.0, 1e6, "K"))?,
    };
    if environment.albedo.is_some() && environment.solar_constant.is_none() {
        return Err(section.clash(
            "albedo",
            &["solar_constant"],
            "needs environment.solar_constant, which is missing: what would be reflected?",
        ));
    }
    for (key, meaning) in [
        ("solar_constant", "There is no Sun"),
        ("albedo", "The planet reflects no sunlight"),
        ("planet_ir", "The planet emits no infrared"),
        ("background_temperature", "Space is at 0 K"),
    ] {
        if !section.has(key) {
            assumptions.push(format!("{meaning} (environment.{key} is absent)."));
        }
    }
    if environment.solar_constant.is_some() && !section.has("eclipse") {
        assumptions.push("The planet shadows the Sun (environment.eclipse is absent).".to_string());
    }
    Ok(environment)
}
