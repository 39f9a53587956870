//! Fits of data of known origin find the function, t_max, target and parameters.

use super::search::{FitFunction, RATE_WITHOUT_END};
use super::*;
use crate::thermal::function::Function;
use crate::thermal::function::FunctionKind;

fn samples(rows: usize, end: f64, t: impl Fn(f64) -> f64) -> Vec<TemperatureSample> {
    let time = |i: usize| end * i as f64 / (rows - 1) as f64;
    (0..rows).map(|i| TemperatureSample { time: time(i), temperature: t(time(i)) }).collect()
}

/// Noise of about `size` [K] rms, equal in every run (a golden-ratio sequence with a triangular distribution).
fn noise(time: f64, size: f64) -> f64 {
    let hash = |seed: f64| (((time * 12.9898 + seed).sin() * 43_758.545_3).fract() + 1.0).fract();
    (hash(1.0) + hash(2.0) - 1.0) * size * 6f64.sqrt()
}

fn best(samples: &[TemperatureSample], target: Option<f64>) -> Fit {
    fit(samples, target).unwrap().best.swap_remove(0)
}

fn response(shape: &FitFunction, domain: Domain, ends: [f64; 2], s: f64) -> f64 {
    let done = shape.done(s.min(1.0));
    domain.temperature(domain.of(ends[0]) * (1.0 - done) + domain.of(ends[1]) * done)
}

fn numbers(function: &Function) -> Vec<f64> {
    match function {
        Function::Linear | Function::Quadratic => Vec::new(),
        Function::Shaped(shape) => match &shape.kind {
            FunctionKind::Exponential { rate } | FunctionKind::Logarithmic { rate } => vec![*rate],
            FunctionKind::Polynomial(polynomial) => polynomial.coefficients().to_vec(),
            FunctionKind::Table(_) | FunctionKind::Expression(_) => Vec::new(),
        },
    }
}

fn shapes() -> Vec<FitFunction> {
    vec![
        FitFunction::Linear,
        FitFunction::Quadratic,
        FitFunction::Exponential(3.0),
        FitFunction::Logarithmic(8.0),
        FitFunction::Polynomial([0.6, 1.8, -1.4]),
    ]
}

#[test]
fn every_function_is_found_in_its_own_data_in_both_domains() {
    for shape in shapes() {
        let expected = shape.function().unwrap();
        for domain in [Domain::Temperature, Domain::FourthPower] {
            for (ends, t_max) in [([180.0, 310.0], 100.0), ([500.0, 2.7], 37.0)] {
                let data = samples(301, 150.0, |time| response(&shape, domain, ends, time / t_max));
                let computed = best(&data, None);
                let place = format!("{shape:?} {domain:?} {ends:?}: {computed:?}");
                let Fit { response, .. } = &computed;
                assert_eq!((response.domain, response.function.kind_name()), (domain, expected.kind_name()), "{place}");
                assert!((response.t_max / t_max - 1.0).abs() < 1e-4, "{place}");
                assert!((response.target - ends[1]).abs() < 1e-2, "{place}");
                assert!(computed.rms < 1e-4 && computed.max < 1e-3 && !computed.ends_after_data, "{place}");
                let (found, expected) = (numbers(&response.function), numbers(&expected));
                assert_eq!(found.len(), expected.len());
                assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3 * b.abs().max(1.0)), "{place}");
            }
        }
    }
}

#[test]
fn a_response_that_is_a_hundredth_slower_is_not_taken_for_the_same() {
    let data = samples(301, 150.0, |time| {
        response(&FitFunction::Quadratic, Domain::Temperature, [180.0, 310.0], time / 101.0)
    });
    assert!((best(&data, None).response.t_max - 100.0).abs() > 0.5);
}

#[test]
fn noise_does_not_buy_a_function_with_more_numbers() {
    for shape in [FitFunction::Linear, FitFunction::Quadratic, FitFunction::Exponential(3.0)] {
        let clean = |time: f64| response(&shape, Domain::Temperature, [290.0, 190.0], time / 100.0);
        let data = samples(400, 150.0, |time| if time > 0.0 { clean(time) + noise(time, 0.2) } else { clean(time) });
        let found = best(&data, None);
        let Fit { response, .. } = &found;
        assert_eq!(response.function.kind_name(), shape.function().unwrap().kind_name(), "{found:?}");
        assert!((response.t_max - 100.0).abs() < 2.0 && (response.target - 190.0).abs() < 0.2, "{found:?}");
        assert!((found.rms - 0.2).abs() < 0.05, "{found:?}");
    }
}

#[test]
fn an_exponential_without_an_end_gets_its_time_constant_and_asymptote() {
    // Newton's cooling over only three time constants.
    let (tau, end) = (120.0, 210.0);
    let data = samples(181, 360.0, |time| end + 90.0 * (-time / tau).exp());
    let found = best(&data, None);
    assert_eq!(found.response.function.kind_name(), "exponential");
    let rate = numbers(&found.response.function)[0];
    assert!((found.response.t_max / rate / tau - 1.0).abs() < 1e-3, "{found:?}");
    assert!((rate - RATE_WITHOUT_END).abs() < 1e-2 && found.ends_after_data, "{found:?}");
    // The target is where 0.1 % of the way is left.
    assert!((found.response.target - (end + 0.09)).abs() < 0.02, "{found:?}");
    assert!(found.rms < 1e-3);
}

#[test]
fn a_radiating_plate_is_no_function_but_a_table() {
    // dT/dt = -T^4 / (3 tau T0^3), no background: T0 (1 + t/tau)^(-1/3).
    let data = samples(300, 3000.0, |time| 320.0 * (1.0 + time / 400.0).powf(-1.0 / 3.0));
    let fits = fit(&data, None).unwrap().best;
    let rms = |kind: &str| fits.iter().find(|fit| fit.response.function.kind_name() == kind).unwrap().rms;
    assert_eq!(fits[0].response.function.kind_name(), "table");
    assert!(rms("table") < 1e-2 && rms("logarithmic") < 2.0 && rms("linear") > 10.0, "{fits:?}");
    // The proposed table contains all rows.
    assert!(data.iter().all(|row| (fits[0].response.temperature(row.time) - row.temperature).abs() < 1e-9));
}

#[test]
fn a_table_that_stops_short_goes_on_to_a_given_target() {
    // Two lines: only a table has this shape.
    let data = samples(81, 80.0, |time| 300.0 - time.min(20.0) * 2.0 - (time - 20.0).max(0.0) * 0.5);
    let computed = best(&data, Some(220.0));
    assert_eq!(computed.response.function.kind_name(), "table");
    assert!((computed.response.t_max - 100.0).abs() < 1e-6 && computed.ends_after_data, "{computed:?}");
    assert!((computed.response.temperature(90.0) - 225.0).abs() < 1e-6);
}

#[test]
fn a_table_of_noise_is_left_out_with_the_row() {
    let mut data = samples(20, 19.0, |time| 300.0 - time);
    data[7].temperature += 3.0;
    let fits = fit(&data, None).unwrap();
    assert!(fits.left_out[0].0 == "table" && fits.left_out[0].1.contains("row 8"), "{:?}", fits.left_out);
    assert!(fits.best.iter().all(|fit| fit.response.function.kind_name() != "table"));
}

#[test]
fn the_search_follows_the_functions_that_it_proposes() {
    for shape in shapes() {
        let function = shape.function().unwrap();
        for s in [0.0, 0.1, 0.5, 0.9, 1.0] {
            assert!((shape.done(s) - function.done(s)).abs() < 1e-12, "{shape:?} at {s}");
        }
    }
    assert!((FitFunction::Exponential(3.0).done(0.5) - FitFunction::Exponential(3.1).done(0.5)).abs() > 1e-3);
}

#[test]
fn a_line_that_is_still_moving_ends_with_the_data_unless_a_target_is_given() {
    let data = samples(50, 60.0, |time| 200.0 + 0.5 * time);
    let found = best(&data, None);
    assert_eq!(found.response.function, Function::Linear);
    let Fit { response, .. } = &found;
    assert!((response.t_max - 60.0).abs() < 1e-3 && (response.target - 230.0).abs() < 1e-3, "{found:?}");
    let aimed = best(&data, Some(300.0));
    assert_eq!(aimed.response.function, Function::Linear);
    assert!((aimed.response.t_max - 200.0).abs() < 1e-2 && aimed.ends_after_data, "{aimed:?}");
    assert_eq!(aimed.response.target, 300.0);
}

#[test]
fn a_quadratic_that_is_cut_off_is_completed() {
    let data =
        samples(80, 70.0, |time| response(&FitFunction::Quadratic, Domain::Temperature, [100.0, 300.0], time / 100.0));
    let found = best(&data, None);
    assert_eq!(found.response.function, Function::Quadratic);
    let Fit { response, .. } = &found;
    assert!((response.t_max - 100.0).abs() < 0.1 && (response.target - 300.0).abs() < 0.1, "{found:?}");
}

#[test]
fn times_need_not_be_even_nor_start_at_zero() {
    let time = |i: usize| 1000.0 + 0.02 * (i * i) as f64;
    let data: Vec<TemperatureSample> = (0..100)
        .map(|i| TemperatureSample {
            time: time(i),
            temperature: response(
                &FitFunction::Quadratic,
                Domain::Temperature,
                [250.0, 150.0],
                (time(i) - 1000.0) / 90.0,
            ),
        })
        .collect();
    let found = best(&data, None);
    assert_eq!(found.response.function, Function::Quadratic);
    assert!((found.response.t_max - 90.0).abs() < 1e-3, "{found:?}");
}

#[test]
fn data_that_are_no_step_response_are_told() {
    let good = samples(10, 9.0, |time| 200.0 + time);
    assert!(fit(&good, None).is_ok());
    let changed = |change: &dyn Fn(&mut Vec<TemperatureSample>)| {
        let mut data = good.clone();
        change(&mut data);
        fit(&data, None).unwrap_err().to_string()
    };
    assert!(changed(&|data| data[4].time = data[3].time).contains("row 5: time 3 does not lie after 3"));
    assert!(changed(&|data| data[4].temperature = f64::NAN).contains("row 5: temperature is NaN"));
    assert!(changed(&|data| data[4].time = f64::INFINITY).contains("row 5: time is inf"));
    assert!(changed(&|data| data[0].temperature = -1.0).contains("from 0 to 1e6 K"));
    assert!(changed(&|data| data.truncate(5)).contains("5 rows are too few"));
    assert!(changed(&|data| data.clear()).contains("0 rows are too few"));
    assert!(changed(&|data| data.iter_mut().for_each(|row| row.temperature = 250.0)).contains("250 K in every row"));
    for target in [200.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(fit(&good, Some(target)), Err(FitError::Target(_))), "{target}");
    }
    assert!(matches!(fit(&good, Some(100.0)), Err(FitError::Direction { .. })));
}
