//! Eclipse by the planet: the lit fraction of the Sun's disc, and the times of contact.
//!
//! Sun and planet are spheres at finite distances with the apparent radii asin(radius / distance). Atmosphere, flattening and limb darkening are left out.

use std::f64::consts::PI;

use glam::DVec3;

use super::orbit::SUN_RADIUS;

/// Apparent discs of Sun and planet, as seen from the craft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Discs {
    /// Angle between the two centres [rad].
    pub(crate) separation: f64,
    /// Apparent radius of the Sun [rad].
    pub(crate) sun: f64,
    /// Apparent radius of the planet [rad].
    pub(crate) planet: f64,
}

impl Discs {
    /// The discs that a craft sees. `craft` and `sun` are positions from the planet's centre [m] in one frame. The craft is outside the
    /// planet of radius `planet_radius` [m].
    pub(crate) fn seen_from(craft: DVec3, sun: DVec3, planet_radius: f64) -> Self {
        let to_sun = sun - craft;
        let to_planet = -craft;
        Self {
            separation: to_sun.cross(to_planet).length().atan2(to_sun.dot(to_planet)),
            sun: (SUN_RADIUS / to_sun.length()).min(1.0).asin(),
            planet: (planet_radius / craft.length()).min(1.0).asin(),
        }
    }

    /// Distance of the discs from outer tangency [rad], negative in penumbra and umbra.
    pub(crate) fn outer_gap(&self) -> f64 {
        self.separation - (self.planet + self.sun)
    }

    /// Distance of the discs from inner tangency [rad], negative where one disc covers the other (umbra, or annular eclipse).
    pub(crate) fn inner_gap(&self) -> f64 {
        self.separation - (self.planet - self.sun).abs()
    }

    /// Share of the Sun's disc that the planet leaves visible, in [0, 1].
    ///
    /// The discs are projected stereographically about the Sun's centre, where circles remain circles. The curvature of a limb that fills half the sky is
    /// then right. Planar discs with the angular radii would err by 5e-4 in low orbits. The scale of the projection changes by only 1e-5 over the Sun.
    pub(crate) fn lit_fraction(&self) -> f64 {
        if self.outer_gap() >= 0.0 {
            return 1.0;
        }
        if self.inner_gap() <= 0.0 {
            return if self.planet >= self.sun { 0.0 } else { 1.0 - (self.planet / self.sun).powi(2) };
        }
        let sun = 2.0 * (0.5 * self.sun).tan();
        let near_limb = 2.0 * (0.5 * (self.separation - self.planet)).tan();
        let far_limb = 2.0 * (0.5 * (self.separation + self.planet).min(PI)).tan();
        let planet = 0.5 * (far_limb - near_limb);
        (1.0 - lens_area(sun, planet, near_limb) / (PI * sun * sun)).clamp(0.0, 1.0)
    }
}

/// Common area of two discs that cross. One has radius `a` about the origin. The other has radius `b` and spans [`near_edge`, `near_edge`
/// + 2b] on the X axis.
///
/// The angles of the triangle of centres and crossing come from the half-angle formula. Written with `near_edge` instead of the distance
/// of the centres, no factor loses digits however large `b` is (Kahan, "Miscalculating area and angles of a needle-like triangle").
fn lens_area(a: f64, b: f64, near_edge: f64) -> f64 {
    let around = a + 2.0 * b + near_edge;
    let over_distance = a - near_edge;
    let over_a = 2.0 * b + near_edge - a;
    let over_b = a + near_edge;
    let half_angle = |opposite: f64, adjacent: f64| {
        2.0 * (over_distance * adjacent).max(0.0).sqrt().atan2((around * opposite).max(0.0).sqrt())
    };
    let segment = |radius: f64, angle: f64| radius * radius * (angle - angle.sin() * angle.cos());
    segment(a, half_angle(over_b, over_a)) + segment(b, half_angle(over_a, over_b))
}

/// The time in [`start`, `end`] at which a continuous function changes sign, to [`CONTACT_TOLERANCE`], by bisection. `None` where its
/// signs at the ends agree.
pub(crate) fn sign_change(function: impl Fn(f64) -> f64, start: f64, end: f64) -> Option<f64> {
    let (mut low, mut high) = (start, end);
    let negative_at_low = function(low) < 0.0;
    if (function(high) < 0.0) == negative_at_low {
        return None;
    }
    while high - low > CONTACT_TOLERANCE {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if (function(middle) < 0.0) == negative_at_low {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(0.5 * (low + high))
}

/// Length of the bracket at which bisection ends [s].
pub(crate) const CONTACT_TOLERANCE: f64 = 1e-8;

#[cfg(test)]
mod tests {
    use super::super::orbit::SUN_DISTANCE;
    use super::*;

    const RADIUS: f64 = 6.371e6;

    /// A craft at a distance [m] that sees the centres of planet and Sun apart by an angle [rad].
    fn at(distance: f64, separation: f64) -> Discs {
        let craft = DVec3::X * distance;
        let direction = DVec3::new(-separation.cos(), separation.sin(), 0.0);
        Discs::seen_from(craft, craft + direction * SUN_DISTANCE, RADIUS)
    }

    /// The lit fraction by counting the points of the Sun's disc that lie outside the planet's cone.
    fn counted(discs: &Discs) -> f64 {
        const POINTS: usize = 400_000;
        let golden = PI * (3.0 - 5.0_f64.sqrt());
        let planet = DVec3::new(discs.separation.sin(), 0.0, discs.separation.cos());
        let outside = (0..POINTS).filter(|&index| {
            let share = (index as f64 + 0.5) / POINTS as f64;
            let cos = 1.0 - share * 2.0 * (0.5 * discs.sun).sin().powi(2);
            let sin = (1.0 - cos * cos).sqrt();
            let (across, along) = (golden * index as f64).sin_cos();
            DVec3::new(sin * along, sin * across, cos).dot(planet) < discs.planet.cos()
        });
        outside.count() as f64 / POINTS as f64
    }

    #[test]
    fn lit_fraction_agrees_with_counted_points_from_low_orbit_to_beyond_the_umbra() {
        for distance in [RADIUS * 1.000_1, RADIUS + 224e3, RADIUS + 772e3, 4.2e7, 1e9, 2e9] {
            let planet = (RADIUS / distance).asin();
            let sun = SUN_RADIUS / SUN_DISTANCE;
            for step in -9..=9 {
                let discs = at(distance, (planet + sun * 0.11 * f64::from(step)).abs());
                let (computed, expected) = (discs.lit_fraction(), counted(&discs));
                assert!((computed - expected).abs() < 1e-4, "{distance} m, step {step}: {computed} against {expected}");
            }
        }
    }

    #[test]
    fn planar_discs_with_angular_radii_would_be_seen() {
        let discs = at(RADIUS + 224e3, (RADIUS / (RADIUS + 224e3)).asin());
        let planar =
            1.0 - lens_area(discs.sun, discs.planet, discs.separation - discs.planet) / (PI * discs.sun * discs.sun);
        assert!((planar - counted(&discs)).abs() > 2e-4, "{planar}");
    }

    #[test]
    fn lit_fraction_at_the_extremes() {
        let low = RADIUS + 224e3;
        assert_eq!(at(low, PI).lit_fraction(), 1.0);
        assert_eq!(at(low, 0.0).lit_fraction(), 0.0);
        let beyond_the_umbra = at(2e9, 0.0);
        let ratio = beyond_the_umbra.planet / beyond_the_umbra.sun;
        assert!((beyond_the_umbra.lit_fraction() - (1.0 - ratio * ratio)).abs() < 1e-12 && ratio < 0.7);
        for distance in [RADIUS * (1.0 + 1e-9), low, 4.2e7, 2e9] {
            let Discs { sun, planet, .. } = at(distance, 1.0);
            let mut previous = 0.0;
            for step in 0..=2000 {
                let separation = (planet - 1.05 * sun + sun * 2.1e-3 * f64::from(step)).max(0.0);
                let lit = Discs { separation, sun, planet }.lit_fraction();
                assert!(
                    (previous..=1.0).contains(&lit) || (lit - previous).abs() < 1e-9,
                    "{distance} m, {step}: {lit}"
                );
                previous = lit;
            }
            assert_eq!(previous, 1.0);
        }
    }

    #[test]
    fn a_sign_change_is_bracketed() {
        let computed = sign_change(|time| (time - 123.456_789) * 3.0, 100.0, 200.0).unwrap();
        assert!((computed - 123.456_789).abs() < CONTACT_TOLERANCE);
        assert_eq!(sign_change(|time| time + 1.0, 0.0, 5.0), None);
        let far = sign_change(|time| 1e12 + 0.3 - time, 1e12, 1e12 + 60.0).unwrap();
        assert!((far - 1e12 - 0.3).abs() < 1e-3);
    }

    /// Position at `time` by a degree-7 Lagrange polynomial through the eight rows nearest to it.
    fn interpolate(rows: &[(f64, DVec3, DVec3)], time: f64) -> (DVec3, DVec3) {
        let step = rows[1].0 - rows[0].0;
        let first = ((time / step) as usize).saturating_sub(3).min(rows.len() - 8);
        let rows = &rows[first..first + 8];
        let mut sum = (DVec3::ZERO, DVec3::ZERO);
        for (i, row) in rows.iter().enumerate() {
            let others = rows.iter().enumerate().filter(|&(j, _)| j != i);
            let weight: f64 = others.map(|(_, other)| (time - other.0) / (row.0 - other.0)).product();
            sum = (sum.0 + row.1 * weight, sum.1 + row.2 * weight);
        }
        sum
    }

    /// Contacts of a real orbit, computed with SGP4 and DE421 by skyfield (`shared/data/orbit`).
    #[test]
    fn contacts_of_the_iss_agree_with_a_published_ephemeris() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/orbit");
        let (Ok(orbit), Ok(events)) = (
            std::fs::read_to_string(folder.join("iss_gcrs_sun_60s.csv")),
            std::fs::read_to_string(folder.join("iss_eclipse_20231029_24h.csv")),
        ) else {
            println!("skipped: ../shared/data absent");
            return;
        };
        let numbers = |line: &str| line.split(',').map(|cell| cell.parse().ok()).collect::<Option<Vec<f64>>>();
        let rows: Vec<_> = orbit
            .lines()
            .filter_map(numbers)
            .map(|row| (row[0], DVec3::from_slice(&row[1..4]) * 1e3, DVec3::from_slice(&row[4..7]) * 1e3))
            .collect();
        assert!(rows.len() > 1000);

        let mut compared = 0;
        for line in events.lines().filter(|line| line.starts_with('6')) {
            let cells: Vec<&str> = line.split(',').collect();
            let (radius, time) = (cells[0].parse::<f64>().unwrap() * 1e3, cells[3].parse::<f64>().unwrap());
            let gap = |time| {
                let (craft, sun) = interpolate(&rows, time);
                let discs = Discs::seen_from(craft, sun, radius);
                if cells[1] == "umbra" { discs.inner_gap() } else { discs.outer_gap() }
            };
            let computed = sign_change(gap, time - 20.0, time + 20.0).unwrap();
            assert!((computed - time).abs() < 0.01, "{line}: {computed}");
            assert_eq!(gap(time - 1.0) > gap(time + 1.0), cells[2] == "entry", "{line}");
            compared += 1;
        }
        assert!(compared >= 100, "{compared} contacts");
    }
}
