//! What surrounds the craft in an image, and how its materials reflect it.

use glam::DAffine3;

use super::prepare::Prepared;
use crate::environment::orbit::{SUN_DISTANCE, SUN_RADIUS};
use crate::environment::view_factor::ApparentRadius;
use crate::gpu::layout;
use crate::gpu::radiance_variant::RadianceVariant;
use crate::gpu::resources::Shown;
use crate::scene::{Background, Reflections, Surrounded};
use crate::thermal::lobe::{LOBE_VALUES, Lobe};
use crate::thermal::radiance::{RadianceTable, band_radiance};
use crate::thermal::surroundings::{Reflector, SUN_TEMPERATURE, Surroundings};

/// Whether any pixel shows the surroundings.
fn is_seen(settings: &Surrounded) -> bool {
    settings.reflections != Reflections::Off || settings.background != Background::Off
}

/// The surroundings at a time [s] in the axes of a camera. `None` where no pixel shows them.
pub fn surroundings_at(prepared: &Prepared, time: f64, pose: &DAffine3) -> Option<Surroundings> {
    let (scene, environment) = (&prepared.scene, &prepared.scene.environment);
    let settings = &scene.surrounded;
    if !is_seen(settings) {
        return None;
    }
    let sky = prepared.loads.sky_model().sky(time);
    let table = RadianceTable::new(scene.band);
    let radiance = |temperature| band_radiance(&table, temperature);
    let space = environment.background_temperature.unwrap_or(0.0);
    let planet = if settings.background == Background::Space && settings.reflections == Reflections::Off {
        space
    } else {
        settings.planet_temperature
    };
    Some(Surroundings {
        nadir: pose.matrix3 * sky.nadir_direction,
        planet: ApparentRadius::new(sky.distance_ratio),
        sun: pose.matrix3 * sky.sun_direction,
        sun_disc: ApparentRadius::new(SUN_DISTANCE / sky.solar_scale.sqrt() / SUN_RADIUS),
        planet_radiance: radiance(planet),
        space_radiance: radiance(space),
        sun_radiance: environment.solar_constant.map_or(0.0, |_| radiance(SUN_TEMPERATURE)),
        lit_fraction: sky.lit_fraction,
    })
}

/// How the materials of a scene reflect, and what its pixels show.
pub struct Finishes {
    /// Front and back of each material.
    pub reflectors: Vec<[Reflector; 2]>,
    /// The lobes of the rough ones.
    pub lobes: Lobes,
    variant: RadianceVariant,
    rounded: Vec<layout::Reflector>,
}

impl Finishes {
    /// The finishes of a scene. Without reflections there is nothing in them.
    pub fn new(prepared: &Prepared) -> Self {
        let settings = &prepared.scene.surrounded;
        let mut roughnesses: Vec<f64> = Vec::new();
        let mut reflectors = Vec::new();
        if settings.reflections != Reflections::Off {
            for material in &prepared.materials {
                let optics = [material.front, material.back()];
                reflectors.push([0, 1].map(|face| {
                    let gloss = material.gloss[face];
                    let lobe = (gloss.specular > 0.0 && gloss.alpha() > 0.0).then(|| {
                        roughnesses.iter().position(|known| *known == gloss.alpha()).unwrap_or_else(|| {
                            roughnesses.push(gloss.alpha());
                            roughnesses.len() - 1
                        })
                    });
                    Reflector { emissivity: optics[face].emissivity, specular: gloss.specular, lobe }
                }));
            }
        }
        let variant = RadianceVariant {
            reflections: settings.reflections != Reflections::Off,
            specular: reflectors.as_flattened().iter().any(|face| face.specular > 0.0),
            rough: !roughnesses.is_empty(),
            sun: is_seen(settings) && prepared.scene.environment.solar_constant.is_some(),
            apart: settings.channels,
            background: settings.background != Background::Off,
        };
        let rounded = |face: &Reflector| layout::Reflector {
            emissivity: face.emissivity as f32,
            specular: face.specular as f32,
            roughness: face.lobe.map_or(0.0, |lobe| roughnesses[lobe] as f32),
            lobe: face.lobe.map_or(0.0, |lobe| (lobe * LOBE_VALUES) as f32),
        };
        let rounded = reflectors.as_flattened().iter().map(rounded).collect();
        Self { reflectors, lobes: Lobes::new(roughnesses), variant, rounded }
    }

    /// What the device needs of them.
    pub fn shown(&self) -> Shown<'_> {
        let lobe_values = self.lobes.roughnesses.len() * LOBE_VALUES;
        Shown { variant: self.variant, reflectors: &self.rounded, lobe_values }
    }

    /// Whether the sky is drawn behind the craft.
    pub fn has_background(&self) -> bool {
        self.variant.background
    }

    /// Whether the frames show the reflected radiance apart.
    pub fn is_apart(&self) -> bool {
        self.variant.apart
    }
}

/// Step of the logarithm of the planet's apparent radius between two tables of lobes. The tables count the angle from the limb, so a rounded radius
/// changes the curvature of the limb alone.
const RADIUS_STEP: f64 = 2e-3;

/// Lobes of rough mirrors before the planet. They are made anew where its apparent radius changes.
pub struct Lobes {
    roughnesses: Vec<f64>,
    /// Number of the rounded radius of the planet that the lobes belong to.
    radius: Option<i64>,
    lobes: Vec<Lobe>,
    values: Vec<f32>,
}

impl Lobes {
    fn new(roughnesses: Vec<f64>) -> Self {
        Self { roughnesses, radius: None, lobes: Vec::new(), values: Vec::new() }
    }

    /// The lobes before a planet.
    pub fn before(&mut self, planet: ApparentRadius) -> &[Lobe] {
        let rounded = (planet.sin.atan2(planet.cos).ln() / RADIUS_STEP).round();
        if self.radius != Some(rounded as i64) && !self.roughnesses.is_empty() {
            let radius = (rounded * RADIUS_STEP).exp().min(std::f64::consts::FRAC_PI_2);
            let (sin, cos) = radius.sin_cos();
            let lobe = |roughness: &f64| Lobe::new(*roughness, ApparentRadius { sin, cos });
            self.lobes = self.roughnesses.iter().map(lobe).collect();
            self.values = self.lobes.iter().flat_map(|lobe| lobe.values.iter().map(|value| *value as f32)).collect();
            self.radius = Some(rounded as i64);
        }
        &self.lobes
    }

    /// The lobes before the last planet.
    pub fn latest(&self) -> &[Lobe] {
        &self.lobes
    }

    /// The same, rounded to f32 for the device.
    pub fn values_before(&mut self, planet: ApparentRadius) -> &[f32] {
        self.before(planet);
        &self.values
    }
}
