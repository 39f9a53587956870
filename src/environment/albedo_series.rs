//! The albedo factor of plates in every direction, for one Sun zenith angle and one distance, as a series that few integrals give.

use std::array::from_fn;
use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::albedo::albedo_factor;

/// Terms in the tilt, and in the cosine of the azimuth. With them the largest error of a table is the error of its bilinear reads.
const TILTS: usize = 18;
const AZIMUTHS: usize = 14;
/// Normals whose factors are computed together.
pub(super) const AT_ONCE: usize = 8;

/// `albedo_factor` over the directions of a normal.
///
/// A plate whose plane does not cut the disc of the planet has a factor that is linear in its normal, or 0. In between stands a series of Chebyshev
/// polynomials in the tilt, as a share of the disc's angular radius from 90 deg, and in the cosine of the azimuth from the Sun's side. The factor is smooth there: the
/// edge of the disc gives it a term in the 5/2 power of the tilt at both ends, where Chebyshev nodes are dense.
pub(super) struct AlbedoSeries {
    /// Angular radius of the planet [rad].
    radius: f64,
    /// Factor of a plate that sees the whole disc, per component of its normal towards the Sun's side and to nadir.
    whole: [f64; 2],
    /// `TILTS` rows of `AZIMUTHS` coefficients.
    coefficients: Vec<f64>,
}

impl AlbedoSeries {
    /// Computes the series from some 250 integrals. The parameters are as for [`albedo_factor`].
    pub(super) fn new(distance_ratio: f64, sun_zenith: f64) -> Self {
        let exact = |tilt: f64, cosine: f64| {
            let across = tilt.sin();
            let normal = DVec3::new(across * cosine, across * (1.0 - cosine * cosine).sqrt(), tilt.cos());
            albedo_factor(normal, distance_ratio, sun_zenith)
        };
        let radius = distance_ratio.recip().asin();
        let nadir = exact(0.0, 1.0);
        let (sine, cosine) = (FRAC_PI_2 - radius).sin_cos();
        let sunward = if sine > 0.0 { (exact(FRAC_PI_2 - radius, 1.0) - nadir * cosine) / sine } else { 0.0 };

        // One after another: a table is made under a lock, and a thread that waits for others there takes up work that needs the same table.
        let values: Vec<f64> = (0..TILTS * AZIMUTHS)
            .map(|index| {
                let tilt = FRAC_PI_2 + radius * chebyshev_node(TILTS, index / AZIMUTHS);
                exact(tilt, chebyshev_node(AZIMUTHS, index % AZIMUTHS))
            })
            .collect();
        let mut coefficients = vec![0.0; TILTS * AZIMUTHS];
        for (index, value) in values.iter().enumerate() {
            let tilts = node_shares::<TILTS>(index / AZIMUTHS);
            let azimuths = node_shares::<AZIMUTHS>(index % AZIMUTHS);
            for (row, tilt) in coefficients.chunks_exact_mut(AZIMUTHS).zip(tilts) {
                for (coefficient, azimuth) in row.iter_mut().zip(azimuths) {
                    *coefficient += value * tilt * azimuth;
                }
            }
        }
        Self { radius, whole: [sunward, nadir], coefficients }
    }

    /// The factors of unit normals in the planet frame. The sums of several are formed side by side, each in the order of the series: a sum alone waits for
    /// each of its additions.
    pub(super) fn factors(&self, normals: &[DVec3; AT_ONCE]) -> [f64; AT_ONCE] {
        let across = normals.map(|normal| normal.x.hypot(normal.y));
        let place: [f64; AT_ONCE] = from_fn(|one| (across[one].atan2(normals[one].z) - FRAC_PI_2) / self.radius);
        let azimuth = from_fn(|one| if across[one] > 0.0 { normals[one].x / across[one] } else { 1.0 });
        let tilts = chebyshev_polynomials::<TILTS, AT_ONCE>(place);
        let azimuths = chebyshev_polynomials::<AZIMUTHS, AT_ONCE>(azimuth);
        let mut sums = [0.0; AT_ONCE];
        for (row, tilt) in self.coefficients.chunks_exact(AZIMUTHS).zip(&tilts) {
            let mut of_row = [0.0; AT_ONCE];
            for (coefficient, azimuth) in row.iter().zip(&azimuths) {
                (0..AT_ONCE).for_each(|one| of_row[one] += coefficient * azimuth[one]);
            }
            (0..AT_ONCE).for_each(|one| sums[one] += tilt[one] * of_row[one]);
        }
        from_fn(|one| match place[one] {
            1.0.. => 0.0,
            ..=-1.0 => self.whole[0] * normals[one].x + self.whole[1] * normals[one].z,
            _ => sums[one].max(0.0),
        })
    }
}

/// A zero of the Chebyshev polynomial of degree `count`.
fn chebyshev_node(count: usize, index: usize) -> f64 {
    (PI * (index as f64 + 0.5) / count as f64).cos()
}

/// The Chebyshev polynomials of degrees 0 to N - 1 at each `x`.
fn chebyshev_polynomials<const N: usize, const M: usize>(x: [f64; M]) -> [[f64; M]; N] {
    let mut values = [[1.0; M]; N];
    values[1] = x;
    for degree in 2..N {
        values[degree] = from_fn(|one| 2.0 * x[one] * values[degree - 1][one] - values[degree - 2][one]);
    }
    values
}

/// What the value at one of N nodes adds to each coefficient of a series.
fn node_shares<const N: usize>(index: usize) -> [f64; N] {
    let values = chebyshev_polynomials::<N, 1>([chebyshev_node(N, index)]);
    let mut shares = values.map(|[value]| 2.0 / N as f64 * value);
    shares[0] *= 0.5;
    shares
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    /// Largest error over the planet's share of the sky, 1 / `distance_ratio`^2, for the Sun at many zenith angles. Every other normal lies near the tilts whose plane cuts the disc.
    fn worst(distance_ratio: f64, shift: f64) -> f64 {
        let part = |index: u32, count: u32| (f64::from(index) + 0.37) / f64::from(count);
        let radius = distance_ratio.recip().asin();
        let of_sun = |number: u32| {
            let sun_zenith = PI * part(number, 24);
            let series = AlbedoSeries::new(distance_ratio, sun_zenith + shift);
            let error = |index: u32| {
                let reach = if index.is_multiple_of(2) { 1.2 * radius } else { FRAC_PI_2 };
                let tilt = (FRAC_PI_2 + reach * (2.0 * part(index / 41, 97) - 1.0)).clamp(0.0, PI);
                let azimuth = PI * part(index % 41, 41);
                let normal = DVec3::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), tilt.cos());
                (series.factors(&[normal; AT_ONCE])[0] - albedo_factor(normal, distance_ratio, sun_zenith)).abs()
            };
            (0..97 * 41).map(error).fold(0.0, f64::max)
        };
        (0..24).into_par_iter().map(of_sun).reduce(|| 0.0, f64::max) * distance_ratio.powi(2)
    }

    #[test]
    fn the_series_is_the_integral_at_any_distance() {
        for ratio in [1.0 + 1e-5, 1.001, 1.0 + 100.0 / 6371.0, 1.0 + 408.0 / 6371.0, 1.2, 2.0, 6.617, 1e3, 1e6] {
            let found = worst(ratio, 0.0);
            println!("distance {ratio}: largest error of the series {found:.1e} of the planet's share of the sky");
            assert!(found < 1e-5, "{ratio}: {found:e}");
            assert!(worst(ratio, 0.01) > 1e-3, "{ratio}: another Sun is seen");
        }
    }
}
