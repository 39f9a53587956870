//! `[radiance]`: the band of the images, and the light that arrives at the camera besides the emission of surfaces.

use std::path::PathBuf;
use std::sync::Arc;

use super::error::SceneError;
use super::planet;
use super::preset::Preset;
use super::quantity::Quantity;
use super::section::Section;
use crate::environment::{Environment, Orbit};
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::planck::Band;
use crate::thermal::planet_map::PlanetPattern;

/// The objects that surfaces reflect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reflections {
    /// Nothing.
    #[default]
    Off,
    /// Planet, deep space and Sun, without the craft itself.
    Environment,
    /// Planet, deep space, Sun, and by rays the craft itself.
    Traced,
}

/// The background behind the craft.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Background {
    /// Nothing: a radiance of 0.
    #[default]
    Off,
    /// Deep space and the Sun.
    Space,
    /// The planet before deep space and the Sun.
    Planet,
}

/// Light that arrives at the camera besides the emission of surfaces.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surrounded {
    /// The objects that surfaces reflect.
    pub reflections: Reflections,
    /// The background behind the craft.
    pub background: Background,
    /// Brightness temperature of the planet in the band [K]. The temperature of space where the scene states none.
    pub planet_temperature: f64,
    /// Temperatures of a planet that is not uniform. `planet_temperature` is then their mean.
    pub planet: Option<Arc<PlanetPattern>>,
    /// Whether the scene does not say what stands behind the craft.
    pub is_unstated: bool,
    /// Whether the frames show the emitted and the reflected radiance apart.
    pub channels: bool,
}

const REFLECTIONS: [(&str, Reflections); 3] =
    [("off", Reflections::Off), ("environment", Reflections::Environment), ("traced", Reflections::Traced)];
const BACKGROUNDS: [(&str, Background); 3] =
    [("off", Background::Off), ("space", Background::Space), ("planet", Background::Planet)];

/// Reads `[radiance]`. The default is the band of the preset, or 8 to 14 um.
pub(super) fn band(
    section: Option<&Section>,
    preset: Option<&Preset>,
    assumptions: &mut Vec<String>,
) -> Result<Band, SceneError> {
    let stated = match section {
        Some(section) => {
            section.numbers::<2>("band_um", Quantity::within(1.0, 50.0, "um"))?.map(|band| (section, band))
        }
        None => None,
    };
    let [lower, upper] = match stated {
        Some((section, [lower, upper])) if lower >= upper => {
            return Err(section.error("band_um", format!("must run from low to high, found {lower} to {upper} um")));
        }
        Some((_, band)) => band,
        None if let Some(band) = preset.and_then(|preset| preset.band_um) => band,
        None => {
            assumptions.push("Radiance is that of 8 to 14 um (radiance.band_um is absent).".to_string());
            [8.0, 14.0]
        }
    };
    // f64 holds 1e6 exactly but not 1e-6, so a division rounds only once.
    Ok(Band { lower: lower / 1e6, upper: upper / 1e6 })
}

/// Reads the rest of `[radiance]`. By default the craft reflects nothing, and the background has a radiance of 0.
pub(super) fn surrounded(
    section: Option<&Section>,
    environment: &Environment,
    orbit: &Orbit,
    (files, assumptions): (&mut Vec<PathBuf>, &mut Vec<String>),
) -> Result<Surrounded, SceneError> {
    let space = environment.background_temperature.unwrap_or(0.0);
    let of_exitance = environment.planet_ir.map(|flux| (flux / STEFAN_BOLTZMANN).sqrt().sqrt());
    let Some(section) = section else {
        let planet_temperature = of_exitance.unwrap_or(space);
        return Ok(Surrounded { planet_temperature, is_unstated: true, ..Surrounded::default() });
    };
    let reflections = section.choice("reflections", &REFLECTIONS)?.unwrap_or_default();
    let stated_background = section.choice("background", &BACKGROUNDS)?;
    let background = stated_background.unwrap_or_default();
    let needs_planet = background == Background::Planet || reflections != Reflections::Off;
    let pattern = planet::read_pattern(section, orbit, files, assumptions)?;
    let stated = section.number("planet_temperature", Quantity::within(0.0, 1e6, "K"))?;
    let stated = stated.or(pattern.as_ref().map(|pattern| pattern.temperatures.mean()));
    if stated.is_some() && !needs_planet {
        let keys = ["planet_temperature", "planet_map", "planet_day_night"];
        let key = keys.into_iter().find(|key| section.has(key)).unwrap_or_default();
        let message = "is that of a planet which no pixel shows: state radiance.reflections or radiance.background";
        return Err(section.clash(key, &["reflections", "background"], message));
    }
    if needs_planet && stated.is_none() {
        assumptions.push(match of_exitance {
            Some(temperature) => format!(
                "The planet has a brightness temperature of {temperature:.2} K, that of environment.planet_ir \
                 (radiance.planet_temperature is absent)."
            ),
            None => "The planet is as cold as space in images (radiance.planet_temperature and environment.planet_ir \
                     are absent)."
                .to_owned(),
        });
    }
    let planet_temperature = stated.or(of_exitance).unwrap_or(space);
    let planet = pattern.map(Arc::new);
    let is_unstated = stated_background.is_none();
    Ok(Surrounded { reflections, background, planet_temperature, planet, is_unstated, channels: false })
}
