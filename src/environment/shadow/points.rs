//! Points on the corners of triangles and on the Sun's disc, and the low-discrepancy numbers that choose them: the same on every device and in every run.
//! Rays of light, of patches and of mirrors all take their numbers here.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::SUN_ANGULAR_RADIUS;

/// Steps of an additive recurrence in four dimensions (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences"), 2^32 / g^k for k = 1 to 4,
/// where g^5 = g + 1.
const STEPS: [u32; 4] = [3_679_390_609, 3_152_041_523, 2_700_274_806, 2_313_257_605];

/// The same in two dimensions, 2^32 / g^k where g^3 = g + 1.
const DISC_STEPS: [u32; 2] = [3_242_174_889, 2_447_445_414];

/// Cosine and sine of the second step, as a share of a full turn.
const DISC_TURN: DVec2 = DVec2::new(-0.9052538582261404, -0.4248711006489933);

/// Hash of a word (lowbias32 of Wellons 2018, "Prospecting for Hash Functions").
fn hash(word: u32) -> u32 {
    let word = (word ^ (word >> 16)).wrapping_mul(0x7feb_352d);
    let word = (word ^ (word >> 15)).wrapping_mul(0x846c_a68b);
    word ^ (word >> 16)
}

/// Starts of the recurrence of a node, which hashes of its number shift (Cranley and Patterson 1976).
pub(super) fn shifts(node: u32) -> [u32; 4] {
    std::array::from_fn(|k| hash(node.wrapping_mul(4).wrapping_add(k as u32)))
}

/// The four numbers of a sample, each in (0, 1), where `shifts` start the recurrence. The upper 24 bits decide, which f32 holds exactly.
pub(crate) fn fractions(shifts: [u32; 4], sample: u32) -> [f64; 4] {
    std::array::from_fn(|k| {
        let word = shifts[k].wrapping_add(sample.wrapping_mul(STEPS[k]));
        (f64::from(word >> 8) + 0.5) / f64::from(1 << 24)
    })
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

/// Directions of points of the Sun's disc, even over the disc, one after the other without end. The third axis points to the middle of the disc. The lengths are 1
/// within 1e-5.
pub(super) struct DiscPoints {
    /// Square of the radius over the disc's, times 2^32.
    radius: u32,
    /// Direction in the plane of the disc.
    turned: DVec2,
}

impl DiscPoints {
    pub(super) fn new([.., radius, turned]: [u32; 4]) -> Self {
        Self { radius, turned: DVec2::from_angle(TAU * f64::from(turned) / 2f64.powi(32)) }
    }

    pub(super) fn next(&mut self) -> DVec3 {
        self.radius = self.radius.wrapping_add(DISC_STEPS[0]);
        self.turned = self.turned.rotate(DISC_TURN);
        let radius = SUN_ANGULAR_RADIUS * (f64::from(self.radius) / 2f64.powi(32)).sqrt();
        (radius * self.turned).extend(1.0)
    }
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
        let g = (0..99).fold(1.2f64, |g, _| (1.0 + g).cbrt());
        for (k, step) in DISC_STEPS.iter().enumerate() {
            let expected = (g.powi(-(k as i32) - 1) * 4_294_967_296.0).round();
            assert!((f64::from(*step) - expected).abs() <= 1.0, "{k}: {step} against {expected}");
        }
        let turn = DVec2::from_angle(TAU * f64::from(DISC_STEPS[1]) / 2f64.powi(32));
        assert!(turn.distance(DISC_TURN) < 1e-15, "{turn}");
    }

    #[test]
    fn points_lie_nearest_to_their_corner_and_fill_a_third_of_the_triangle() {
        for corner in 0..3 {
            let mut sum = [0.0; 3];
            for ray in 0..3000 {
                let [s, t, ..] = fractions(shifts(3), ray);
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
