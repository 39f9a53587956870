//! A response function that is a polynomial of any degree, proved to increase from 0 to 1.

use super::error::FunctionError;

/// Largest error of f(0) and f(1). The sum is then scaled to meet 0 and 1.
const END_TOLERANCE: f64 = 1e-6;
/// Most negative rate that counts as rounding, in units of the largest term.
const RATE_TOLERANCE: f64 = 1e-13;
/// Largest difference between the two forms of the sum, caused by cancellation of its terms.
const CANCELLATION: f64 = 1e-9;

/// Most coefficients of a polynomial. The cost of the proof grows with the cube of their number, and f64 can not hold the terms of much higher degrees.
const MAX_COEFFICIENTS: usize = 64;

/// f(s) = c0 + c1 s + c2 s^2 + ...
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Polynomial {
    coefficients: Vec<f64>,
    /// Coefficients of w in powers of r = 1 - s. The first is 0, so w is exact at the end.
    left: Vec<f64>,
}

/// Largest coefficient. Far below it the coefficients of a response function already cancel.
const LARGEST: f64 = 1e12;

impl Polynomial {
    /// Checks the ends, and that the rate is positive at its own extrema. The polynomial then increases everywhere.
    pub(super) fn new(coefficients: &[f64]) -> Result<Self, FunctionError> {
        let function = "polynomial";
        if coefficients.len() > MAX_COEFFICIENTS {
            return Err(FunctionError::TooManyCoefficients { rows: coefficients.len(), most: MAX_COEFFICIENTS });
        }
        if coefficients.iter().any(|c| !(-LARGEST..=LARGEST).contains(c))
            || coefficients.iter().skip(1).all(|c| *c == 0.0)
        {
            return Err(FunctionError::Coefficients);
        }
        let end: f64 = coefficients.iter().sum();
        for (s, wanted, value) in [(0.0, 0.0, coefficients[0]), (1.0, 1.0, end)] {
            if (value - wanted).abs() > END_TOLERANCE {
                return Err(FunctionError::End { function, s, wanted, value });
            }
        }
        let mut left: Vec<f64> = about_the_end(coefficients).into_iter().map(|c| -c).collect();
        left[0] = 0.0;
        let start: f64 = left.iter().sum();
        for c in &mut left {
            *c /= start;
        }
        let polynomial = Self { coefficients: coefficients.to_vec(), left };
        let rates = derivative(&polynomial.left);
        let scale = rates.iter().fold(0.0f64, |scale, c| scale.max(c.abs()));
        let turns = roots(&derivative(&rates));
        for r in [1.0, 0.0].into_iter().chain(turns) {
            let (left, rate) = (horner(&polynomial.left, r), horner(&rates, r));
            if rate < -RATE_TOLERANCE * scale {
                return Err(FunctionError::Falls { function, s: 1.0 - r, value: 1.0 - left, rate });
            }
        }
        for step in 0..=64 {
            let s = f64::from(step) / 64.0;
            let value = horner(&polynomial.left, 1.0 - s);
            if (1.0 - value - horner(coefficients, s)).abs() > CANCELLATION + 2.0 * END_TOLERANCE {
                return Err(FunctionError::Cancels { s });
            }
        }
        Ok(polynomial)
    }

    /// c0, c1, ... as given.
    pub(crate) fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    pub(super) fn remaining(&self, r: f64) -> f64 {
        horner(&self.left, r).clamp(0.0, 1.0)
    }
}

fn horner(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

fn derivative(coefficients: &[f64]) -> Vec<f64> {
    coefficients.iter().enumerate().skip(1).map(|(power, c)| power as f64 * c).collect()
}

/// The polynomial of s in powers of r = 1 - s: synthetic division by s - 1, with the sign of odd powers changed.
fn about_the_end(coefficients: &[f64]) -> Vec<f64> {
    let mut shifted = coefficients.to_vec();
    let degree = shifted.len() - 1;
    for start in 0..degree {
        for i in (start..degree).rev() {
            shifted[i] += shifted[i + 1];
        }
    }
    for c in shifted.iter_mut().skip(1).step_by(2) {
        *c = -*c;
    }
    shifted
}

/// Real roots in (0, 1) at which the sign changes, in rising order. Between neighbouring extrema there is at most one.
fn roots(coefficients: &[f64]) -> Vec<f64> {
    if coefficients.len() < 2 {
        return Vec::new();
    }
    let mut borders = vec![0.0];
    borders.extend(roots(&derivative(coefficients)));
    borders.push(1.0);
    borders
        .windows(2)
        .filter_map(|pair| {
            let (mut low, mut high) = (pair[0], pair[1]);
            let sign = horner(coefficients, low).signum();
            if sign == horner(coefficients, high).signum() {
                return None;
            }
            while high - low > f64::EPSILON {
                let middle = 0.5 * (low + high);
                if middle <= low || middle >= high {
                    break;
                }
                if horner(coefficients, middle).signum() == sign { low = middle } else { high = middle }
            }
            Some(0.5 * (low + high))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_found() {
        // (x - 0.25)(x - 0.5)(x - 0.75)
        let cubic = [-0.09375, 0.6875, -1.5, 1.0];
        let computed = roots(&cubic);
        assert_eq!(computed.len(), 3);
        assert!(computed.iter().zip([0.25, 0.5, 0.75]).all(|(a, b)| (a - b).abs() < 1e-14), "{computed:?}");
        assert!(roots(&[1.0, 0.0, 1.0]).is_empty());
    }

    #[test]
    fn powers_about_the_end_are_the_same_polynomial() {
        let c = [0.0, 0.5, 1.5, -1.0];
        let shifted = about_the_end(&c);
        for s in [0.0, 0.3, 0.7, 1.0] {
            assert!((horner(&c, s) - horner(&shifted, 1.0 - s)).abs() < 1e-15);
        }
    }

    #[test]
    fn a_polynomial_that_turns_back_is_refused_where_it_does() {
        // f = 3s - 4s^2 + 2s^3: f' = 3 - 8s + 6s^2 has its least value 0.333 at s = 2/3, so f increases.
        assert!(Polynomial::new(&[0.0, 3.0, -4.0, 2.0]).is_ok());
        // f = 4s - 6s^2 + 3s^3: f' = 4 - 12s + 9s^2 = (2 - 3s)^2 is 0 at 2/3, so f does not decrease.
        assert!(Polynomial::new(&[0.0, 4.0, -6.0, 3.0]).is_ok());
        // f = 4.1s - 6.3s^2 + 3.2s^3: f' = 4.1 - 12.6s + 9.6s^2 has its least value -0.034375 at s = 0.65625.
        let Err(FunctionError::Falls { s, rate, .. }) = Polynomial::new(&[0.0, 4.1, -6.3, 3.2]) else {
            panic!("it falls at s = 0.65625");
        };
        assert!((s - 0.65625).abs() < 1e-9 && (rate + 0.034375).abs() < 1e-9, "{s} {rate}");
    }

    #[test]
    fn ends_are_checked() {
        assert!(matches!(Polynomial::new(&[0.1, 0.9]), Err(FunctionError::End { s: 0.0, .. })));
        assert!(matches!(Polynomial::new(&[0.0, 0.9]), Err(FunctionError::End { s: 1.0, .. })));
        assert!(matches!(Polynomial::new(&[0.0, f64::NAN]), Err(FunctionError::Coefficients)));
        assert!(matches!(Polynomial::new(&[]), Err(FunctionError::Coefficients)));
        let computed = |terms: usize| Polynomial::new(&[vec![0.0; terms - 1], vec![1.0]].concat());
        assert!(matches!(computed(65), Err(FunctionError::TooManyCoefficients { rows: 65, most: 64 })));
        assert!(!matches!(computed(64), Err(FunctionError::TooManyCoefficients { .. })));
    }

    #[test]
    fn a_high_degree_keeps_its_accuracy_towards_the_end() {
        // f = 1 - (1 - s)^12 by the binomial theorem: w = r^12.
        let mut c = vec![0.0; 13];
        let mut binomial = 1.0;
        for (n, c) in c.iter_mut().enumerate().skip(1) {
            binomial *= (13.0 - n as f64) / n as f64;
            *c = if n % 2 == 1 { binomial } else { -binomial };
        }
        let polynomial = Polynomial::new(&c).unwrap();
        for r in [0.9, 0.5, 0.2] {
            assert!((polynomial.remaining(r) - r.powi(12)).abs() < 1e-12 * r, "{r}: {}", polynomial.remaining(r));
        }
    }
}
