//! Band radiance and its inverse on the device against Planck's law by quadrature.

use isotherm::internals::{
    Band, BrightnessTable, MAX_TEMPERATURE, RadianceTable, band_radiance_exact, band_radiances, brightness_temperatures,
};

use super::device::{Worst, assert_silent, context};
use super::random::Random;

/// Bands of cameras, the narrowest, widest and shortest within 1 to 50 um, and some unusual ones.
const BANDS_UM: [[f64; 2]; 15] = [
    [8.0, 14.0],
    [3.0, 5.0],
    [10.3, 11.3],
    [49.0, 50.0],
    [1.0, 50.0],
    [1.0, 1.1],
    [7.5, 13.5],
    [14.0, 16.0],
    [1.7, 2.3],
    [4.26, 4.27],
    [20.0, 50.0],
    [9.99, 10.0],
    [1.0, 2.0],
    [7.0, 7.001],
    [2.0, 40.0],
];

/// 30 to 1000 K, evenly spread over the logarithm with small random shifts.
fn temperatures() -> Vec<f32> {
    let mut random = Random(31);
    let count = 3000;
    let mut all: Vec<f32> = (0..count)
        .map(|i| {
            (30.0 * (1000.0_f64 / 30.0).powf((f64::from(i) + random.between(0.0, 0.999)) / f64::from(count))) as f32
        })
        .collect();
    all.extend([30.0, 300.0, 1000.0]);
    all
}

#[test]
fn radiance_agrees_with_plancks_law() {
    let context = context();
    for [lower, upper] in BANDS_UM {
        let band = Band { lower: lower * 1e-6, upper: upper * 1e-6 };
        let table = RadianceTable::new(band);
        let temperatures = temperatures();
        let found = band_radiances(&context, &table, &BrightnessTable::new(&table), &temperatures).expect("the device");
        let difference = |shift: f64| {
            let mut worst = Worst::none();
            for (temperature, radiance) in temperatures.iter().zip(&found) {
                let exact = band_radiance_exact(band, f64::from(*temperature) * (1.0 + shift));
                if exact >= f64::from(f32::MIN_POSITIVE) {
                    worst.see(f64::from(*radiance) / exact, 1.0, || format!("{temperature} K"));
                }
            }
            worst
        };
        difference(0.0).within(5e-6, "relative", &format!("radiance in {lower} to {upper} um"));
        assert!(difference(2e-5).difference > 2e-5, "a temperature off by 6 mK at 300 K must show");
    }
    assert_silent(&context);
}

#[test]
fn the_inverse_gives_the_temperature_back() {
    let context = context();
    for [lower, upper] in BANDS_UM {
        let band = Band { lower: lower * 1e-6, upper: upper * 1e-6 };
        let table = RadianceTable::new(band);
        let guesses = BrightnessTable::new(&table);
        // The radiance is rounded to f32 first, as in an image. This rounding affects the result.
        let (kept, radiances): (Vec<f32>, Vec<f32>) = temperatures()
            .into_iter()
            .map(|temperature| (temperature, band_radiance_exact(band, f64::from(temperature)) as f32))
            .filter(|(_, radiance)| *radiance > f32::MIN_POSITIVE)
            .unzip();
        let difference = |gain: f32| {
            let scaled: Vec<f32> = radiances.iter().map(|radiance| radiance * gain).collect();
            let found = brightness_temperatures(&context, &table, &guesses, &scaled).expect("the device");
            let as_f64 = |values: &[f32]| values.iter().map(|value| f64::from(*value)).collect::<Vec<_>>();
            Worst::of(&as_f64(&found), &as_f64(&kept), |index| format!("{} W m-2 sr-1", radiances[index]))
        };
        difference(1.0).within(1e-3, "K", &format!("brightness temperature in {lower} to {upper} um"));
        assert!(difference(1.001).difference > 2e-3, "a thousandth more radiance must show");
    }
    assert_silent(&context);
}

#[test]
fn the_inverse_holds_from_the_floor_to_the_ceiling() {
    let context = context();
    for [lower, upper] in BANDS_UM {
        let band = Band { lower: lower * 1e-6, upper: upper * 1e-6 };
        let table = RadianceTable::new(band);
        let guesses = BrightnessTable::new(&table);
        let (low, high) = (guesses.min_temperature * 1.001, MAX_TEMPERATURE * 0.999);
        let temperatures: Vec<f64> = (0..500).map(|i| low * (high / low).powf(f64::from(i) / 499.0)).collect();
        let radiances: Vec<f32> = temperatures.iter().map(|t| band_radiance_exact(band, *t) as f32).collect();
        let found = brightness_temperatures(&context, &table, &guesses, &radiances).expect("the device");
        for (inverse, t) in found.iter().zip(&temperatures) {
            assert!((f64::from(*inverse) / t - 1.0).abs() < 3e-6, "{lower} to {upper} um: {t} K gives {inverse} K");
        }
    }
    assert_silent(&context);
}

#[test]
fn cold_and_hot_ends() {
    let context = context();
    let table = RadianceTable::new(Band { lower: 8e-6, upper: 14e-6 });
    let guesses = BrightnessTable::new(&table);
    // docs/numerics.md 5: 54.93346, 31.36853 and 2.95681 W m-2 sr-1; L(2.7 K) = 4e-165 is 0 in f32.
    let found =
        band_radiances(&context, &table, &guesses, &[300.0, 267.0, 180.0, 2.7, 0.0, 1e-30]).expect("the device");
    for (radiance, expected) in found.iter().zip([54.933_46, 31.368_53, 2.956_81]) {
        assert!((f64::from(*radiance) / expected - 1.0).abs() < 2e-6, "{radiance} against {expected}");
    }
    assert_eq!(found[3..], [0.0, 0.0, 0.0]);
    assert!((f64::from(found[0]) / 54.934_0 - 1.0).abs() > 2e-6);
    // The whole domain of the inverse, from the least normal f32 to the table's hottest.
    let ends = [f32::MIN_POSITIVE, guesses.max_radiance as f32 * 0.999_999];
    let found = brightness_temperatures(&context, &table, &guesses, &ends).expect("the device");
    assert!((f64::from(found[0]) - guesses.min_temperature).abs() < 2e-3, "{}", found[0]);
    assert!((f64::from(found[1]) - 20_000.0).abs() < 0.1, "{}", found[1]);
}
