//! Surroundings of a craft in the band: planet, deep space and Sun. Images show them as background, and surfaces reflect them (docs/numerics.md 5a).
//!
//! Each is uniform over its disc, except for a planet with a map. A surface sees the part of it above its own horizon, and nothing of the craft itself. A uniform
//! surrounding of one temperature therefore gives each surface of that temperature the radiance of a blackbody.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::emissivity_table::EmissivityTable;
use super::lobe::{Lobe, PlanetPlace};
use super::planet_map::{SeenPlanet, seen_point};
use crate::environment::view_factor::{ApparentRadius, plate_view_factor};

/// Temperature of the blackbody with the Sun's radiance [K] (IAU 2015 resolution B3, nominal effective temperature).
pub(crate) const SUN_TEMPERATURE: f64 = 5772.0;

/// The surroundings at one instant. Directions are unit vectors in the axes of the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surroundings {
    /// Direction to the planet's centre.
    pub(crate) nadir: DVec3,
    pub(crate) planet: ApparentRadius,
    pub(crate) sun: DVec3,
    pub(crate) sun_disc: ApparentRadius,
    /// Radiance of the planet [W m-2 sr-1].
    pub(crate) planet_radiance: f64,
    /// Radiance of deep space [W m-2 sr-1].
    pub(crate) space_radiance: f64,
    /// Radiance of the Sun's disc [W m-2 sr-1]. 0 without a Sun.
    pub(crate) sun_radiance: f64,
    /// Share of the Sun's disc that the planet leaves visible.
    pub(crate) lit_fraction: f64,
    /// Rotates camera axes into the axes of the planet's map. `None` for a uniform planet.
    pub(crate) map_from_camera: Option<DMat3>,
}

/// How a face emits and reflects in the band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BandReflector {
    /// Emissivity. The rest is reflected. A table stands in its place.
    pub(crate) emissivity: f64,
    /// Share of the reflected light that leaves about the mirror direction. The rest is diffuse.
    pub(crate) specular: f64,
    /// Index of the lobe of the mirror. `None` for a smooth one.
    pub(crate) lobe: Option<usize>,
    /// Index of its emissivity over angle and temperature. `None` where no face of the scene has one.
    pub(crate) table: Option<usize>,
    /// With a table: its factor at the temperature of planet, space and Sun, whose light it reflects.
    pub(crate) of_sources: [f64; 3],
}

/// Tables of a scene's images, which reflectors refer to.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Looks<'a> {
    /// Lobes of rough mirrors before the planet.
    pub(crate) lobes: &'a [Lobe],
    /// Emissivities over angle and temperature.
    pub(crate) tables: &'a [EmissivityTable],
    pub(crate) planet: Option<&'a SeenPlanet>,
}

/// Emissivity of a face at a temperature [K] and a cosine of the angle from its normal.
pub(crate) fn emissivity(reflector: &BandReflector, looks: &Looks, temperature: f64, cosine: f64) -> f64 {
    match reflector.table.and_then(|table| looks.tables.get(table)) {
        Some(table) => table.emissivity(temperature, cosine),
        None => reflector.emissivity,
    }
}

/// Share of the light of a blackbody at a temperature [K] that a face reflects, at a cosine of the angle from its normal.
pub(crate) fn kept_share(reflector: &BandReflector, looks: &Looks, temperature: f64, cosine: f64) -> f64 {
    1.0 - emissivity(reflector, looks, temperature, cosine)
}

/// The surroundings, with each light times the reflectivity of a face: 1 minus its emissivity at the same angle and wavelengths (Kirchhoff's law).
pub(crate) fn dimmed(around: &Surroundings, reflector: &BandReflector, looks: &Looks, cosine: f64) -> Surroundings {
    let [planet, space, sun] = match reflector.table.and_then(|table| looks.tables.get(table)) {
        Some(table) => reflector.of_sources.map(|factor| 1.0 - factor * table.angle_factor(cosine)),
        None => [1.0 - reflector.emissivity; 3],
    };
    Surroundings {
        planet_radiance: planet * around.planet_radiance,
        space_radiance: space * around.space_radiance,
        sun_radiance: sun * around.sun_radiance,
        ..*around
    }
}

/// Sine of the apparent radius minus the angle between two unit vectors, negative outside the disc.
pub(crate) fn within(direction: DVec3, centre: DVec3, disc: ApparentRadius) -> f64 {
    direction.dot(centre) * disc.sin - direction.cross(centre).length() * disc.cos
}

/// Radiance from a direction [W m-2 sr-1].
pub(crate) fn sky_radiance(around: &Surroundings, looks: &Looks, direction: DVec3) -> f64 {
    if within(direction, around.nadir, around.planet) >= 0.0 {
        let point = || seen_point(direction, around.nadir, around.planet);
        let relative = looks.planet.zip(around.map_from_camera).map(|(planet, axes)| planet.map.at(axes * point()));
        around.planet_radiance * relative.unwrap_or(1.0)
    } else if within(direction, around.sun, around.sun_disc) >= 0.0 && around.sun_radiance > 0.0 {
        around.sun_radiance
    } else {
        around.space_radiance
    }
}

/// Irradiance across the Sun's rays [W/m2].
pub(crate) fn sun_irradiance(around: &Surroundings) -> f64 {
    PI * around.sun_disc.sin * around.sun_disc.sin * around.sun_radiance * around.lit_fraction
}

/// Radiance that a face reflects to the camera [W m-2 sr-1]. `normal` is the visible face's normal and `to_camera` the direction to the camera, both
/// of length 1. The normal of a mesh may lean away from the camera at a silhouette. The face then counts as seen edge-on.
pub(crate) fn reflected_radiance(
    around: &Surroundings,
    reflector: &BandReflector,
    looks: &Looks,
    normal: DVec3,
    to_camera: DVec3,
) -> f64 {
    let view = normal.dot(to_camera).max(0.0);
    let sunlight = reflected_sunlight(around, reflector, looks, normal, to_camera);
    let around = &dimmed(around, reflector, looks, view);
    // Brightness of the planet above space, in the part of the disc that a kind of surface sees along a direction.
    let contrast = |kind: usize, direction: DVec3| {
        let mean =
            looks.planet.zip(around.map_from_camera).map(|(planet, axes)| planet.means[kind].at(axes * direction));
        around.planet_radiance * mean.unwrap_or(1.0) - around.space_radiance
    };
    let planet = plate_view_factor(normal.dot(around.nadir), around.planet);
    let diffuse = around.space_radiance + contrast(0, normal) * planet;
    let mirror = 2.0 * view * normal - to_camera;
    let specular = match reflector.lobe.and_then(|lobe| Some((lobe, looks.lobes.get(lobe)?))) {
        None => sky_radiance(around, looks, mirror),
        Some((kind, lobe)) => {
            let share = lobe.share(PlanetPlace::new(normal, view, mirror, around.nadir, around.planet));
            around.space_radiance + contrast(1 + kind, mirror) * share
        }
    };
    diffuse + reflector.specular * (specular - diffuse) + sunlight
}

/// The part of [`reflected_radiance`] that is sunlight [W m-2 sr-1], without the Sun's disc in a smooth mirror.
pub(crate) fn reflected_sunlight(
    around: &Surroundings,
    reflector: &BandReflector,
    looks: &Looks,
    normal: DVec3,
    to_camera: DVec3,
) -> f64 {
    let view = normal.dot(to_camera).max(0.0);
    let sun = sun_irradiance(&dimmed(around, reflector, looks, view));
    let lobe = reflector.lobe.and_then(|lobe| looks.lobes.get(lobe));
    let specular = lobe.map_or(0.0, |lobe| lobe.glint(normal, to_camera, (around.sun, around.sun_disc.sin)));
    let diffuse = normal.dot(around.sun).max(0.0) / PI;
    sun * (diffuse + reflector.specular * (specular - diffuse))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::emissivity::{BandEmissivity, ByAngle, ByWavelength};
    use crate::thermal::planck::{Band, band_radiance_exact};
    use crate::thermal::planet_map::Equirectangular;
    use std::sync::Arc;

    const BAND: Band = Band { lower: 8e-6, upper: 14e-6 };
    const PLAIN: BandReflector =
        BandReflector { emissivity: 0.0, specular: 0.0, lobe: None, table: None, of_sources: [0.0; 3] };

    /// Surroundings with these temperatures [K], without a Sun.
    fn around(planet: f64, space: f64, ratio: f64) -> Surroundings {
        Surroundings {
            nadir: DVec3::NEG_Z,
            planet: ApparentRadius::new(ratio),
            sun: DVec3::X,
            sun_disc: ApparentRadius::new(215.0),
            planet_radiance: band_radiance_exact(BAND, planet),
            space_radiance: band_radiance_exact(BAND, space),
            sun_radiance: 0.0,
            lit_fraction: 1.0,
            map_from_camera: None,
        }
    }

    fn directions() -> impl Iterator<Item = (DVec3, DVec3)> {
        (0..400).map(|number| {
            let direction = |salt: f64| {
                let (z, azimuth) = ((f64::from(number) * 0.618 + salt).fract() * 2.0 - 1.0, f64::from(number) * salt);
                DVec3::new((1.0 - z * z).sqrt() * azimuth.cos(), (1.0 - z * z).sqrt() * azimuth.sin(), z)
            };
            let (normal, view) = (direction(2.3), direction(5.1));
            (normal, if normal.dot(view) < 0.0 { -view } else { view })
        })
    }

    /// In an isothermal cavity everything looks black.
    #[test]
    fn everything_looks_black_in_an_isothermal_cavity() {
        let black = band_radiance_exact(BAND, 287.0);
        let around = around(287.0, 287.0, 1.064);
        let lobes = [0.05, 0.3, 1.0].map(|roughness| Lobe::new(roughness, around.planet));
        let looks = Looks { lobes: &lobes, ..Looks::default() };
        for (emissivity, specular) in [(0.02, 0.0), (0.5, 0.3), (0.02, 1.0), (0.0, 0.7), (1.0, 1.0)] {
            for lobe in [None, Some(0), Some(1), Some(2)] {
                let reflector = BandReflector { emissivity, specular, lobe, ..PLAIN };
                for (normal, view) in directions() {
                    let apparent = emissivity * black + reflected_radiance(&around, &reflector, &looks, normal, view);
                    assert!((apparent / black - 1.0).abs() < 1e-12, "{reflector:?}: {apparent} against {black}");
                }
            }
        }
        let warmer = super::tests::around(287.1, 287.0, 1.064);
        let foil = BandReflector { emissivity: 0.02, ..PLAIN };
        let apparent = 0.02 * black + reflected_radiance(&warmer, &foil, &looks, DVec3::NEG_Z, DVec3::NEG_Z);
        assert!((apparent / black - 1.0).abs() > 1e-4, "0.1 K of the planet must show");
    }

    /// The same with emissivities over angle and wavelength, and a planet with a map of one temperature.
    #[test]
    fn directional_and_spectral_faces_look_black_too() {
        let black = band_radiance_exact(BAND, 287.0);
        let around = Surroundings { map_from_camera: Some(DMat3::from_rotation_x(0.7)), ..around(287.0, 287.0, 1.064) };
        let points = vec![[8e-6, 0.2], [9e-6, 0.9], [11e-6, 0.4], [14e-6, 0.8]];
        let by_wavelength = Some(ByWavelength { points, temperature: None });
        let laws = [(None, by_wavelength.clone()), (Some(1.5), None), (Some(12.0), None), (Some(1.2), by_wavelength)];
        let tables = laws.map(|(n, by_wavelength)| {
            let by_angle = n.map(|n| ByAngle::Fresnel { n, k: n });
            EmissivityTable::new(&BandEmissivity { by_angle, by_wavelength }, 0.5, BAND)
        });
        let map = Arc::new(Equirectangular::new(4, 2, &[1.0; 8]));
        let planet = SeenPlanet::new(&map, DVec3::Z, around.planet, &[0.3]);
        let lobes = [Lobe::new(0.3, around.planet)];
        let looks = Looks { lobes: &lobes, tables: &tables, planet: Some(&planet) };
        for (index, table) in tables.iter().enumerate() {
            for (specular, lobe) in [(0.0, None), (0.6, None), (1.0, Some(0))] {
                let of_sources = [table.temperature_factor(287.0); 3];
                let reflector = BandReflector { specular, lobe, table: Some(index), of_sources, ..PLAIN };
                let mut least = 1.0_f64;
                for (normal, view) in directions() {
                    let own = emissivity(&reflector, &looks, 287.0, normal.dot(view));
                    least = least.min(own);
                    let apparent = own * black + reflected_radiance(&around, &reflector, &looks, normal, view);
                    assert!((apparent / black - 1.0).abs() < 1e-7, "law {index}: {apparent} against {black}");
                    let other = emissivity(&reflector, &looks, 287.0, 0.5 * normal.dot(view));
                    let wrong = other * black + reflected_radiance(&around, &reflector, &looks, normal, view);
                    let changes = (other - own).abs() > 1e-3;
                    assert!(!changes || (wrong / black - 1.0).abs() > 1e-4, "another angle must show");
                }
                assert!(least < 0.8, "law {index} reflects");
            }
        }
    }

    /// The foil of issue 16: emissivity 0.02 at 400 K before an Earth of 255 K that fills its sky.
    #[test]
    fn foil_before_the_earth_looks_as_cold_as_the_earth() {
        let around = around(255.0, 2.7, 1.0);
        let foil = BandReflector { emissivity: 0.02, specular: 1.0, ..PLAIN };
        let emitted = 0.02 * band_radiance_exact(BAND, 400.0);
        for reflector in [foil, BandReflector { specular: 0.0, ..foil }] {
            let reflected = reflected_radiance(&around, &reflector, &Looks::default(), DVec3::NEG_Z, DVec3::NEG_Z);
            assert!((emitted - 3.5).abs() < 0.05 && (reflected - 24.3).abs() < 0.05, "{emitted} + {reflected}");
            let (low, high) = (band_radiance_exact(BAND, 260.5), band_radiance_exact(BAND, 261.5));
            assert!((low..high).contains(&(emitted + reflected)), "{emitted} + {reflected}");
        }
        let away = reflected_radiance(&around, &foil, &Looks::default(), DVec3::Z, DVec3::Z);
        assert!(away < 1e-6, "before deep space it is dark: {away}");
    }

    #[test]
    fn the_limb_is_where_the_angle_is_the_radius() {
        for ratio in [1.0001, 1.064, 6.6, 1e3] {
            let planet = ApparentRadius::new(ratio);
            let radius = planet.sin.atan2(planet.cos);
            let around = Surroundings { planet, ..around(255.0, 2.7, ratio) };
            for (angle, seen) in [(radius - 1e-9, true), (radius + 1e-9, false), (0.0, true), (PI, false)] {
                let direction = DVec3::new(angle.sin(), 0.0, -angle.cos());
                assert_eq!(
                    sky_radiance(&around, &Looks::default(), direction) == around.planet_radiance,
                    seen,
                    "{ratio}, {angle}"
                );
            }
        }
    }

    #[test]
    fn a_rough_mirror_tends_to_a_smooth_one_and_the_sun_shines() {
        let mut around = around(255.0, 2.7, 1.064);
        around.sun_radiance = band_radiance_exact(BAND, SUN_TEMPERATURE);
        let lobes = [Lobe::new(1e-3, around.planet)];
        let looks = Looks { lobes: &lobes, ..Looks::default() };
        let smooth = BandReflector { emissivity: 0.1, specular: 1.0, ..PLAIN };
        let rough = BandReflector { lobe: Some(0), ..smooth };
        let view = DVec3::new(0.3, 0.0, -1.0).normalize();
        let one = |reflector| reflected_radiance(&around, reflector, &looks, DVec3::NEG_Z, view);
        assert!((one(&rough) / one(&smooth) - 1.0).abs() < 1e-3);
        let diffuse = BandReflector { specular: 0.0, ..smooth };
        let to_sun = reflected_radiance(&around, &diffuse, &looks, DVec3::X, DVec3::X);
        let dark = Surroundings { sun_radiance: 0.0, ..around };
        let sunlight = to_sun - reflected_radiance(&dark, &diffuse, &looks, DVec3::X, DVec3::X);
        // Irradiance of the Sun in the band over pi.
        let expected = 0.9 * around.sun_radiance * around.sun_disc.sin.powi(2);
        assert!((sunlight / expected - 1.0).abs() < 1e-9 && (0.3..0.6).contains(&sunlight), "{sunlight}");
    }
}
