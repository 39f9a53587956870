//! Data of known origin are recognised: function, t_max, target and the function's own numbers.

use super::*;

fn samples(rows: usize, end: f64, t: impl Fn(f64) -> f64) -> Vec<Sample> {
    let time = |i: usize| end * i as f64 / (rows - 1) as f64;
    (0..rows).map(|i| Sample { time: time(i), temperature: t(time(i)) }).collect()
}

/// Noise of about `size` [K] rms that is the same in every run (a golden-ratio sequence, made triangular).
fn noise(time: f64, size: f64) -> f64 {
    let hash = |seed: f64| (((time * 12.9898 + seed).sin() * 43_758.545_3).fract() + 1.0).fract();
    (hash(1.0) + hash(2.0) - 1.0) * size * 6f64.sqrt()
}

fn best(samples: &[Sample], target: Option<f64>) -> Fit {
    fit(samples, target).unwrap().swap_remove(0)
}

fn shapes() -> Vec<Shape> {
    vec![
        Shape::Linear,
        Shape::Quadratic,
        Shape::Exponential(3.0),
        Shape::Logarithmic(8.0),
        Shape::Polynomial([0.6, 1.8, -1.4]),
    ]
}

#[test]
fn every_function_is_found_in_its_own_data_in_both_domains() {
    for shape in shapes() {
        for domain in [Domain::T, Domain::T4] {
            for (ends, t_max) in [([180.0, 310.0], 100.0), ([500.0, 2.7], 37.0)] {
                let data = samples(301, 150.0, |time| response(&shape, domain, ends, time / t_max));
                let found = best(&data, None);
                let place = format!("{shape:?} {domain:?} {ends:?}: {found:?}");
                assert_eq!(found.domain, domain, "{place}");
                assert_eq!(std::mem::discriminant(&found.shape), std::mem::discriminant(&shape), "{place}");
                assert!((found.t_max / t_max - 1.0).abs() < 1e-4, "{place}");
                assert!((found.target - ends[1]).abs() < 1e-2, "{place}");
                assert!(found.rms < 1e-4, "{place}");
                assert!(!found.ends_after_data, "{place}");
                match (&found.shape, &shape) {
                    (Shape::Exponential(a), Shape::Exponential(b)) | (Shape::Logarithmic(a), Shape::Logarithmic(b)) => {
                        assert!((a / b - 1.0).abs() < 1e-3, "{place}");
                    }
                    (Shape::Polynomial(a), Shape::Polynomial(b)) => {
                        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3), "{place}");
                    }
                    _ => {}
                }
            }
        }
    }
}

#[test]
fn a_response_that_is_a_hundredth_slower_is_not_taken_for_the_same() {
    let data = samples(301, 150.0, |time| response(&Shape::Quadratic, Domain::T, [180.0, 310.0], time / 101.0));
    assert!((best(&data, None).t_max - 100.0).abs() > 0.5);
}

#[test]
fn noise_does_not_buy_a_function_with_more_numbers() {
    for shape in [Shape::Linear, Shape::Quadratic, Shape::Exponential(3.0)] {
        let clean = |time: f64| response(&shape, Domain::T, [290.0, 190.0], time / 100.0);
        let data = samples(400, 150.0, |time| if time > 0.0 { clean(time) + noise(time, 0.2) } else { clean(time) });
        let found = best(&data, None);
        assert_eq!(std::mem::discriminant(&found.shape), std::mem::discriminant(&shape), "{found:?}");
        assert!((found.t_max - 100.0).abs() < 2.0 && (found.target - 190.0).abs() < 0.2, "{found:?}");
        assert!((found.rms - 0.2).abs() < 0.05, "{found:?}");
    }
}

#[test]
fn an_exponential_without_an_end_gets_its_time_constant_and_asymptote() {
    // Newton's cooling, seen for three time constants only.
    let (tau, end) = (120.0, 210.0);
    let data = samples(181, 360.0, |time| end + 90.0 * (-time / tau).exp());
    let found = best(&data, None);
    let Shape::Exponential(rate) = found.shape else { panic!("{found:?}") };
    assert!((found.t_max / rate / tau - 1.0).abs() < 1e-3, "{found:?}");
    assert!((rate - RATE_WITHOUT_END).abs() < 1e-2 && found.ends_after_data, "{found:?}");
    // The target is where 0.1 % of the way is left.
    assert!((found.target - (end + 0.09)).abs() < 0.02, "{found:?}");
    assert!(found.rms < 1e-3);
}

#[test]
fn a_radiating_plate_is_better_told_in_the_fourth_power_or_not_at_all() {
    // dT/dt = -(T^4 - 2.7^4) / (3 tau T0^3): closed form T0 (1 + t/tau)^(-1/3) where the background is nothing.
    let data = samples(300, 3000.0, |time| 320.0 * (1.0 + time / 400.0).powf(-1.0 / 3.0));
    let fits = fit(&data, None).unwrap();
    assert!(fits[0].rms < 2.0, "{:?}", fits[0]);
    let linear = fits.iter().find(|fit| fit.shape == Shape::Linear).unwrap();
    assert!(linear.rms > 4.0 * fits[0].rms);
}

#[test]
fn a_line_that_is_still_moving_ends_with_the_data_unless_a_target_is_given() {
    let data = samples(50, 60.0, |time| 200.0 + 0.5 * time);
    let found = best(&data, None);
    assert_eq!(found.shape, Shape::Linear);
    assert!((found.t_max - 60.0).abs() < 1e-3 && (found.target - 230.0).abs() < 1e-3, "{found:?}");
    let aimed = best(&data, Some(300.0));
    assert_eq!(aimed.shape, Shape::Linear);
    assert!((aimed.t_max - 200.0).abs() < 1e-2 && aimed.target == 300.0 && aimed.ends_after_data, "{aimed:?}");
}

#[test]
fn a_quadratic_that_is_cut_off_is_completed() {
    let data = samples(80, 70.0, |time| response(&Shape::Quadratic, Domain::T, [100.0, 300.0], time / 100.0));
    let found = best(&data, None);
    assert_eq!(found.shape, Shape::Quadratic);
    assert!((found.t_max - 100.0).abs() < 0.1 && (found.target - 300.0).abs() < 0.1, "{found:?}");
}

#[test]
fn times_need_not_be_even_nor_start_at_zero() {
    let time = |i: usize| 1000.0 + 0.02 * (i * i) as f64;
    let data: Vec<Sample> = (0..100)
        .map(|i| Sample {
            time: time(i),
            temperature: response(&Shape::Quadratic, Domain::T, [250.0, 150.0], (time(i) - 1000.0) / 90.0),
        })
        .collect();
    let found = best(&data, None);
    assert_eq!(found.shape, Shape::Quadratic);
    assert!((found.t_max - 90.0).abs() < 1e-3, "{found:?}");
}

#[test]
fn data_that_are_no_step_response_are_told() {
    let good = samples(10, 9.0, |time| 200.0 + time);
    assert!(fit(&good, None).is_ok());
    let changed = |change: &dyn Fn(&mut Vec<Sample>)| {
        let mut data = good.clone();
        change(&mut data);
        fit(&data, None).unwrap_err().to_string()
    };
    assert!(changed(&|data| data[4].time = data[3].time).contains("row 5: time 3 does not lie after 3"));
    assert!(changed(&|data| data[4].temperature = f64::NAN).contains("row 5: temperature is NaN"));
    assert!(changed(&|data| data[4].time = f64::INFINITY).contains("row 5: time is inf"));
    assert!(changed(&|data| data[0].temperature = -1.0).contains("not below 0 K"));
    assert!(changed(&|data| data.truncate(5)).contains("5 rows are too few"));
    assert!(changed(&|data| data.clear()).contains("0 rows are too few"));
    assert!(changed(&|data| data.iter_mut().for_each(|row| row.temperature = 250.0)).contains("250 K in every row"));
    for target in [200.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(fit(&good, Some(target)), Err(FitError::Target(_))), "{target}");
    }
    assert!(matches!(fit(&good, Some(100.0)), Err(FitError::Direction { .. })));
}
