//! Tests of band radiance against quadrature.

use super::*;
use crate::thermal::planck::band_radiance_exact;

/// A band given in um.
pub(crate) const fn microns(lower: f64, upper: f64) -> Band {
    Band { lower: lower * 1e-6, upper: upper * 1e-6 }
}

/// The bands of the measurements: common cameras, and narrow, wide and extreme bands in 1 to 50 um.
pub(crate) const BANDS: [Band; 9] = [
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
pub(crate) fn temperatures() -> impl Iterator<Item = f64> {
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

/// A response that rises and falls.
const CURVE: [[f64; 2]; 4] = [[7.0, 0.0], [9.0, 0.6], [10.0, 1.2], [13.0, 0.1]];

#[test]
fn a_flat_response_is_its_band() {
    let flat = Passband::of_response(&[[8.0, 3.0], [9.5, 3.0], [14.0, 3.0]]).unwrap();
    let table = RadianceTable::new(flat);
    for t in [20.0, 77.0, 300.0, 1000.0, 5772.0] {
        let exact = band_radiance_exact(Band { lower: 8e-6, upper: 14e-6 }, t);
        let found = band_radiance(&table, t);
        assert!((found / exact - 1.0).abs() < 2e-8, "{t} K: {found:e} {exact:e}");
    }
}

/// The radiance of a curve by scipy's quad, in tests/oracle/bands.py.
#[test]
fn a_response_agrees_with_scipy() {
    let table = RadianceTable::new(Passband::of_response(&CURVE).unwrap());
    for (t, expected) in include!("../../../tests/oracle/response_radiance.in") {
        let found = band_radiance(&table, t);
        println!("{t} K: {found:e} for {expected:e}");
        assert!((found / expected - 1.0).abs() < 1e-7, "{t} K: {found:e} {expected:e}");
        // Another peak is another share at all other wavelengths, because the largest response counts as 1.
        let mut flatter = CURVE;
        flatter[2][1] = 1.1;
        let other = RadianceTable::new(Passband::of_response(&flatter).unwrap());
        assert!((band_radiance(&other, t) / expected - 1.0).abs() > 1e-3);
    }
}
