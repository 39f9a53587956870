//! Rays of a patch: places on it and directions from it, the same on every device.
//!
//! The four numbers of a ray fill places and directions evenly together ([`crate::environment::shadow::fractions`]). Each patch shifts them by its own hash
//! (Cranley and Patterson 1976, SIAM J. Numer. Anal. 13). Whole numbers make them the same on every device.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::environment::shadow;
use crate::thermal::sensor::noise::pcg4d;

/// Second word of the hash of a patch, so that it differs from other uses of the same hash.
const SALT: u32 = 0x5eed;

/// The four numbers of a ray, each in (0, 1).
pub(crate) fn fractions(patch: u32, ray: u32) -> [f64; 4] {
    shadow::fractions(shifts(patch), ray)
}

/// Where the numbers of a patch begin.
pub(super) fn shifts(patch: u32) -> [u32; 4] {
    pcg4d([patch, SALT, 0, 0])
}

/// Two unit vectors at right angles to a unit vector and to each other (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
pub(crate) fn basis(normal: DVec3) -> [DVec3; 2] {
    let sign = if normal.z < 0.0 { -1.0 } else { 1.0 };
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    [
        DVec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
        DVec3::new(b, sign + normal.y * normal.y * a, -normal.y),
    ]
}

/// Direction about a unit normal for two numbers in (0, 1). The probability density is proportional to the cosine (Malley's method).
pub(crate) fn cosine_direction(normal: DVec3, numbers: [f64; 2]) -> DVec3 {
    cosine_direction_across(normal, basis(normal), numbers)
}

/// The same with the [`basis`] of the normal.
pub(super) fn cosine_direction_across(normal: DVec3, [x, y]: [DVec3; 2], [u, v]: [f64; 2]) -> DVec3 {
    let (sine, cosine) = (TAU * v).sin_cos();
    let radius = u.sqrt();
    radius * (cosine * x + sine * y) + (1.0 - u).max(0.0).sqrt() * normal
}

/// Standard deviation of a mean over evenly spread rays, over the one of independent rays. With points of a recurrence in four dimensions the error of a mean
/// falls about as rays^-0.75 where a single edge divides what rays meet; the factor two is for views of many edges.
pub(crate) fn evenness(rays: u32) -> f64 {
    (2.0 * f64::from(rays.max(1)).powf(-0.25)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_cosine_of_the_directions_is_two_thirds() {
        let normal = DVec3::new(0.3, -0.5, -0.8).normalize();
        let mean = |power: i32| {
            let cosine = |ray| {
                let [.., u, v] = fractions(7, ray);
                let direction = cosine_direction(normal, [u, v]);
                assert!((direction.length() - 1.0).abs() < 1e-12);
                direction.dot(normal).powi(power)
            };
            (0..4096).map(cosine).sum::<f64>() / 4096.0
        };
        assert!((mean(1) - 2.0 / 3.0).abs() < 1e-3 && (mean(2) - 0.5).abs() < 1e-3, "{} {}", mean(1), mean(2));
    }
}
