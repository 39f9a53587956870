//! Tests of the sensor in time: lag and shutter.

use super::*;

/// A sensor with nothing but 14 bits from 200 to 400 K.
pub(crate) fn plain() -> Sensor {
    Sensor { seed: 7, ..Sensor::ideal(14, [200.0, 400.0]) }
}

/// The state of a bolometer after images at these times of a signal.
fn state_after(constant: f64, times: &[f64], signal: impl Fn(f64) -> f64) -> f64 {
    let mut state = signal(times[0]);
    for pair in times.windows(2) {
        let (decay, behind) = lag(Some(constant), Some(pair[1] - pair[0]));
        let [before, now] = [pair[0], pair[1]].map(&signal);
        state = now + (state - before) * decay - (now - before) * behind;
    }
    state
}

/// y = r (t - tau) of a ramp, however the time is divided, and exponential from where it begins: r (t - tau (1 - exp(-t / tau))).
#[test]
fn a_ramp_is_behind_by_the_time_constant() {
    let (constant, rate) = (0.01, 20.0);
    let exact = |time: f64| rate * (time - constant * (1.0 - (-time / constant).exp()));
    for times in [vec![0.0, 0.05], (0..=3).map(|i| f64::from(i) / 60.0).collect(), vec![0.0, 0.004, 0.02, 0.05]] {
        let state = state_after(constant, &times, |time| rate * time);
        let exact = exact(times[times.len() - 1]);
        assert!((state - exact).abs() < 1e-12, "{times:?}: {state} and {exact}");
        assert!((state_after(0.011, &times, |time| rate * time) - exact).abs() > 1e-3, "another constant shows");
    }
    // What is left of a step falls exponentially.
    let step = |times: &[f64]| 1.0 - state_after(constant, times, |time| f64::from(u8::from(time > 0.0)));
    assert!((step(&[0.0, 0.004, 0.012]) / step(&[0.0, 0.004]) - (-0.8f64).exp()).abs() < 1e-12);
    assert_eq!([lag(None, Some(1.0)), lag(Some(1.0), None), lag(Some(1.0), Some(0.0))], [(0.0, 0.0); 3]);
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
