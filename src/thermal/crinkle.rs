//! Crinkled foil that is drawn: slopes of its normals at the nodes of a mesh, from a seed (docs/numerics.md 5a).

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

/// Normal of a crinkled surface at a node. `variance` is the mean square of the slopes along any direction, over the surface. The slopes follow from seed and
/// position alone, so that nodes at one place have the same.
///
/// The normals of three nodes interpolate over their triangle. Interpolation halves the variance of the slopes, in the mean over the triangle, so
/// slopes at nodes have twice as much.
pub(crate) fn crinkled(normal: DVec3, position: Vec3, variance: f64, seed: u32) -> DVec3 {
    let Some(normal) = normal.try_normalize() else { return normal };
    let mut state = u64::from(seed);
    for part in position.to_array() {
        // -0 and 0 are one place.
        state = mixed(state ^ u64::from((part + 0.0).to_bits()));
    }
    let [radius, angle] = [0, 1].map(|stream| (mixed(state.wrapping_add(stream)) >> 11) as f64 / (1u64 << 53) as f64);
    // Box and Muller: two normal numbers, each of variance 1.
    let length = (2.0 * variance).sqrt() * (-2.0 * (1.0 - radius).ln()).sqrt();
    let (sin, cos) = (TAU * angle).sin_cos();
    let across = normal.any_orthonormal_vector();
    (normal + length * (cos * across + sin * normal.cross(across))).normalize()
}

/// SplitMix64 (Steele, Lea & Flood 2014).
fn mixed(state: u64) -> u64 {
    let mut z = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean square of the slope along x over triangles of a grid.
    fn variance(stated: f64, seed: u32) -> f64 {
        let side = 120;
        let slope = |column: usize, row: usize| {
            let normal = crinkled(DVec3::Z, Vec3::new(0.1 * column as f32, 0.1 * row as f32, 2.0), stated, seed);
            -normal.x / normal.z
        };
        let (mut sum, mut count) = (0.0, 0.0);
        for cell in 0..side * side {
            let (column, row) = (cell % side, cell / side);
            let corners = [slope(column, row), slope(column + 1, row), slope(column, row + 1)];
            // The mean of a product of two interpolated values over a triangle is (sum of all products + sum of squares) / 12.
            let whole: f64 = corners.iter().sum();
            sum += (whole * whole + corners.iter().map(|corner| corner * corner).sum::<f64>()) / 12.0;
            count += 1.0;
        }
        sum / count
    }

    #[test]
    fn the_slopes_have_the_stated_variance_and_follow_the_seed() {
        for stated in [0.001, 0.02, 0.1] {
            for seed in [0, 7] {
                let computed = variance(stated, seed) / stated;
                assert!((computed - 1.0).abs() < 0.03, "{stated}, seed {seed}: {computed}");
            }
        }
        assert!((variance(0.02, 1) - variance(0.02, 2)).abs() > 1e-6, "another seed is another foil");
        let at = |x: f32| crinkled(DVec3::Z, Vec3::new(x, 0.0, 1.0), 0.02, 3);
        assert_eq!(at(0.0), at(-0.0));
        assert!(at(0.0).distance(at(1.0)) > 1e-3);
        assert_eq!(crinkled(DVec3::ZERO, Vec3::ONE, 0.02, 3), DVec3::ZERO, "padding has no normal");
    }
}
