//! The disc of a body in the sky: directions that divide it, and the view factor from a plate to the planet, exact for every tilt.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// The planet's apparent radius as the sine and cosine of its angle. Both are computed once in a step in f64, because for a low orbit a cosine made
/// from an f32 sine loses its digits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ApparentRadius {
    /// Planet radius over distance.
    pub(crate) sin: f64,
    /// Distance to the horizon over distance to the centre.
    pub(crate) cos: f64,
}

impl ApparentRadius {
    /// The apparent radius at a distance to the planet's centre over its radius, >= 1.
    pub(crate) fn new(distance_ratio: f64) -> Self {
        let cos = ((distance_ratio - 1.0).max(0.0) * (distance_ratio + 1.0)).sqrt() / distance_ratio;
        Self { sin: 1.0 / distance_ratio, cos }
    }

    /// Directions that divide the disc around a direction into equal solid angles, on a spiral (Vogel 1979, Math. Biosci. 44).
    pub(crate) fn directions(self, centre: DVec3, count: usize) -> impl Iterator<Item = DVec3> {
        let across = centre.any_orthonormal_vector();
        let third = centre.cross(across);
        // 1 - cos of the radius keeps its digits for a small disc.
        let depth = self.sin * self.sin / (1.0 + self.cos);
        let turn = PI * (3.0 - 5.0_f64.sqrt());
        (0..count).map(move |number| {
            let below = depth * (number as f64 + 0.5) / count as f64;
            let (sin, cos) = (turn * number as f64).rem_euclid(TAU).sin_cos();
            let sine = (below * (2.0 - below)).sqrt();
            (1.0 - below) * centre + sine * (cos * across + sin * third)
        })
    }
}

/// View factor from a plate to a sphere.
///
/// `cos_tilt` is the cosine of the angle between the plate's normal and the direction to the sphere's centre. Let s and k be the sine and cosine of the
/// apparent radius, x = cos_tilt / s and w = sqrt(1 - x^2). For |x| <= 1 the plate's horizon cuts the disc:
///
/// F = (atan(s w / k) - s k w + s^2 cos_tilt atan2(w, -k x)) / pi
///
/// This is the exact solution (Juul 1979, J. Heat Transfer 101; Martinez, "Radiative view factors", tilted patch to a sphere). Arc tangents replace its arc
/// sine and arc cosine, which lose half their digits at both tangencies. For x > 1 the whole disc is seen and F = s^2 cos_tilt. For x < -1, F = 0.
pub(crate) fn plate_view_factor(cos_tilt: f64, radius: ApparentRadius) -> f64 {
    let ApparentRadius { sin: s, cos: k } = radius;
    if cos_tilt >= s {
        return s * s * cos_tilt;
    }
    if cos_tilt <= -s {
        return 0.0;
    }
    let x = cos_tilt / s;
    let w = ((1.0 - x) * (1.0 + x)).sqrt();
    let cap = (s * w).atan2(k);
    let arc = w.atan2(-k * x);
    ((cap - s * k * w + s * s * cos_tilt * arc) / PI).max(0.0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::super::quadrature::GaussLegendre;
    use super::*;

    fn factor(altitude: f64, radius: f64, tilt: f64) -> f64 {
        plate_view_factor(tilt.cos(), ApparentRadius::new(1.0 + altitude / radius))
    }

    /// The integral of the cosine over the visible part of the disc, in rings about nadir.
    fn by_quadrature(tilt: f64, distance_ratio: f64) -> f64 {
        let limb = (1.0 / distance_ratio).asin();
        let ring = |angle: f64| {
            let (a, b) = (tilt.cos() * angle.cos(), tilt.sin() * angle.sin());
            let half = if a >= b {
                PI
            } else if a <= -b {
                0.0
            } else {
                (-a / b).acos()
            };
            2.0 * (a * half + b * half.sin()) * angle.sin()
        };
        let kink = (FRAC_PI_2 - tilt).abs().min(limb);
        let rule = GaussLegendre::new(60);
        let inner = rule.on_smoothed(0.0, kink).map(|(angle, weight)| weight * ring(angle)).sum::<f64>();
        let outer = rule.on_smoothed(kink, limb).map(|(angle, weight)| weight * ring(angle)).sum::<f64>();
        (inner + outer) / PI
    }

    /// docs/numerics.md 4, with a planet radius of 6371 km.
    #[test]
    fn side_plate_values_of_numerics_4() {
        assert!((factor(224e3, 6.371e6, FRAC_PI_2) - 0.337_340).abs() < 1e-6, "{}", factor(224e3, 6.371e6, FRAC_PI_2));
        assert!((factor(772e3, 6.371e6, FRAC_PI_2) - 0.222_263).abs() < 1e-6, "{}", factor(772e3, 6.371e6, FRAC_PI_2));
        assert!((factor(224e3, 6.378_137e6, FRAC_PI_2) - 0.337_340).abs() > 1e-5);
    }

    #[test]
    fn every_tilt_agrees_with_quadrature() {
        for altitude in [1.0, 100e3, 408e3, 772e3, 2e7, 3.5786e7, 1e9] {
            let ratio = 1.0 + altitude / 6.371e6;
            for step in 0..=180 {
                let tilt = PI * f64::from(step) / 180.0;
                let computed = plate_view_factor(tilt.cos(), ApparentRadius::new(ratio));
                let expected = by_quadrature(tilt, ratio);
                assert!((computed - expected).abs() < 1e-9, "{altitude} m, {step} deg: {computed} against {expected}");
            }
        }
        assert!((factor(408e3, 6.371e6, 1.0) - by_quadrature(1.0, 1.1)).abs() > 1e-3);
    }

    #[test]
    fn limits_and_tangencies() {
        let radius = ApparentRadius::new(1.064);
        assert!((plate_view_factor(1.0, radius) - 1.064_f64.powi(-2)).abs() < 1e-15);
        assert_eq!(plate_view_factor(-1.0, radius), 0.0);
        let on_the_ground = ApparentRadius::new(1.0);
        for cos_tilt in [-0.9, -0.1, 0.0, 0.4, 1.0] {
            assert!((plate_view_factor(cos_tilt, on_the_ground) - 0.5 * (1.0 + cos_tilt)).abs() < 1e-15);
        }
        for tangency in [radius.sin, -radius.sin] {
            let (below, above) = (tangency - 1e-9, tangency + 1e-9);
            let step = plate_view_factor(above, radius) - plate_view_factor(below, radius);
            assert!((0.0..3e-9).contains(&step), "{step:e}");
        }
    }

    /// The arc tangent of Moshier's Cephes `atanf`: two reductions and a polynomial of degree 9.
    fn atan_f32(x: f32) -> f32 {
        let (offset, x) = if x > 2.414_213_6 {
            (std::f32::consts::FRAC_PI_2, -1.0 / x)
        } else if x > 0.414_213_57 {
            (std::f32::consts::FRAC_PI_4, (x - 1.0) / (x + 1.0))
        } else {
            (0.0, x)
        };
        let z = x * x;
        let series = ((8.053_744_6e-2 * z - 1.387_768_6e-1) * z + 1.997_771_1e-1) * z - 3.333_295e-1;
        offset + (series * z * x + x)
    }

    /// `plate_view_factor` in f32, with an arc tangent made of + - * / alone.
    fn plate_view_factor_f32(cos_tilt: f32, s: f32, k: f32) -> f32 {
        if cos_tilt >= s {
            return s * s * cos_tilt;
        }
        if cos_tilt <= -s {
            return 0.0;
        }
        let x = cos_tilt / s;
        let w = ((1.0 - x) * (1.0 + x)).sqrt();
        let cap = atan_f32(s * w / k);
        let arc = if x < 0.0 { atan_f32(w / (-k * x)) } else { std::f32::consts::PI - atan_f32(w / (k * x)) };
        ((cap - s * k * w + s * s * cos_tilt * arc) * std::f32::consts::FRAC_1_PI).max(0.0)
    }

    #[test]
    fn the_form_keeps_its_digits_in_f32() {
        let mut worst = 0.0_f64;
        for altitude in [100e3, 224e3, 408e3, 772e3, 2e7, 3.5786e7] {
            let radius = ApparentRadius::new(1.0 + altitude / 6.371e6);
            for step in 0..=20_000 {
                let cos_tilt = (f64::from(step) / 10_000.0 - 1.0) as f32;
                let computed = plate_view_factor_f32(cos_tilt, radius.sin as f32, radius.cos as f32);
                worst = worst.max((f64::from(computed) - plate_view_factor(f64::from(cos_tilt), radius)).abs());
            }
        }
        println!("largest f32 error of the view factor: {worst:e}");
        assert!(worst < 4e-7, "{worst:e}");
    }
}
