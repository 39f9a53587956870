//! Rays of a patch: places on it and directions from it, the same on every device.
//!
//! The four numbers of a ray follow an additive recurrence (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences") in steps of 2^-32, which
//! fills places and directions evenly together. Each patch shifts it by its own hash (Cranley and Patterson 1976, SIAM J. Numer. Anal. 13). Whole numbers make
//! it exact on every device. Twin: `glsl/exchange_rays.glsl`.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::thermal::sensor::noise::pcg4d;

/// Steps of the recurrence, 2^32 / g^k for k = 1 to 4, where g^5 = g + 1.
pub(crate) const STEPS: [u32; 4] = [3_679_390_609, 3_152_041_523, 2_700_274_806, 2_313_257_605];

/// Second word of the hash of a patch, so that it differs from other uses of the same hash.
const SALT: u32 = 0x5eed;

/// The four numbers of a ray, each in (0, 1). Their upper 24 bits decide, which f32 holds exactly.
pub(crate) fn fractions(patch: u32, ray: u32) -> [f64; 4] {
    let shift = pcg4d([patch, SALT, 0, 0]);
    std::array::from_fn(|k| {
        let word = shift[k].wrapping_add(ray.wrapping_mul(STEPS[k]));
        (f64::from(word >> 8) + 0.5) / f64::from(1 << 24)
    })
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
pub(crate) fn cosine_direction(normal: DVec3, [u, v]: [f64; 2]) -> DVec3 {
    let [x, y] = basis(normal);
    let (sine, cosine) = (TAU * v).sin_cos();
    let radius = u.sqrt();
    radius * (cosine * x + sine * y) + (1.0 - u).max(0.0).sqrt() * normal
}

/// Barycentric weights of the second and third corner of a point that two numbers in (0, 1) spread evenly over the part of a triangle that is nearest to
/// corner number `corner`, by its weights.
pub(crate) fn point_near_corner([s, t]: [f64; 2], corner: usize) -> [f64; 2] {
    let root = s.sqrt();
    let weights = [1.0 - root, root * (1.0 - t), root * t];
    let most = (0..3).fold(0, |best, k| if weights[k] > weights[best] { k } else { best });
    let turned = |k: usize| weights[(k + 3 + most - corner) % 3];
    [turned(1), turned(2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_steps_are_those_of_the_generalised_golden_ratio() {
        let g = (0..99).fold(1.2f64, |g, _| (1.0 + g).powf(0.2));
        for (k, step) in STEPS.iter().enumerate() {
            let expected = (g.powi(-(k as i32) - 1) * 4_294_967_296.0).round();
            assert!((f64::from(*step) - expected).abs() <= 1.0, "{k}: {step} against {expected}");
        }
    }

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

    #[test]
    fn points_lie_nearest_to_their_corner_and_fill_a_third_of_the_triangle() {
        for corner in 0..3 {
            let mut sum = [0.0; 3];
            for ray in 0..3000 {
                let [s, t, ..] = fractions(3, ray);
                let [v, w] = point_near_corner([s, t], corner);
                let all = [1.0 - v - w, v, w];
                assert!(all.iter().all(|weight| *weight <= all[corner] + 1e-12 && *weight >= -1e-12));
                (0..3).for_each(|k| sum[k] += all[k] / 3000.0);
            }
            // The centroid of the quadrilateral from the corner over the middles of two edges to the centre.
            assert!((sum[corner] - 11.0 / 18.0).abs() < 2e-3, "{corner}: {sum:?}");
        }
    }
}
