//! What surrounds a craft in the band: planet, deep space and Sun. The background of an image, and what surfaces reflect (docs/numerics.md 5a).
//!
//! All of it is uniform over its disc. A surface sees the part of it above its own horizon, and nothing of the craft itself. A uniform
//! surrounding of one temperature therefore gives each surface of that temperature the radiance of a blackbody.

use std::f64::consts::PI;

use glam::DVec3;

use super::lobe::{Lobe, Place};
use crate::environment::view_factor::{ApparentRadius, plate_view_factor};

/// Temperature of the blackbody with the Sun's radiance [K] (IAU 2015 resolution B3, nominal effective temperature).
pub const SUN_TEMPERATURE: f64 = 5772.0;

/// The surroundings at one instant. Directions are unit vectors in the axes of the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surroundings {
    /// Direction to the planet's centre.
    pub nadir: DVec3,
    /// Apparent radius of the planet.
    pub planet: ApparentRadius,
    /// Direction to the Sun's centre.
    pub sun: DVec3,
    /// Apparent radius of the Sun.
    pub sun_disc: ApparentRadius,
    /// Radiance of the planet [W m-2 sr-1].
    pub planet_radiance: f64,
    /// Radiance of deep space [W m-2 sr-1].
    pub space_radiance: f64,
    /// Radiance of the Sun's disc [W m-2 sr-1]. 0 without a Sun.
    pub sun_radiance: f64,
    /// Share of the Sun's disc that the planet leaves visible.
    pub lit_fraction: f64,
}

/// How a face emits and reflects in the band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflector {
    /// Emissivity. The rest is reflected.
    pub emissivity: f64,
    /// Share of the reflected light that leaves about the mirror direction. The rest is diffuse.
    pub specular: f64,
    /// Index of the lobe of the mirror. `None` for a smooth one.
    pub lobe: Option<usize>,
}

/// Sine of the apparent radius minus the angle between two unit vectors. It is negative outside the disc.
pub fn within(direction: DVec3, centre: DVec3, disc: ApparentRadius) -> f64 {
    direction.dot(centre) * disc.sin - direction.cross(centre).length() * disc.cos
}

/// Radiance from a direction [W m-2 sr-1].
pub fn sky_radiance(around: &Surroundings, direction: DVec3) -> f64 {
    if within(direction, around.nadir, around.planet) >= 0.0 {
        around.planet_radiance
    } else if within(direction, around.sun, around.sun_disc) >= 0.0 && around.sun_radiance > 0.0 {
        around.sun_radiance
    } else {
        around.space_radiance
    }
}

/// Irradiance across the Sun's rays [W/m2].
pub fn sun_irradiance(around: &Surroundings) -> f64 {
    PI * around.sun_disc.sin * around.sun_disc.sin * around.sun_radiance * around.lit_fraction
}

/// Radiance that a face reflects to the camera [W m-2 sr-1]. `normal` is that of the visible face and `to_camera` the direction to the camera, both of
/// length 1. The normal of a mesh may lean away from the camera at a silhouette. The face then counts as seen edge-on.
pub fn reflected_radiance(
    around: &Surroundings,
    reflector: &Reflector,
    lobes: &[Lobe],
    normal: DVec3,
    to_camera: DVec3,
) -> f64 {
    let contrast = around.planet_radiance - around.space_radiance;
    let sun = sun_irradiance(around);
    let light = normal.dot(around.sun);
    let planet = plate_view_factor(normal.dot(around.nadir), around.planet);
    let diffuse = around.space_radiance + contrast * planet + sun * light.max(0.0) / PI;
    let view = normal.dot(to_camera).max(0.0);
    let mirror = 2.0 * view * normal - to_camera;
    let specular = match reflector.lobe.and_then(|lobe| lobes.get(lobe)) {
        None => sky_radiance(around, mirror),
        Some(lobe) => {
            let share = lobe.share(Place::new(normal, view, mirror, around.nadir, around.planet));
            let half = normal.dot((to_camera + around.sun).normalize_or_zero());
            around.space_radiance + contrast * share + sun * lobe.glint(view, light, half)
        }
    };
    (1.0 - reflector.emissivity) * (diffuse + reflector.specular * (specular - diffuse))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::planck::{Band, band_radiance_exact};

    const BAND: Band = Band { lower: 8e-6, upper: 14e-6 };

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
        for (emissivity, specular) in [(0.02, 0.0), (0.5, 0.3), (0.02, 1.0), (0.0, 0.7), (1.0, 1.0)] {
            for lobe in [None, Some(0), Some(1), Some(2)] {
                let reflector = Reflector { emissivity, specular, lobe };
                for (normal, view) in directions() {
                    let apparent = emissivity * black + reflected_radiance(&around, &reflector, &lobes, normal, view);
                    assert!((apparent / black - 1.0).abs() < 1e-12, "{reflector:?}: {apparent} against {black}");
                }
            }
        }
        let warmer = super::tests::around(287.1, 287.0, 1.064);
        let foil = Reflector { emissivity: 0.02, specular: 0.0, lobe: None };
        let apparent = 0.02 * black + reflected_radiance(&warmer, &foil, &lobes, DVec3::NEG_Z, DVec3::NEG_Z);
        assert!((apparent / black - 1.0).abs() > 1e-4, "0.1 K of the planet must show");
    }

    /// The foil of issue 16: emissivity 0.02 at 400 K before an Earth of 255 K that fills its sky.
    #[test]
    fn foil_before_the_earth_looks_as_cold_as_the_earth() {
        let around = around(255.0, 2.7, 1.0);
        let foil = Reflector { emissivity: 0.02, specular: 1.0, lobe: None };
        let emitted = 0.02 * band_radiance_exact(BAND, 400.0);
        for reflector in [foil, Reflector { specular: 0.0, ..foil }] {
            let reflected = reflected_radiance(&around, &reflector, &[], DVec3::NEG_Z, DVec3::NEG_Z);
            assert!((emitted - 3.5).abs() < 0.05 && (reflected - 24.3).abs() < 0.05, "{emitted} + {reflected}");
            let (low, high) = (band_radiance_exact(BAND, 260.5), band_radiance_exact(BAND, 261.5));
            assert!((low..high).contains(&(emitted + reflected)), "{emitted} + {reflected}");
        }
        let away = reflected_radiance(&around, &foil, &[], DVec3::Z, DVec3::Z);
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
                assert_eq!(sky_radiance(&around, direction) == around.planet_radiance, seen, "{ratio}, {angle}");
            }
        }
    }

    #[test]
    fn a_rough_mirror_tends_to_a_smooth_one_and_the_sun_shines() {
        let mut around = around(255.0, 2.7, 1.064);
        around.sun_radiance = band_radiance_exact(BAND, SUN_TEMPERATURE);
        let lobes = [Lobe::new(1e-3, around.planet)];
        let smooth = Reflector { emissivity: 0.1, specular: 1.0, lobe: None };
        let rough = Reflector { lobe: Some(0), ..smooth };
        let view = DVec3::new(0.3, 0.0, -1.0).normalize();
        let one = |reflector| reflected_radiance(&around, reflector, &lobes, DVec3::NEG_Z, view);
        assert!((one(&rough) / one(&smooth) - 1.0).abs() < 1e-3);
        let diffuse = Reflector { specular: 0.0, ..smooth };
        let to_sun = reflected_radiance(&around, &diffuse, &lobes, DVec3::X, DVec3::X);
        let dark = Surroundings { sun_radiance: 0.0, ..around };
        let sunlight = to_sun - reflected_radiance(&dark, &diffuse, &lobes, DVec3::X, DVec3::X);
        // Irradiance of the Sun in the band over pi.
        let expected = 0.9 * around.sun_radiance * around.sun_disc.sin.powi(2);
        assert!((sunlight / expected - 1.0).abs() < 1e-9 && (0.3..0.6).contains(&sunlight), "{sunlight}");
    }
}
