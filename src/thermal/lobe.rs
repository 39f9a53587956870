//! Rough mirrors: the share of a microfacet lobe that meets the planet's disc, as a table (docs/numerics.md 5a).
//!
//! The lobe counts single reflections by GGX facets (Walter et al. 2007) with the separable masking of Smith. The lobe is divided by its own sum over
//! the hemisphere (Turquin 2019), so that a rough surface reflects as much as a smooth one. The share of a uniform surrounding is then exactly 1.

use std::f64::consts::TAU;

use glam::DVec3;
use rayon::prelude::*;

use crate::environment::view_factor::ApparentRadius;

/// Nodes of the table over the view, at places x = sqrt(1 - sqrt(cosine)). These are even in the angle where the view is straight, and close to each other
/// where it grazes the surface and a lobe changes within its own width.
pub(crate) const VIEWS: usize = 33;
/// Nodes of the table over the cosine of the planet's side.
pub(crate) const SIDES: usize = 17;
/// Nodes of the table over the angle to the limb.
pub(crate) const LIMBS: usize = 65;
/// Numbers of a lobe: shares, then the sum of the lobe over the hemisphere for each view.
pub(crate) const LOBE_VALUES: usize = VIEWS * SIDES * LIMBS + VIEWS;

const DIRECTIONS: usize = 4096;
/// Least cosine of a view. Beyond it a surface is seen edge-on.
pub(crate) const LEAST_VIEW: f64 = 1e-3;

/// Where the planet stands as seen from a surface and along its mirror direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlanetPlace {
    /// Cosine between the surface's normal and the direction to the camera.
    pub(crate) view: f64,
    /// Sine of the angle from the mirror direction to the limb, positive where the mirror direction meets the planet.
    pub(crate) sine: f64,
    pub(crate) cosine: f64,
    /// Cosine of the azimuth of the planet's centre about the mirror direction, 1 on the side of the normal.
    pub(crate) side: f64,
}

impl PlanetPlace {
    /// The place of a planet in the direction `nadir`. `normal`, `mirror` and `nadir` are unit vectors.
    pub(crate) fn new(normal: DVec3, view: f64, mirror: DVec3, nadir: DVec3, planet: ApparentRadius) -> Self {
        let (along, across) = (mirror.dot(nadir), mirror.cross(nadir).length());
        let slant = ((1.0 - view) * (1.0 + view)).max(0.0).sqrt();
        let side = (normal.dot(nadir) - view * along) / (slant * across).max(1e-20);
        Self {
            view,
            sine: along * planet.sin - across * planet.cos,
            cosine: along * planet.cos + across * planet.sin,
            side: side.clamp(-1.0, 1.0),
        }
    }
}

/// The lobe of one roughness before a planet of one apparent radius.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lobe {
    /// Roughness alpha of the GGX distribution.
    pub(crate) roughness: f64,
    /// [`LOBE_VALUES`] numbers.
    pub(crate) values: Vec<f64>,
}

/// A direction of a lobe in the axes mirror direction, side of the normal, across; and its weight.
type Weighted = ([f64; 3], f64);

impl Lobe {
    /// Tabulates a lobe of a roughness in (0, 1].
    pub(crate) fn new(roughness: f64, planet: ApparentRadius) -> Self {
        let radius = planet.sin.atan2(planet.cos);
        let of_view = |view: usize| {
            let cosine = (1.0 - (view as f64 / (VIEWS - 1) as f64).powi(2)).powi(2).max(LEAST_VIEW);
            let directions = directions(roughness, cosine, DIRECTIONS);
            let sum: f64 = directions.iter().map(|(_, weight)| weight).sum();
            let mut values = Vec::with_capacity(SIDES * LIMBS);
            for side in 0..SIDES {
                let side = 2.0 * side as f64 / (SIDES - 1) as f64 - 1.0;
                for limb in 0..LIMBS {
                    let place = 2.0 * limb as f64 / (LIMBS - 1) as f64 - 1.0;
                    let half = roughness * place / (1.0 - place.abs()).max(1e-12);
                    let angle = (radius - 2.0 * half.atan()).clamp(0.0, std::f64::consts::PI);
                    values.push(share_of(&directions, sum, angle, side, planet.cos));
                }
            }
            (values, sum / DIRECTIONS as f64)
        };
        let (shares, sums): (Vec<Vec<f64>>, Vec<f64>) = (0..VIEWS).into_par_iter().map(of_view).unzip();
        Self { roughness, values: [shares.concat(), sums].concat() }
    }

    pub(crate) fn share(&self, place: PlanetPlace) -> f64 {
        let half = place.sine / (1.0 + place.cosine).max(1e-6);
        let limb = half / (self.roughness + half.abs());
        let view = place_of(place.view);
        let side = 0.5 * (place.side + 1.0) * (SIDES - 1) as f64;
        let limb = 0.5 * (limb + 1.0) * (LIMBS - 1) as f64;
        let split = |at: f64, nodes: usize| {
            let cell = (at as usize).min(nodes - 2);
            (cell, at - cell as f64)
        };
        let ((view, v), (side, s), (limb, l)) = (split(view, VIEWS), split(side, SIDES), split(limb, LIMBS));
        let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
        let along = |view: usize, side: usize| {
            let first = (view * SIDES + side) * LIMBS + limb;
            mix(self.values[first], self.values[first + 1], l)
        };
        let over = |view: usize| mix(along(view, side), along(view, side + 1), s);
        mix(over(view), over(view + 1), v)
    }

    /// Reflected radiance over irradiance across its rays [1/sr] for the light of a disc around a direction with this sine of its apparent radius. All directions are
    /// unit vectors. The slopes of facets that reflect the disc fill a disc, taken as round, of radius sqrt(R), with R = sine^2 / (4 cos) for the angle between light and facet.
    /// Of the facets' slopes, which are distributed as a^2 / (pi (a^2 + t^2)^2), this disc around the slope t has the share (1 - x / sqrt(x^2 + 4 a^2 R)) / 2, x = t^2 + a^2 - R.
    pub(crate) fn glint(&self, normal: DVec3, to_camera: DVec3, (towards, sine): (DVec3, f64)) -> f64 {
        let light = normal.dot(towards);
        if light <= 0.0 {
            return 0.0;
        }
        let view = normal.dot(to_camera).max(LEAST_VIEW);
        let middle = (to_camera + towards).normalize_or_zero();
        let cosine = normal.dot(middle).max(1e-6);
        let slope = normal.cross(middle).length() / cosine;
        let square = self.roughness * self.roughness;
        let disc = sine * sine / (4.0 * middle.dot(towards).max(LEAST_VIEW));
        let beyond = slope * slope + square - disc;
        let root = (beyond * beyond + 4.0 * square * disc).sqrt();
        // The same two ways, without a difference of nearly equal numbers.
        let share =
            if beyond >= 0.0 { 2.0 * square / (root * (root + beyond)) } else { (root - beyond) / (2.0 * root * disc) };
        let facets = share / (std::f64::consts::PI * cosine.powi(4));
        facets * masking(view, self.roughness) * masking(light, self.roughness) / (4.0 * view * self.sum(view))
    }

    /// Sum of the lobe over the hemisphere: the mean of [`masking`] over the directions of visible facets.
    pub(crate) fn sum(&self, view: f64) -> f64 {
        let at = place_of(view);
        let cell = (at as usize).min(VIEWS - 2);
        let sums = &self.values[VIEWS * SIDES * LIMBS..];
        sums[cell] + (at - cell as f64) * (sums[cell + 1] - sums[cell])
    }
}

fn place_of(view: f64) -> f64 {
    (1.0 - view.sqrt()).max(0.0).sqrt() * (VIEWS - 1) as f64
}

/// Share of the facets that are not hidden at a cosine (Smith, GGX).
pub(crate) fn masking(cosine: f64, roughness: f64) -> f64 {
    let square = roughness * roughness;
    2.0 * cosine / (cosine + (square + (1.0 - square) * cosine * cosine).sqrt())
}

/// Directions that stand for a lobe at a cosine of the view: samples of the visible normals (Heitz 2018) at points of the Hammersley set.
fn directions(roughness: f64, view: f64, count: usize) -> Vec<Weighted> {
    let slant = (1.0 - view * view).max(0.0).sqrt();
    let [mirror, up] = [DVec3::new(-slant, 0.0, view), DVec3::new(view, 0.0, slant)];
    let value = |index: usize| {
        let place = [(index as f64 + 0.5) / count as f64, radical_inverse(index as u32)];
        let light = facet_reflection(roughness, view, place);
        let weight = if light.z > 0.0 { masking(light.z, roughness) } else { 0.0 };
        ([light.dot(mirror), light.dot(up), light.y], weight)
    };
    (0..count).map(value).collect()
}

/// Direction of a visible facet's reflection for two numbers in (0, 1) (Heitz 2018). The third axis is the normal, and the first lies in the plane of
/// the view. `view` is the cosine of its angle. Directions below the surface, and directions that other facets hide, still count.
pub(crate) fn facet_reflection(roughness: f64, view: f64, [u, v]: [f64; 2]) -> DVec3 {
    let slant = (1.0 - view * view).max(0.0).sqrt();
    let to_camera = DVec3::new(slant, 0.0, view);
    let stretched = DVec3::new(roughness * slant, 0.0, view).normalize();
    let across = DVec3::Y;
    let third = stretched.cross(across);
    let share = 0.5 * (1.0 + stretched.z);
    let (a, b) = (u.sqrt() * (TAU * v).cos(), u.sqrt() * (TAU * v).sin());
    let b = (1.0 - share) * (1.0 - a * a).max(0.0).sqrt() + share * b;
    let normal = across * a + third * b + stretched * (1.0 - a * a - b * b).max(0.0).sqrt();
    let facet = DVec3::new(roughness * normal.x, roughness * normal.y, normal.z.max(0.0)).normalize();
    2.0 * to_camera.dot(facet) * facet - to_camera
}

/// Share of the weights of directions within the planet's disc. The disc's centre is at `angle` from the mirror direction, with the cosine `side` of
/// its azimuth.
fn share_of(directions: &[Weighted], sum: f64, angle: f64, side: f64, limb: f64) -> f64 {
    let (sine, cosine) = angle.sin_cos();
    let (up, across) = (sine * side, sine * (1.0 - side * side).max(0.0).sqrt());
    let inside = |([along, to_up, to_across], _): &&Weighted| cosine * along + up * to_up + across * to_across >= limb;
    directions.iter().filter(inside).map(|(_, weight)| weight).sum::<f64>() / sum
}

/// Van der Corput's sequence in base 2.
fn radical_inverse(index: u32) -> f64 {
    f64::from(index.reverse_bits()) / 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share by counting many directions.
    fn counted(roughness: f64, place: PlanetPlace, planet: ApparentRadius) -> f64 {
        let directions = directions(roughness, place.view.max(LEAST_VIEW), 200_000);
        let sum = directions.iter().map(|(_, weight)| weight).sum();
        let angle = planet.sin.atan2(planet.cos) - place.sine.atan2(place.cosine);
        share_of(&directions, sum, angle, place.side, planet.cos)
    }

    #[test]
    fn the_table_agrees_with_counted_directions() {
        for (roughness, ratio) in [(0.05, 1.064), (0.3, 1.064), (1.0, 1.064), (0.3, 1.5), (0.05, 6.6), (1.0, 6.6)] {
            let planet = ApparentRadius::new(ratio);
            let lobe = Lobe::new(roughness, planet);
            let (mut worst, mut total, mut off, mut count) = (0.0_f64, 0.0, 0.0_f64, 0.0);
            for step in 0..60 {
                let number = |salt: u32| radical_inverse(step * 7 + salt * 1013 + 1);
                let view = 0.08 + 0.92 * number(1);
                let normal = DVec3::Z;
                let slant = (1.0 - view * view).sqrt();
                let mirror = DVec3::new(-slant, 0.0, view);
                let azimuth = TAU * number(2);
                let z = 2.0 * number(3) - 1.0;
                let nadir = DVec3::new((1.0 - z * z).sqrt() * azimuth.cos(), (1.0 - z * z).sqrt() * azimuth.sin(), z);
                let place = PlanetPlace::new(normal, view, mirror, nadir, planet);
                let exact = counted(roughness, place, planet);
                worst = worst.max((lobe.share(place) - exact).abs());
                off = off.max((lobe.share(PlanetPlace { side: -place.side, ..place }) - exact).abs());
                total += lobe.share(place) - exact;
                count += 1.0;
            }
            println!("roughness {roughness}, ratio {ratio}: worst {worst:.2e}, mean {:.2e}", total / count);
            assert!(worst < 0.01 && (total / count).abs() < 1e-3, "{roughness}, {ratio}: {worst}");
            assert!(off > 0.01, "the planet on the other side must show");
        }
    }

    /// A plate with the Sun 30 deg from its normal, seen along the mirror direction. The values are GGX facets averaged over the Sun's disc by a program that is not ours: radiance over
    /// that of the disc. A Sun without size would make 69 of the first and 0.06 of the last.
    #[test]
    fn no_glint_is_brighter_than_the_sun() {
        let (sun, camera) = (DVec3::new(0.5, 0.0, 0.75_f64.sqrt()), DVec3::new(-0.5, 0.0, 0.75_f64.sqrt()));
        let sine = 6.957e8 / 1.496e11;
        let over_disc = |roughness: f64, sine_of_light: f64| {
            let lobe = Lobe::new(roughness, ApparentRadius::new(1.064));
            lobe.glint(DVec3::Z, camera, (sun, sine_of_light)) * std::f64::consts::PI * sine * sine
        };
        for (roughness, expected) in
            [(0.0003, 0.986), (0.001, 0.861), (0.002, 0.608), (0.003, 0.409), (0.005, 0.200), (0.01, 0.0587)]
        {
            let found = over_disc(roughness, sine);
            assert!((found / expected - 1.0).abs() < 0.015, "roughness {roughness}: {found} for {expected}");
            assert!((over_disc(roughness, 0.0) / expected - 1.0).abs() > 0.05, "a point shines too brightly");
        }
    }

    #[test]
    fn a_glint_sums_to_the_whole_lobe() {
        let lobe = Lobe::new(0.4, ApparentRadius::new(1.1));
        for view in [0.3, 0.7, 1.0_f64] {
            let slant = (1.0 - view * view).sqrt();
            let to_camera = DVec3::new(slant, 0.0, view);
            let (mut sum, steps) = (0.0, 400);
            for row in 0..steps {
                let z = (f64::from(row) + 0.5) / f64::from(steps);
                for column in 0..steps {
                    let azimuth = TAU * (f64::from(column) + 0.5) / f64::from(steps);
                    let across = (1.0 - z * z).sqrt();
                    let light = DVec3::new(across * azimuth.cos(), across * azimuth.sin(), z);
                    sum += lobe.glint(DVec3::Z, to_camera, (light, 0.0));
                }
            }
            let whole = sum * TAU / f64::from(steps * steps);
            assert!((whole - 1.0).abs() < 5e-3, "{view}: {whole}");
        }
    }
}
