//! The share of the Sun's disc that a place sees.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::environment::shadow::SUN_ANGULAR_RADIUS;
use crate::environment::view_factor::ApparentRadius;

/// Rays to the rim of the disc. A disc that is wholly seen or hidden there, and in its middle, counts as such.
const RIM: u32 = 6;
/// Rays to points all over the disc.
const POINTS: usize = 64;

/// How a place looks at the Sun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SunShape {
    /// As a point.
    Middle,
    Disc,
}

/// Direction to a point of the rim, by an angle [rad].
fn rim(sun: DVec3, angle: f64) -> DVec3 {
    let (across, along) = sun.any_orthonormal_pair();
    let (sine, cosine) = angle.sin_cos();
    (sun + SUN_ANGULAR_RADIUS * (cosine * across + sine * along)).normalize()
}

/// Share of the Sun, which stands in this direction, in which no ray ends. `is_free`: whether the ray in a direction ends nowhere.
pub(super) fn free_share(sun: DVec3, shape: SunShape, is_free: impl Fn(DVec3) -> bool) -> f64 {
    let middle = is_free(sun);
    let alike = |number: u32| is_free(rim(sun, TAU * f64::from(number) / f64::from(RIM))) == middle;
    if shape == SunShape::Middle || (0..RIM).all(alike) {
        return f64::from(u8::from(middle));
    }
    let disc = ApparentRadius::new(SUN_ANGULAR_RADIUS.recip());
    disc.directions(sun, POINTS).filter(|direction| is_free(*direction)).count() as f64 / POINTS as f64
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// The share of a disc beyond a chord at a distance c from its middle is (acos c - c sqrt(1 - c^2)) / pi.
    #[test]
    fn the_share_beyond_an_edge_is_that_of_a_chord() {
        let sun = DVec3::new(0.6, 0.0, 0.8);
        for (number, chord) in (0..64).map(|number| (number, f64::from(number) / 31.5 - 1.0)) {
            let edge = rim(sun, f64::from(number)) - sun;
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
