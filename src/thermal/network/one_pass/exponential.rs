//! Exact conduction inside a block: P = phi_1(X) and Q = e^-X - 1 of its rates X, with phi_1(x) = (1 - e^-x) / x.
//!
//! Both come from the Taylor series of a matrix halved until it is small, and from doubling (Moler & Van Loan, SIAM Rev. 45, 2003, method 3). Q is doubled
//! as Q, not as 1 + Q, so that weak exchange is not lost beside 1.

/// Norm below which the series is used.
const SMALL: f64 = 0.25;
/// Terms of the series. The next one is below 1e-16 of the first.
const TERMS: usize = 11;
/// Factors that are nothing beside the rounding of numbers near 1. Most entries of a large block are.
const NOTHING: f64 = 1e-18;

/// P and Q of a symmetric matrix of non-negative eigenvalues, `size` x `size`, row after row.
pub(crate) fn exponentials(matrix: &[f64], size: usize) -> [Vec<f64>; 2] {
    let row_sum = |row: &[f64]| row.iter().map(|value| value.abs()).sum::<f64>();
    let norm = matrix.chunks(size).map(row_sum).fold(0.0, f64::max);
    let doublings = (norm / SMALL).log2().ceil().max(0.0) as i32;
    let small: Vec<f64> = matrix.iter().map(|value| value * 0.5f64.powi(doublings)).collect();
    // Horner's rule for the sum of (-X)^k / (k + 1)!.
    let mut mean = identity(size);
    for term in (1..=TERMS).rev() {
        let mut next = product(&small, &mean, size);
        next.iter_mut().for_each(|value| *value /= -(term as f64 + 1.0));
        (0..size).for_each(|at| next[at * size + at] += 1.0);
        mean = next;
    }
    let mut change: Vec<f64> = product(&small, &mean, size).iter().map(|value| -value).collect();
    for _ in 0..doublings {
        let both = product(&change, &mean, size);
        mean.iter_mut().zip(&both).for_each(|(mean, both)| *mean += 0.5 * both);
        let twice = product(&change, &change, size);
        change.iter_mut().zip(&twice).for_each(|(change, twice)| *change = 2.0 * *change + twice);
    }
    [mean, change].map(|values| symmetric(&values, size))
}

/// (1 - e^-x) / x, for x >= 0.
pub(crate) fn mean_exponential(x: f64) -> f64 {
    if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 }
}

fn identity(size: usize) -> Vec<f64> {
    (0..size * size).map(|at| if at / size == at % size { 1.0 } else { 0.0 }).collect()
}

/// Product of two symmetric matrices that commute, without factors that are nothing.
fn product(a: &[f64], b: &[f64], size: usize) -> Vec<f64> {
    let mut out = vec![0.0; size * size];
    for (row, out) in a.chunks(size).zip(out.chunks_mut(size)) {
        for (factor, other) in row.iter().zip(b.chunks(size)).filter(|(factor, _)| factor.abs() > NOTHING) {
            out.iter_mut().zip(other).for_each(|(out, other)| *out += factor * other);
        }
    }
    out
}

/// The symmetric part, without the rounding of products.
fn symmetric(values: &[f64], size: usize) -> Vec<f64> {
    (0..size * size).map(|at| 0.5 * (values[at] + values[at % size * size + at / size])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two nodes that exchange heat: their difference decays at twice the rate, their sum stays.
    #[test]
    fn two_nodes_equalise_exactly() {
        for rate in [1e-9, 1e-3, 0.4, 7.0, 300.0, 1e6] {
            let [mean, change] = exponentials(&[rate, -rate, -rate, rate], 2);
            let (x, lost) = (2.0 * rate, (-2.0 * rate).exp_m1());
            for (computed, expected) in [
                (mean[0], 0.5 * (1.0 - lost / x)),
                (mean[1], 0.5 * (1.0 + lost / x)),
                (change[0], 0.5 * lost),
                (change[1], -0.5 * lost),
            ] {
                assert!(
                    (computed - expected).abs() < 2e-13 * expected.abs().max(1e-3),
                    "{rate}: {computed} {expected}"
                );
            }
        }
    }

    /// The heat that leaves is the integral of the mean: Q = -X P, for a chain with rates over nine decades.
    #[test]
    fn the_change_is_the_rate_times_the_mean() {
        let size = 24;
        let mut matrix = vec![0.0; size * size];
        for link in 0..size - 1 {
            let rate = 10f64.powf(-4.0 + 9.0 * (0.37 * link as f64).fract());
            for (row, column, sign) in
                [(link, link, 1.0), (link + 1, link + 1, 1.0), (link, link + 1, -1.0), (link + 1, link, -1.0)]
            {
                matrix[row * size + column] += sign * rate;
            }
        }
        let [mean, change] = exponentials(&matrix, size);
        let product = product(&matrix, &mean, size);
        for (at, (product, change)) in product.iter().zip(&change).enumerate() {
            // Products of rates of 1e5 with values of 1 round at 1e-11.
            assert!((product + change).abs() < 1e-9, "{at}: {product} {change}");
        }
        for row in mean.chunks(size) {
            assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-9, "a common source heats all nodes alike");
        }
    }
}
