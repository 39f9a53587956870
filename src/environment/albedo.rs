//! Albedo of a Lambert planet on a plate of any direction: the exact integral, and a table of it for one tick.
//!
//! Directions are those of the plate's normal in the *planet frame*: x towards the Sun's side at right angles to nadir,
//! z to nadir, y across. Everything here is even in y.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::LazyLock;

use glam::DVec3;

use super::quadrature::GaussLegendre;

/// `albedo_factor` over the directions of a normal, for one Sun zenith angle and one distance.
///
/// A direction d falls at p = (dx, dz) / (|dx| + |dy| + |dz|), in [-1, 1]^2; the grid has `RESOLUTION + 1` values each
/// way, row after row in z, and is read bilinearly. Its creases (p = 0) lie on grid lines.
///
/// A value is the factor of the unit vector along v = (px, 1 - |px| - |pz|, pz), times the length of v. A plate that sees
/// the whole disc has a factor linear in its normal, and so a value linear in p, which a bilinear read gets exactly; the
/// read restores the factor with |dx| + |dy| + |dz|. Beyond |px| + |pz| = 1, where v points to the other side of y = 0,
/// the values continue smoothly as far as a read near that line needs them (one cell) and are 0 further out.
#[derive(Debug, Clone, PartialEq)]
pub struct AlbedoTable {
    /// (RESOLUTION + 1)^2 values, albedo flux over (albedo x solar constant) times the length of v.
    pub values: Vec<f64>,
}

/// Intervals of the table each way; even, so that p = 0 is a grid line.
pub const RESOLUTION: usize = 128;

/// The vector v of a grid point; `None` where no read reaches it.
pub(super) fn grid_direction(column: usize, row: usize) -> Option<DVec3> {
    let half = RESOLUTION / 2;
    if column.abs_diff(half) + row.abs_diff(half) > half + 1 {
        return None;
    }
    let coordinate = |index: usize| (index as f64 - half as f64) / half as f64;
    let (x, z) = (coordinate(column), coordinate(row));
    Some(DVec3::new(x, 1.0 - x.abs() - z.abs(), z))
}

/// `albedo_factor` read from a table; `direction` is a unit normal in the planet frame.
pub fn albedo_table_lookup(table: &AlbedoTable, direction: DVec3) -> f64 {
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

/// Points of the rule on each piece of the angle of incidence: errors below 1e-7 of a unit flux (see the tests).
const INCIDENCE_POINTS: usize = 12;

static INCIDENCE_RULE: LazyLock<GaussLegendre> =
    LazyLock::new(|| GaussLegendre::new(INCIDENCE_POINTS));

/// Flux that a plate receives from a sunlit Lambert planet, over (albedo x solar constant).
///
/// `normal` is the plate's unit normal in the planet frame, `distance_ratio` (> 1) the distance to the planet's centre
/// over its radius, `sun_zenith` the Sun's zenith angle at the point below the craft [rad], in [0, pi].
///
/// It is the integral of cos(Sun's zenith) x cos(plate's angle) / pi over the solid angle of the part of the planet that
/// is at once visible, lit and before the plate. On a ring of equal angle from nadir both cosines are a + b cos(azimuth)
/// and the part where both are positive is at most two arcs, so the ring's integral is in closed form. The rings are
/// taken over the angle of incidence on the surface, 0 at nadir to 90 deg at the limb, which keeps the integrand smooth
/// at the limb; the interval is cut where a ring touches the terminator or the plate's horizon.
pub fn albedo_factor(normal: DVec3, distance_ratio: f64, sun_zenith: f64) -> f64 {
    albedo_factor_with(&INCIDENCE_RULE, normal, distance_ratio, sun_zenith)
}

fn albedo_factor_with(
    rule: &GaussLegendre,
    normal: DVec3,
    distance_ratio: f64,
    sun_zenith: f64,
) -> f64 {
    let plate = Plate::new(normal);
    if plate.tilt >= FRAC_PI_2 + (1.0 / distance_ratio).asin() {
        return 0.0;
    }
    let mut cuts = [
        0.0,
        terminator_incidence(distance_ratio, sun_zenith),
        plate.horizon_incidence(distance_ratio),
        FRAC_PI_2,
    ];
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
            let sun = Cosine {
                mean: cos_ground * cos_sun,
                swing: sin_ground * sin_sun,
                centre: 0.0,
            };
            let sight = Cosine {
                mean: cos_nadir * plate.nadir,
                swing: sin_nadir * plate.across,
                centre: plate.azimuth,
            };
            let solid_angle = sin_nadir * cos_incidence / (distance_ratio * cos_nadir);
            sum += weight * solid_angle * ring(sun, sight);
        }
    }
    sum / PI
}

/// A plate's normal in the planet frame, by its parts.
struct Plate {
    /// Component to nadir.
    nadir: f64,
    /// Component at right angles to nadir.
    across: f64,
    /// Azimuth of the latter from the Sun's side [rad], in [0, pi].
    azimuth: f64,
    /// Angle from nadir [rad], in [0, pi].
    tilt: f64,
}

impl Plate {
    fn new(normal: DVec3) -> Self {
        let across = normal.x.hypot(normal.y);
        Self {
            nadir: normal.z,
            across,
            azimuth: normal.y.abs().atan2(normal.x),
            tilt: across.atan2(normal.z),
        }
    }

    /// Angle of incidence of the ring that touches the plate's own horizon [rad]; 90 deg where none does.
    fn horizon_incidence(&self, distance_ratio: f64) -> f64 {
        let sine = distance_ratio * self.nadir.abs();
        if sine < 1.0 { sine.asin() } else { FRAC_PI_2 }
    }
}

/// Angle of incidence of the ring that touches the terminator [rad]; 90 deg where it lies beyond the limb.
fn terminator_incidence(distance_ratio: f64, sun_zenith: f64) -> f64 {
    let (sin_ground, cos_ground) = (FRAC_PI_2 - sun_zenith).abs().sin_cos();
    if distance_ratio * cos_ground <= 1.0 {
        return FRAC_PI_2;
    }
    let nadir = sin_ground.atan2(distance_ratio - cos_ground);
    (distance_ratio * nadir.sin()).min(1.0).asin()
}

/// mean + swing cos(azimuth - centre), with swing >= 0 and centre in [0, pi].
#[derive(Clone, Copy)]
struct Cosine {
    mean: f64,
    swing: f64,
    centre: f64,
}

impl Cosine {
    /// Half the width of the arc where it is positive [rad], in [0, pi].
    fn half_arc(self) -> f64 {
        if self.mean >= self.swing {
            PI
        } else if self.mean <= -self.swing {
            0.0
        } else {
            (-self.mean / self.swing).acos()
        }
    }
}

/// Integral over the azimuth of the product of two cosines where both are positive; `a` has its centre at 0.
fn ring(a: Cosine, b: Cosine) -> f64 {
    let (half_a, half_b) = (a.half_arc(), b.half_arc());
    if half_a == PI && half_b == PI {
        return TAU * a.mean * b.mean + PI * a.swing * b.swing * b.centre.cos();
    }
    let arc = |start: f64, end: f64| {
        if end <= start {
            return 0.0;
        }
        let (middle, half) = (0.5 * (start + end), 0.5 * (end - start));
        let sin_half = half.sin();
        let off_centre = middle - b.centre;
        2.0 * (half * (a.mean * b.mean + 0.5 * a.swing * b.swing * b.centre.cos())
            + sin_half * (a.swing * b.mean * middle.cos() + a.mean * b.swing * off_centre.cos())
            + 0.5 * sin_half * half.cos() * a.swing * b.swing * (middle + off_centre).cos())
    };
    let direct = arc(
        (-half_a).max(b.centre - half_b),
        half_a.min(b.centre + half_b),
    );
    let around = arc(-half_a, half_a.min(b.centre + half_b - TAU));
    direct + around
}
