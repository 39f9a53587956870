//! Tests of band radiance against quadrature.

use super::*;
use crate::thermal::planck::band_radiance_exact;

/// A band given in um.
pub const fn microns(lower: f64, upper: f64) -> Band {
    Band { lower: lower * 1e-6, upper: upper * 1e-6 }
}

/// The bands of the measurements: common cameras, and narrow, wide and extreme bands in 1 to 50 um.
pub const BANDS: [Band; 9] = [
    microns(8.0, 14.0),
    microns(3.0, 5.0),
    microns(10.3, 11.3),
    microns(49.0, 50.0),
    microns(1.0, 50.0),
    microns(1.0, 1.1),
    microns(1.0, 2.0),
    microns(7.0, 7.001),
    microns(2.0, 40.0),
];

/// Temperatures between the table's points, 30 to 1000 K.
pub fn temperatures() -> impl Iterator<Item = f64> {
    (0..1500).map(|i| 30.0 * (1000.0_f64 / 30.0).powf(f64::from(i) / 1499.0))
}

#[test]
fn table_agrees_with_quadrature() {
    for band in BANDS {
        let table = RadianceTable::new(band);
        let error = |shift: f64| {
            temperatures()
                .map(|t| {
                    let exact = band_radiance_exact(band, t);
                    (band_radiance(&table, t * (1.0 + shift)) / exact - 1.0).abs()
                })
                .fold(0.0, f64::max)
        };
        // Measured: 1e-11 (8-14 um) to 5e-9 (7-7.001 um).
        assert!(error(0.0) < 1e-8, "{band:?}: {:e}", error(0.0));
        assert!(error(1e-8) > 1e-8);
    }
}

#[test]
fn cold_is_zero_and_does_not_overflow() {
    let table = RadianceTable::new(microns(8.0, 14.0));
    assert_eq!(band_radiance(&table, 0.0), 0.0);
    assert_eq!(band_radiance(&table, 1e-3), 0.0);
    let cold = band_radiance(&table, 2.7);
    assert!(cold > 3.5e-165 && cold < 4.5e-165, "L(2.7 K) = 4e-165 (docs/numerics.md 5): {cold:e}");
}

#[test]
fn derivative_is_that_of_the_value() {
    let table = RadianceTable::new(microns(8.0, 14.0));
    for t in [30.0, 200.5, 900.0] {
        let h = 1e-3;
        let difference = (table.ln_scaled(t + h).0 - table.ln_scaled(t - h).0) / (2.0 * h);
        assert!((table.ln_scaled(t).1 / difference - 1.0).abs() < 1e-6);
    }
}
