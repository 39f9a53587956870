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
use crate::thermal::planet_map::{MapAxes, PlanetPattern};

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

/// Wavelength below which sunlight is a part of what a camera sees [m].
pub(crate) const SUNNY: f64 = 6e-6;

/// Most reflections that are followed.
pub(crate) const MOST_BOUNCES: u32 = 128;

/// How far light between surfaces of the craft is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bounces {
    /// Until less than 1 % of it is left.
    #[default]
    UntilFaint,
    /// Over all reflections, until chance ends a path.
    All,
    /// Over so many reflections, 1 to 128.
    Most(u32),
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
    /// How far light between surfaces of the craft is followed.
    pub bounces: Bounces,
    /// The background behind the craft.
    pub background: Background,
    /// Brightness temperature of the planet in the band [K]. The temperature of space where the scene states none.
    pub planet_temperature: f64,
    /// Temperatures of a planet that is not uniform. `planet_temperature` is then their mean.
    pub planet: Option<Arc<PlanetPattern>>,
    /// Whether the scene does not say what stands behind the craft.
    pub is_unstated: bool,
    /// Share of the sunlight in the band that the day side of the planet reflects. 0 where no pixel shows it.
    pub planet_albedo: f64,
    /// Shares of sunlight that places of the planet reflect, in bands with sunlight.
    pub albedo_map: Option<Arc<PlanetPattern>>,
    /// Whether the frames show the emitted and the reflected radiance apart.
    pub channels: bool,
}

const REFLECTIONS: [(&str, Reflections); 3] =
    [("off", Reflections::Off), ("environment", Reflections::Environment), ("traced", Reflections::Traced)];
const BACKGROUNDS: [(&str, Background); 3] =
    [("off", Background::Off), ("space", Background::Space), ("planet", Background::Planet)];

/// Reads `[radiance]`. The first `[[band]]` comes before it. The default is the band of the preset, or 8 to 14 um.
pub(super) fn band(
    section: Option<&Section>,
    first: Option<Band>,
    preset: Option<&Preset>,
    assumptions: &mut Vec<String>,
) -> Result<Band, SceneError> {
    if let Some(first) = first {
        return Ok(first);
    }
    let stated = match section {
        Some(section) => {
            section.numbers::<2>("band_um", Quantity::within(0.2, 50.0, "um"))?.map(|band| (section, band))
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

/// Reads the share of sunlight that the planet reflects in the band. By default the band of a camera that sees sunlight has the albedo of the heat balance.
fn planet_albedo(
    section: &Section,
    environment: &Environment,
    (is_sunny, is_shown): (bool, bool),
    pattern: Option<&PlanetPattern>,
    assumptions: &mut Vec<String>,
) -> Result<f64, SceneError> {
    let key = "planet_albedo";
    let stated = section.number(key, Quantity::within(0.0, 1.0, ""))?;
    let turns = pattern.is_some_and(|pattern| !matches!(pattern.axes, MapAxes::Sun));
    if stated.is_some() && !(is_shown && environment.solar_constant.is_some()) {
        let message = "is that of a planet in sunlight: state environment.solar_constant, and radiance.reflections or radiance.background";
        return Err(section.clash(key, &["reflections", "background", "environment.solar_constant"], message));
    }
    if turns && stated.is_some_and(|albedo| albedo > 0.0) {
        return Err(section.clash(
            key,
            &["planet_map"],
            "does not go with planet_map: sunlight would turn with the map",
        ));
    }
    let default = if is_sunny && is_shown && stated.is_none() && !section.has("planet_albedo_map") {
        let albedo = environment.albedo.filter(|_| !turns).unwrap_or(0.0);
        assumptions.push(format!(
            "The day side of the planet reflects {albedo} of the sunlight in the band (radiance.planet_albedo is absent)."
        ));
        albedo
    } else {
        0.0
    };
    Ok(stated.unwrap_or(default))
}

/// Reads how far light between surfaces of the craft is followed.
fn bounces(section: &Section, reflections: Reflections) -> Result<Bounces, SceneError> {
    let key = "bounces";
    if section.has(key) && reflections != Reflections::Traced {
        let message = "counts reflections between surfaces of the craft, which need radiance.reflections = \"traced\"";
        return Err(section.clash(key, &["reflections"], message));
    }
    match section.string(key) {
        Ok(None) => Ok(Bounces::UntilFaint),
        Ok(Some("all")) => Ok(Bounces::All),
        Ok(Some(other)) => {
            let message = format!("must be \"all\" or a whole number from 1 to {MOST_BOUNCES}, found \"{other}\"");
            Err(section.error(key, message))
        }
        Err(_) => Ok(section.whole(key, 1..=MOST_BOUNCES)?.map_or(Bounces::UntilFaint, Bounces::Most)),
    }
}

/// Reads the rest of `[radiance]`. By default the craft reflects nothing, and the background has a radiance of 0.
pub(super) fn surrounded(
    section: Option<&Section>,
    (environment, orbit, band, has_shadows): (&Environment, &Orbit, Option<Band>, bool),
    (files, assumptions): (&mut Vec<PathBuf>, &mut Vec<String>),
) -> Result<Surrounded, SceneError> {
    let space = environment.background_temperature.unwrap_or(0.0);
    let of_exitance = environment.planet_ir.map(|flux| (flux / STEFAN_BOLTZMANN).sqrt().sqrt());
    // Without a band here, bands of their own tell their light.
    let is_sunny = environment.solar_constant.is_some() && band.is_some_and(|band| band.lower < SUNNY);
    let of_craft = |reflections: Reflections| match reflections {
        Reflections::Off => {
            Some("The craft reflects no sunlight in images, although the band has some (radiance.reflections is off).")
        }
        Reflections::Environment if !has_shadows => {
            Some("The craft shades nothing in images, although the band has sunlight (there is no section [shadows]).")
        }
        _ => None,
    };
    let tell = |reflections| of_craft(reflections).filter(|_| is_sunny).map(str::to_owned);
    let Some(section) = section else {
        assumptions.extend(tell(Reflections::Off));
        let planet_temperature = of_exitance.unwrap_or(space);
        return Ok(Surrounded { planet_temperature, is_unstated: true, ..Surrounded::default() });
    };
    let reflections = section.choice("reflections", &REFLECTIONS)?.unwrap_or_default();
    assumptions.extend(tell(reflections));
    let bounces = bounces(section, reflections)?;
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
    let sunny = (is_sunny, needs_planet);
    let planet_albedo = planet_albedo(section, environment, sunny, pattern.as_ref(), assumptions)?;
    let albedo_map = planet::read_albedos(section, orbit, files, assumptions)?;
    if albedo_map.is_some() && !(needs_planet && environment.solar_constant.is_some()) {
        let message = "is that of a planet in sunlight: state environment.solar_constant, and radiance.reflections or radiance.background";
        return Err(section.clash(
            "planet_albedo_map",
            &["reflections", "background", "environment.solar_constant"],
            message,
        ));
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
    Ok(Surrounded {
        reflections,
        bounces,
        background,
        planet_temperature,
        planet,
        is_unstated,
        planet_albedo,
        albedo_map: albedo_map.map(Arc::new),
        channels: false,
    })
}
