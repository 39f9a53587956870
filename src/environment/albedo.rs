//! View factor from a sunlit Lambert planet to a plate (albedo): the exact integral, and a table of it for one step.
//!
//! Directions are unit normals in the *planet frame*: z points to nadir, x points towards the Sun at right angles to z. Every value is even in y.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;
use std::sync::LazyLock;

use glam::DVec3;

use super::quadrature::GaussLegendre;

/// `albedo_factor` tabulated over the directions of a normal, for one Sun zenith angle and one distance.
///
/// The grid has `RESOLUTION + 1` points each way, row after row in z. Direction d reads it bilinearly at p = (dx, dz) / (|dx| + |dy| +
/// |dz|), in [-1, 1]^2. The factor has creases at p = 0, which are grid lines.
///
/// A value is the factor of the unit vector along v = (px, 1 - |px| - |pz|, pz), times the length of v. A read divides by that length
/// again. A plate that sees the whole disc has a factor linear in its normal, so its value is linear in p and the bilinear read is exact.
/// The values continue one cell beyond |px| + |pz| = 1, where v has y < 0, because reads near that line use them. Further out they are 0.
#[derive(Debug, Clone, PartialEq)]
pub struct AlbedoTable {
    /// (RESOLUTION + 1)^2 values: albedo flux / (albedo x solar constant) x length of v.
    pub values: Vec<f64>,
}

/// Intervals of the table each way: an even number, so that p = 0 is a grid line.
pub const RESOLUTION: usize = 160;

/// The vector v of a grid point. `None` where no read reaches the point.
pub(super) fn grid_direction(column: usize, row: usize) -> Option<DVec3> {
    let half = RESOLUTION / 2;
    if !reached_columns(row).contains(&column) {
        return None;
    }
    let coordinate = |index: usize| (index as f64 - half as f64) / half as f64;
    let (x, z) = (coordinate(column), coordinate(row));
    Some(DVec3::new(x, 1.0 - x.abs() - z.abs(), z))
}

/// The columns of a row of the grid that a read may reach.
pub(super) fn reached_columns(row: usize) -> Range<usize> {
    let half = RESOLUTION / 2;
    let reach = half + 1 - row.abs_diff(half);
    half.saturating_sub(reach)..(half + reach).min(RESOLUTION) + 1
}

/// `albedo_factor` read from a table. `direction` is a unit normal in the planet frame.
pub(crate) fn albedo_table_lookup(table: &AlbedoTable, direction: DVec3) -> f64 {
    let sum = direction.x.abs() + direction.y.abs() + direction.z.abs();
    let scale = 0.5 * RESOLUTION as f64;
    let column = (direction.x / sum + 1.0) * scale;
    let row = (direction.z / sum + 1.0) * scale;
    let last = (RESOLUTION - 1) as f64;
    let (first_column, first_row) = (column.floor().min(last), row.floor().min(last));
    let (u, v) = (column - first_column, row - first_row);
    let index = first_row as usize * (RESOLUTION + 1) + first_column as usize;
    let value = |index: usize| table.values[index];
    let lower = value(index) * (1.0 - u) + value(index + 1) * u;
    let upper = value(index + RESOLUTION + 1) * (1.0 - u) + value(index + RESOLUTION + 2) * u;
    (lower * (1.0 - v) + upper * v) * sum
}

/// A table whose every direction has the factor 1.
pub(crate) fn constant_table() -> AlbedoTable {
    let points = (0..=RESOLUTION).flat_map(|row| (0..=RESOLUTION).map(move |column| (column, row)));
    AlbedoTable { values: points.map(|(column, row)| grid_direction(column, row).map_or(0.0, DVec3::length)).collect() }
}

/// Quadrature points on each piece of the angle of incidence. Above 100 km the error is below 5e-7 of a unit flux.
const INCIDENCE_POINTS: usize = 16;

static INCIDENCE_RULE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(INCIDENCE_POINTS));

/// Flux that a plate receives from a sunlit Lambert planet, divided by (albedo x solar constant).
///
/// `normal` is the plate's unit normal in the planet frame. `distance_ratio` (> 1) is the distance to the planet's centre over its radius.
/// `sun_zenith` is the Sun's zenith angle at the point below the craft [rad], in [0, pi].
///
/// The factor is the integral of cos(Sun's zenith) x cos(plate's angle) / pi over the solid angle of the part of the planet that is visible, lit and in
/// front of the plate. On a ring of equal angle from nadir both cosines are a + b cos(azimuth). Both are positive on at most two arcs, so the ring has a
/// closed form. The integration variable is the angle of incidence on the surface, 0 at nadir to 90 deg at the limb, because the integrand is smooth in it
/// at the limb. The interval is cut where a ring touches the terminator or the plate's horizon.
pub(crate) fn albedo_factor(normal: DVec3, distance_ratio: f64, sun_zenith: f64) -> f64 {
    albedo_factor_with(&INCIDENCE_RULE, normal, distance_ratio, sun_zenith)
}

/// Mean of [`albedo_factor`] over all normals. The mean cosine of a plate to a direction is 1/4, so the sight of the plate becomes a constant.
pub(crate) fn mean_albedo_factor(distance_ratio: f64, sun_zenith: f64) -> f64 {
    let sight = |_: f64, _: f64| Cosine { mean: 0.25, swing: 0.0, centre: SUNWARD };
    planet_light(&INCIDENCE_RULE, FRAC_PI_2, sight, distance_ratio, sun_zenith)
}

fn albedo_factor_with(rule: &GaussLegendre, normal: DVec3, distance_ratio: f64, sun_zenith: f64) -> f64 {
    let plate = PlateNormal::new(normal);
    if plate.tilt >= FRAC_PI_2 + (1.0 / distance_ratio).asin() {
        return 0.0;
    }
    let sight = |sin_nadir: f64, cos_nadir: f64| Cosine {
        mean: cos_nadir * plate.nadir,
        swing: sin_nadir * plate.across,
        centre: plate.azimuth,
    };
    planet_light(rule, plate.horizon_incidence(distance_ratio), sight, distance_ratio, sun_zenith)
}

/// Integral of cos(Sun's zenith) x `sight` / pi over the solid angle of the lit planet. `sight` is the cosine of the plate on a ring of this sine and cosine
/// from nadir; it touches the plate's horizon at the angle of incidence `horizon` [rad].
fn planet_light(
    rule: &GaussLegendre,
    horizon: f64,
    sight: impl Fn(f64, f64) -> Cosine,
    distance_ratio: f64,
    sun_zenith: f64,
) -> f64 {
    let mut cuts = [0.0, terminator_incidence(distance_ratio, sun_zenith), horizon, FRAC_PI_2];
    cuts.sort_by(f64::total_cmp);

    let (sin_sun, cos_sun) = sun_zenith.sin_cos();
    let mut sum = 0.0;
    for piece in cuts.windows(2).filter(|piece| piece[1] > piece[0]) {
        for (incidence, weight) in rule.on_smoothed(piece[0], piece[1]) {
            let (sin_incidence, cos_incidence) = incidence.sin_cos();
            let sin_nadir = sin_incidence / distance_ratio;
            let cos_nadir = ((1.0 - sin_nadir) * (1.0 + sin_nadir)).sqrt();
            let (sin_ground, cos_ground) = (
                sin_incidence * cos_nadir - cos_incidence * sin_nadir,
                cos_incidence * cos_nadir + sin_incidence * sin_nadir,
            );
            let sun = Cosine { mean: cos_ground * cos_sun, swing: sin_ground * sin_sun, centre: SUNWARD };
            let solid_angle = sin_nadir * cos_incidence / (distance_ratio * cos_nadir);
            sum += weight * solid_angle * ring(sun, sight(sin_nadir, cos_nadir));
        }
    }
    sum / PI
}

/// A plate's normal in the planet frame, in components.
struct PlateNormal {
    /// Component to nadir.
    nadir: f64,
    /// Component at right angles to nadir.
    across: f64,
    /// Azimuth of the `across` component from the Sun's side, in [0, pi].
    azimuth: Azimuth,
    /// Angle from nadir [rad], in [0, pi].
    tilt: f64,
}

impl PlateNormal {
    fn new(normal: DVec3) -> Self {
        let across = normal.x.hypot(normal.y);
        let side = normal.y.abs();
        let [sine, cosine] = if across > 0.0 { [side / across, normal.x / across] } else { [0.0, 1.0] };
        let azimuth = Azimuth { angle: side.atan2(normal.x), sine, cosine };
        Self { nadir: normal.z, across, azimuth, tilt: across.atan2(normal.z) }
    }

    /// Angle of incidence of the ring that touches the plate's own horizon [rad], or 90 deg where no ring does.
    fn horizon_incidence(&self, distance_ratio: f64) -> f64 {
        let sine = distance_ratio * self.nadir.abs();
        if sine < 1.0 { sine.asin() } else { FRAC_PI_2 }
    }
}

/// Angle of incidence of the ring that touches the terminator [rad], or 90 deg where the terminator lies beyond the limb.
fn terminator_incidence(distance_ratio: f64, sun_zenith: f64) -> f64 {
    let (sin_ground, cos_ground) = (FRAC_PI_2 - sun_zenith).abs().sin_cos();
    if distance_ratio * cos_ground <= 1.0 {
        return FRAC_PI_2;
    }
    let nadir = sin_ground.atan2(distance_ratio - cos_ground);
    (distance_ratio * nadir.sin()).min(1.0).asin()
}

/// An azimuth [rad] with its sine and cosine.
#[derive(Clone, Copy)]
struct Azimuth {
    angle: f64,
    sine: f64,
    cosine: f64,
}

/// The Sun's side.
const SUNWARD: Azimuth = Azimuth { angle: 0.0, sine: 0.0, cosine: 1.0 };

/// The function mean + swing cos(azimuth - centre), with swing >= 0 and centre in [0, pi].
#[derive(Clone, Copy)]
struct Cosine {
    mean: f64,
    swing: f64,
    centre: Azimuth,
}

impl Cosine {
    /// Half the width of the arc on which the function is positive, in [0, pi].
    fn half_arc(self) -> Azimuth {
        if self.mean >= self.swing {
            Azimuth { angle: PI, sine: 0.0, cosine: -1.0 }
        } else if self.mean <= -self.swing {
            SUNWARD
        } else {
            let cosine = -self.mean / self.swing;
            Azimuth { angle: cosine.acos(), sine: ((1.0 - cosine) * (1.0 + cosine)).sqrt(), cosine }
        }
    }

    /// The end of an arc of this half width, before (-1) or after (1) the centre.
    fn end(self, half: Azimuth, side: f64) -> Azimuth {
        let Azimuth { angle, sine, cosine } = self.centre;
        Azimuth {
            angle: angle + side * half.angle,
            sine: sine * half.cosine + side * cosine * half.sine,
            cosine: cosine * half.cosine - side * sine * half.sine,
        }
    }
}

/// Integral over the azimuth of a x b where both are positive. The centre of `a` is 0. The sines of the ends of arcs follow from the two functions, so a ring takes two inverse
/// cosines.
fn ring(a: Cosine, b: Cosine) -> f64 {
    let (half_a, half_b) = (a.half_arc(), b.half_arc());
    let Azimuth { sine, cosine, .. } = b.centre;
    if half_a.angle == PI && half_b.angle == PI {
        return TAU * a.mean * b.mean + PI * a.swing * b.swing * cosine;
    }
    let arc = |start: Azimuth, end: Azimuth| {
        if end.angle <= start.angle {
            return 0.0;
        }
        let change = |of: &dyn Fn(Azimuth) -> f64| of(end) - of(start);
        let off_centre = |at: Azimuth| at.sine * cosine - at.cosine * sine;
        let twice =
            |at: Azimuth| 2.0 * at.sine * at.cosine * cosine - (at.cosine - at.sine) * (at.cosine + at.sine) * sine;
        (end.angle - start.angle) * (a.mean * b.mean + 0.5 * a.swing * b.swing * cosine)
            + a.swing * b.mean * (end.sine - start.sine)
            + a.mean * b.swing * change(&off_centre)
            + 0.25 * a.swing * b.swing * change(&twice)
    };
    let later = |x: Azimuth, y: Azimuth| if x.angle > y.angle { x } else { y };
    let earlier = |x: Azimuth, y: Azimuth| if x.angle < y.angle { x } else { y };
    let (first, last) = (a.end(half_a, -1.0), a.end(half_a, 1.0));
    let [begins, ends] = [-1.0, 1.0].map(|side| b.end(half_b, side));
    let around = Azimuth { angle: ends.angle - TAU, ..ends };
    (arc(later(first, begins), earlier(last, ends)) + arc(first, earlier(last, around))).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS_KM: f64 = 6371.0;
    const ISS: f64 = 1.0 + 408.0 / RADIUS_KM;

    /// Normals and Sun zenith angles from a Halton sequence in bases 2, 3 and 5.
    fn cases(count: u32) -> impl Iterator<Item = (DVec3, f64)> {
        (1..=count).map(|index| {
            let [a, b, c] = [2, 3, 5].map(|base| {
                let (mut rest, mut unit, mut value) = (index, 1.0, 0.0);
                while rest > 0 {
                    unit /= f64::from(base);
                    value += unit * f64::from(rest % base);
                    rest /= base;
                }
                value
            });
            let z: f64 = 2.0 * a - 1.0;
            let (sin, cos) = (TAU * b).sin_cos();
            let across = (1.0 - z * z).sqrt();
            (DVec3::new(across * cos, across * sin, z), PI * c)
        })
    }

    /// The same integral summed over points of the planet's surface.
    fn by_points(normal: DVec3, distance_ratio: f64, sun_zenith: f64) -> f64 {
        const RINGS: u32 = 300;
        const SECTORS: u32 = 300;
        let craft = DVec3::new(0.0, 0.0, -distance_ratio);
        let sun = DVec3::new(sun_zenith.sin(), 0.0, -sun_zenith.cos());
        let low = 1.0 / distance_ratio;
        let mut sum = 0.0;
        for ring in 0..RINGS {
            // The heights are denser at the top of the cap, which is near to a low craft.
            let share = (f64::from(ring) + 0.5) / f64::from(RINGS);
            let height = 1.0 - (1.0 - low) * share * share;
            let area = (1.0 - low) * 2.0 * share / f64::from(RINGS) * TAU / f64::from(SECTORS);
            for sector in 0..SECTORS {
                let (sin, cos) = (TAU * (f64::from(sector) + 0.5) / f64::from(SECTORS)).sin_cos();
                let across = (1.0 - height * height).sqrt();
                let point = DVec3::new(across * cos, across * sin, -height);
                let sight = point - craft;
                let emitted = point.dot(sun).max(0.0) * point.dot(-sight).max(0.0);
                sum += area * emitted * normal.dot(sight).max(0.0) / sight.length_squared().powi(2);
            }
        }
        sum / PI
    }

    #[test]
    fn the_integral_agrees_with_a_sum_over_points_of_the_surface() {
        for altitude in [100.0, 408.0, 772.0, 20_000.0, 35_786.0] {
            let ratio = 1.0 + altitude / RADIUS_KM;
            for (normal, sun_zenith) in cases(24) {
                let (computed, expected) =
                    (albedo_factor(normal, ratio, sun_zenith), by_points(normal, ratio, sun_zenith));
                let difference = (computed - expected).abs();
                assert!(difference < 1e-4, "{altitude} km, {normal}, {sun_zenith}: {computed} against {expected}");
            }
        }
        let wrong_side = DVec3::new(-0.8, 0.0, 0.6);
        assert!((albedo_factor(wrong_side, ISS, 1.2) - by_points(DVec3::new(0.8, 0.0, 0.6), ISS, 1.2)).abs() > 0.02);
    }

    #[test]
    fn more_points_in_the_rule_change_nothing() {
        let fine = GaussLegendre::new(100);
        let coarse = GaussLegendre::new(4);
        for altitude in [100.0, 408.0, 35_786.0] {
            let ratio = 1.0 + altitude / RADIUS_KM;
            let worst = |rule: &GaussLegendre| {
                let error = |(normal, sun_zenith)| {
                    let reference = albedo_factor_with(&fine, normal, ratio, sun_zenith);
                    (albedo_factor_with(rule, normal, ratio, sun_zenith) - reference).abs()
                };
                cases(400).map(error).fold(0.0, f64::max)
            };
            assert!(worst(&INCIDENCE_RULE) < 5e-7, "{altitude} km: {:e}", worst(&INCIDENCE_RULE));
            assert!(worst(&coarse) > 1e-6, "four points must not be enough");
        }
    }

    /// docs/numerics.md 4: 0.0206 for a nadir plate at 408 km.
    #[test]
    fn the_terminator_value_of_numerics_4() {
        let computed = albedo_factor(DVec3::Z, ISS, FRAC_PI_2);
        assert!((computed - 0.0206).abs() < 5e-5, "{computed}");
        assert!((albedo_factor(DVec3::Z, ISS, FRAC_PI_2 - 0.005) - 0.0206).abs() > 5e-4);
    }

    #[test]
    fn at_noon_the_factor_is_a_little_below_the_view_factor() {
        for (ratio, least) in [(1.000_1, 0.999), (ISS, 0.95), (6.617, 0.6)] {
            let share = albedo_factor(DVec3::Z, ratio, 0.0) * ratio * ratio;
            assert!((least..1.0).contains(&share), "{ratio}: {share}");
        }
        // Far away the planet is a Lambert sphere at full phase: geometric albedo 2/3 (Russell 1916).
        let far = albedo_factor(DVec3::Z, 1e5, 0.0) * 1e10;
        assert!((far - 2.0 / 3.0).abs() < 1e-4, "{far}");
        // At a right angle it is 1/pi of that (Lambert's phase function).
        let half = albedo_factor(DVec3::Z, 1e5, FRAC_PI_2) * 1e10;
        assert!((half - 2.0 / 3.0 / PI).abs() < 1e-4, "{half}");
    }

    #[test]
    fn dark_planets_and_plates_that_look_away_get_nothing() {
        let horizon = (1.0 / ISS).acos();
        for (normal, _) in cases(100) {
            assert_eq!(albedo_factor(normal, ISS, FRAC_PI_2 + horizon + 1e-9), 0.0);
            assert_eq!(albedo_factor(normal, ISS, PI), 0.0);
            assert!(albedo_factor(normal, ISS, 1.0) >= 0.0);
        }
        let limb = (1.0 / ISS).asin();
        let tilted = |tilt: f64| DVec3::new(tilt.sin(), 0.0, tilt.cos());
        assert_eq!(albedo_factor(tilted(FRAC_PI_2 + limb + 1e-9), ISS, 0.3), 0.0);
        assert!(albedo_factor(tilted(FRAC_PI_2 + limb - 0.05), ISS, 0.3) > 0.0);
        assert!(albedo_factor(DVec3::Z, ISS, FRAC_PI_2 + horizon - 0.05) > 0.0);
    }

    #[test]
    fn the_factor_is_even_across_and_linear_where_the_whole_disc_is_seen() {
        for (normal, sun_zenith) in cases(50) {
            let mirrored = DVec3::new(normal.x, -normal.y, normal.z);
            assert_eq!(albedo_factor(normal, ISS, sun_zenith), albedo_factor(mirrored, ISS, sun_zenith));
        }
        let ratio = 6.617;
        let (nadir, sunward) = (DVec3::Z, DVec3::new(0.6, 0.0, 0.8));
        let sum = nadir + sunward;
        let factor = |direction: DVec3| albedo_factor(direction.normalize(), ratio, 1.1) * direction.length();
        assert!((factor(sum) - factor(nadir) - factor(sunward)).abs() < 1e-9);
        assert!((factor(nadir) - factor(sunward)).abs() > 1e-4);
    }

    #[test]
    fn extreme_distances_stay_finite() {
        for ratio in [1.0 + 1e-9, 1.0 + 1e-6, 1e4, 1e8] {
            for (normal, sun_zenith) in cases(200) {
                let factor = albedo_factor(normal, ratio, sun_zenith);
                assert!((0.0..=1.0).contains(&factor), "{ratio}, {normal}, {sun_zenith}: {factor}");
            }
        }
    }

    #[test]
    fn the_factor_has_no_jumps() {
        let tilted =
            |tilt: f64, azimuth: f64| DVec3::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), tilt.cos());
        for azimuth in [0.0, 0.5, FRAC_PI_2, PI] {
            for step in 0..500 {
                let angle = PI * f64::from(step) / 500.0;
                let over_tilt = |angle| albedo_factor(tilted(angle, azimuth), ISS, 1.5);
                let over_sun = |angle| albedo_factor(tilted(1.2, azimuth), ISS, angle);
                assert!((over_tilt(angle + 1e-4) - over_tilt(angle)).abs() < 1.1e-4, "tilt {angle}, {azimuth}");
                assert!((over_sun(angle + 1e-4) - over_sun(angle)).abs() < 1.1e-4, "Sun {angle}, {azimuth}");
            }
        }
    }
}
