//! Tests of the sensor in time: lag and shutter.

use super::*;

/// A sensor with nothing but 14 bits from 200 to 400 K.
pub(crate) fn plain() -> Sensor {
    Sensor { seed: 7, ..Sensor::ideal(14, [200.0, 400.0]) }
}

#[test]
fn the_lag_is_the_same_however_an_interval_is_divided() {
    let whole = decay(Some(0.012), Some(0.05));
    let parts = decay(Some(0.012), Some(0.02)) * decay(Some(0.012), Some(0.03));
    assert!((whole - parts).abs() < 1e-15 && (whole - (-0.05f64 / 0.012).exp()).abs() < 1e-15);
    assert_ne!(whole, decay(Some(0.013), Some(0.05)));
    assert_eq!([decay(None, Some(1.0)), decay(Some(1.0), None), decay(Some(1.0), Some(0.0))], [0.0; 3]);
}

#[test]
fn a_shutter_closes_at_whole_intervals() {
    let pattern = Pattern { offset: 0.1, gain: 0.0, drift: 0.0, interval: Some(60.0), shutter: 300.0 };
    let sensor = Sensor { pattern: Some(pattern), ..plain() };
    let at = |time| (sensor.exposure(time, None).shutter, sensor.exposure(time, None).age);
    assert_eq!([at(0.0), at(59.0), at(60.0), at(150.5)], [(0, 0.0), (0, 59.0), (1, 0.0), (2, 30.5)]);
    let never = Sensor { pattern: Some(Pattern { interval: None, ..pattern }), ..plain() };
    assert_eq!((never.exposure(150.5, None).shutter, never.exposure(150.5, None).age), (0, 150.5));
}
