//! The share of the Sun's disc that a place sees.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::environment::shadow::SUN_ANGULAR_RADIUS;

/// Rays to the rim of the disc. A disc that is wholly seen or hidden there, and in its middle, counts as such.
const RIM: u32 = 6;
/// Rays to points all over the disc.
const POINTS: u32 = 64;

/// How a place looks at the Sun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SunShape {
    /// As a point.
    Middle,
    Disc,
}

/// Direction to a point of the disc, in radii from its middle and by an angle [rad].
fn point(sun: DVec3, radius: f64, angle: f64) -> DVec3 {
    let (across, along) = sun.any_orthonormal_pair();
    let (sine, cosine) = angle.sin_cos();
    (sun + SUN_ANGULAR_RADIUS * radius * (cosine * across + sine * along)).normalize()
}

/// Share of the Sun, which stands in this direction, in which no ray ends. `is_free`: whether the ray in a direction ends nowhere.
pub(super) fn free_share(sun: DVec3, shape: SunShape, is_free: impl Fn(DVec3) -> bool) -> f64 {
    let share_of = |free: bool| f64::from(u8::from(free));
    let middle = is_free(sun);
    let alike = |number: u32| is_free(point(sun, 1.0, TAU * f64::from(number) / f64::from(RIM))) == middle;
    if shape == SunShape::Middle || (0..RIM).all(alike) {
        return share_of(middle);
    }
    // Equal areas, each turned by the golden angle from the last (Vogel 1979, Math. Biosci. 44).
    let golden = PI * (3.0 - 5f64.sqrt());
    let of_point = |number: u32| {
        let radius = ((f64::from(number) + 0.5) / f64::from(POINTS)).sqrt();
        share_of(is_free(point(sun, radius, golden * f64::from(number))))
    };
    (0..POINTS).map(of_point).sum::<f64>() / f64::from(POINTS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share of a disc beyond a chord at a distance c from its middle is (acos c - c sqrt(1 - c^2)) / pi.
    #[test]
    fn the_share_beyond_an_edge_is_that_of_a_chord() {
        let sun = DVec3::new(0.6, 0.0, 0.8);
        for (number, chord) in (0..64).map(|number| (number, f64::from(number) / 31.5 - 1.0)) {
            let edge = point(sun, 1.0, f64::from(number)) - sun;
            let edge = edge.normalize();
            let is_free = |ray: DVec3| (ray - sun).dot(edge) > chord * SUN_ANGULAR_RADIUS;
            let known = (chord.acos() - chord * (1.0 - chord * chord).sqrt()) / PI;
            let share = free_share(sun, SunShape::Disc, is_free);
            assert!((share - known).abs() < 0.05, "{chord}: {share} for {known}");
            let middle = free_share(sun, SunShape::Middle, is_free);
            assert_eq!(middle, if chord < 0.0 { 1.0 } else { 0.0 });
        }
    }
}
