//! The directions from which the planet's light reaches a plate. A flux tells how much light comes, a momentum also from where.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use glam::DVec3;

use super::PlanetLoad;
use super::quadrature::GaussLegendre;

/// Rings about nadir, and directions in each.
const RINGS: usize = 12;
const SPOKES: usize = 24;

static RULE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(RINGS));

/// Light of the planet's disc in a number of directions.
#[derive(Debug, Clone)]
pub(crate) struct PlanetLight {
    nadir: DVec3,
    /// Unit vectors to the disc, their solid angles, and the cosine of the Sun's zenith angle where they meet the planet, at least 0.
    directions: Vec<(DVec3, f64, f64)>,
}

/// A kind of light of the planet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PlanetGlow {
    /// Infrared, equal from everywhere.
    Infrared,
    /// Sunlight that a Lambertian surface reflects.
    Albedo,
}

impl PlanetLight {
    /// The disc of a planet as the craft sees it.
    pub(crate) fn new(planet: &PlanetLoad) -> Self {
        let PlanetLoad { nadir, sunward, distance_ratio, sun_zenith, .. } = *planet;
        let across = nadir.cross(sunward);
        let sun = -nadir * sun_zenith.cos() + sunward * sun_zenith.sin();
        let limb = (1.0 - distance_ratio.powi(-2)).max(0.0).sqrt();
        let ring = |(cosine, weight): (f64, f64)| {
            let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
            (0..SPOKES).map(move |spoke| {
                let (y, x) = (TAU * (spoke as f64 + 0.5) / SPOKES as f64).sin_cos();
                let direction = cosine * nadir + sine * (x * sunward + y * across);
                let way = distance_ratio * cosine - (1.0 - (distance_ratio * sine).powi(2)).max(0.0).sqrt();
                let ground = way * direction - distance_ratio * nadir;
                (direction, weight * TAU / SPOKES as f64, ground.dot(sun).max(0.0))
            })
        };
        Self { nadir, directions: RULE.on(limb, 1.0).flat_map(ring).collect() }
    }

    /// Mean direction of the light that reaches a plate, weighted by its flux: the flux times this vector over the speed of light is the momentum that comes in
    /// from there each second, per area [N/m2]. `normal` is a unit vector in the body frame.
    pub(crate) fn mean_direction(&self, normal: DVec3, glow: PlanetGlow) -> DVec3 {
        let (mut sum, mut whole) = (DVec3::ZERO, 0.0);
        for (direction, solid_angle, sunlit) in &self.directions {
            let brightness = if glow == PlanetGlow::Albedo { *sunlit } else { 1.0 };
            let flux = brightness * solid_angle * normal.dot(*direction).max(0.0);
            sum += flux * *direction;
            whole += flux;
        }
        // A plate that barely sees the limb lies between two directions.
        if whole > 0.0 { sum / whole } else { self.nadir }
    }
}

#[cfg(test)]
mod tests {
    use super::super::view_factor::{ApparentRadius, plate_view_factor};
    use super::*;

    fn planet(distance_ratio: f64, sun_zenith: f64) -> PlanetLoad {
        let (planet_ir, albedo_flux) = (237.0, 400.0);
        PlanetLoad { nadir: DVec3::Z, sunward: DVec3::X, distance_ratio, planet_ir, albedo_flux, sun_zenith }
    }

    /// The tensor of a cap of half-angle r: the integral of w w^T is pi diag(a, a, b) with b = 2 (1 - cos^3 r) / 3 and a = (1 - cos r) - b / 2. A plate that
    /// sees the whole cap takes the momentum (L / c) M n.
    #[test]
    fn a_plate_that_sees_the_whole_disc_takes_the_tensor_of_a_cap() {
        for ratio in [1.06, 1.5, 6.6] {
            let light = PlanetLight::new(&planet(ratio, 1.0));
            let limb = (1.0 - 1.0 / (ratio * ratio)).sqrt();
            let b = 2.0 / 3.0 * (1.0 - limb.powi(3));
            let a = (1.0 - limb) - 0.5 * b;
            let tilt = 0.9 * (limb.acos() - std::f64::consts::FRAC_PI_2).abs();
            let normal = DVec3::new(tilt.sin(), 0.0, tilt.cos());
            let flux = plate_view_factor(normal.z, ApparentRadius::new(ratio));
            let expected = DVec3::new(a * normal.x, 0.0, b * normal.z) / flux;
            let mean = light.mean_direction(normal, PlanetGlow::Infrared);
            assert!(mean.distance(expected) < 1e-9, "{ratio}: {mean} beside {expected}");
            assert!(mean.distance(DVec3::Z) > 1e-3, "the planet is no point");
        }
    }

    /// A plate whose own horizon cuts the disc, beside a sum over 4 million directions.
    #[test]
    fn a_plate_that_sees_a_part_is_within_half_a_percent() {
        let (ratio, zenith) = (1.06, 1.2);
        let light = PlanetLight::new(&planet(ratio, zenith));
        let limb = (1.0f64 - 1.0 / (ratio * ratio)).sqrt();
        let sun = DVec3::new(zenith.sin(), 0.0, -zenith.cos());
        for tilt in [0.6f64, 1.3, 1.6, 2.2] {
            let normal = DVec3::new(0.6 * tilt.sin(), 0.8 * tilt.sin(), tilt.cos());
            let mut sums = [(DVec3::ZERO, 0.0); 2];
            for ring in 0..2000 {
                let cosine = limb + (1.0 - limb) * (f64::from(ring) + 0.5) / 2000.0;
                let sine = (1.0 - cosine * cosine).sqrt();
                for spoke in 0..2000 {
                    let (y, x) = (TAU * (f64::from(spoke) + 0.5) / 2000.0).sin_cos();
                    let direction = DVec3::new(sine * x, sine * y, cosine);
                    let way = ratio * cosine - (1.0 - (ratio * sine).powi(2)).max(0.0).sqrt();
                    let sunlit = (way * direction - ratio * DVec3::Z).dot(sun).max(0.0);
                    for ((sum, whole), brightness) in sums.iter_mut().zip([1.0, sunlit]) {
                        let flux = brightness * normal.dot(direction).max(0.0);
                        *sum += flux * direction;
                        *whole += flux;
                    }
                }
            }
            for ((sum, whole), glow) in sums.into_iter().zip([PlanetGlow::Infrared, PlanetGlow::Albedo]) {
                let mean = light.mean_direction(normal, glow);
                assert!(mean.distance(sum / whole) < 5e-3, "{tilt} {glow:?}: {mean} beside {}", sum / whole);
            }
        }
    }
}
