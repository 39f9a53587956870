//! Least squares in a few bounded variables, by the method of Levenberg (1944) and Marquardt (1963) with finite differences.

/// A point and its sum of squared residuals.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Minimum {
    pub(crate) x: Vec<f64>,
    /// Sum of the squared residuals there, infinite where a residual is NaN.
    pub(crate) sum_of_squares: f64,
}

/// Step of a difference relative to a variable, near the cube root of the rounding error, where the error of a central difference is least.
const DIFFERENCE: f64 = 6e-6;
/// The search ends at a step that reduces the sum of squares by less than this share.
const GAIN: f64 = 1e-12;

/// A variable that is not held.
struct Direction {
    i: usize,
    derivative: Vec<f64>,
    /// Half of the negative derivative of the sum of squares.
    downhill: f64,
}

/// Minimises from `start` in at most `iterations` steps. `bounds` are the limits of each variable. A variable with equal limits is held. `residuals`
/// returns the same number of values at every point.
///
/// The result is the local minimum near `start`. Try several starts where there may be more than one.
pub(crate) fn minimise(
    residuals: &dyn Fn(&[f64]) -> Vec<f64>,
    start: &[f64],
    bounds: &[[f64; 2]],
    iterations: usize,
) -> Minimum {
    let inside =
        |x: &[f64]| -> Vec<f64> { x.iter().zip(bounds).map(|(x, [low, high])| x.clamp(*low, *high)).collect() };
    let mut x = inside(start);
    let mut here = residuals(&x);
    let mut sum = sum_of_squares(&here);
    let mut damping = 1e-3;
    for _ in 0..iterations {
        let free: Vec<Direction> = (0..x.len())
            .filter(|&i| bounds[i][0] < bounds[i][1])
            .map(|i| {
                let derivative = derivative(residuals, &x, i, bounds[i]);
                Direction { i, downhill: -product(&derivative, &here), derivative }
            })
            // A variable at a bound is held where the descent leads out. Otherwise the others would step as if it moved.
            .filter(|Direction { i, downhill, .. }| {
                let [low, high] = bounds[*i];
                !(x[*i] <= low && *downhill < 0.0 || x[*i] >= high && *downhill > 0.0)
            })
            .collect();
        let normal: Vec<Vec<f64>> =
            free.iter().map(|a| free.iter().map(|b| product(&a.derivative, &b.derivative)).collect()).collect();
        let downhill: Vec<f64> = free.iter().map(|direction| direction.downhill).collect();
        let mut gained = 0.0;
        while damping < 1e12 {
            let mut damped = normal.clone();
            for (i, row) in damped.iter_mut().enumerate() {
                // A variable without effect is held.
                row[i] = if normal[i][i] > 0.0 { normal[i][i] * (1.0 + damping) } else { 1.0 };
            }
            let mut trial = x.clone();
            for (direction, step) in free.iter().zip(solve(damped, downhill.clone())) {
                trial[direction.i] += step;
            }
            let trial = inside(&trial);
            let there = residuals(&trial);
            let trial_sum = sum_of_squares(&there);
            if trial_sum < sum {
                gained = (sum - trial_sum) / sum;
                (x, here, sum) = (trial, there, trial_sum);
                damping = (damping * 0.1).max(1e-12);
                break;
            }
            damping *= 10.0;
        }
        if gained < GAIN {
            break;
        }
    }
    Minimum { x, sum_of_squares: sum }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn sum_of_squares(residuals: &[f64]) -> f64 {
    let sum: f64 = residuals.iter().map(|r| r * r).sum();
    if sum.is_nan() { f64::INFINITY } else { sum }
}

/// Central difference, or one-sided at a bound.
fn derivative(residuals: &dyn Fn(&[f64]) -> Vec<f64>, x: &[f64], i: usize, [low, high]: [f64; 2]) -> Vec<f64> {
    let step = DIFFERENCE * x[i].abs().max(1e-3);
    let at = |value: f64| {
        let mut moved = x.to_vec();
        moved[i] = value.clamp(low, high);
        (moved[i], residuals(&moved))
    };
    let ((left, before), (right, after)) = (at(x[i] - step), at(x[i] + step));
    before.iter().zip(&after).map(|(a, b)| (b - a) / (right - left)).collect()
}

/// Gaussian elimination with pivots. A singular system gives values that are not finite, and the following step is refused.
fn solve(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();
    for column in 0..n {
        let pivot = (column..n).max_by(|&a, &b| matrix[a][column].abs().total_cmp(&matrix[b][column].abs()));
        let pivot = pivot.unwrap_or(column);
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        let pivot_row = matrix[column].clone();
        for row in column + 1..n {
            let factor = matrix[row][column] / pivot_row[column];
            for (value, pivot) in matrix[row].iter_mut().zip(&pivot_row) {
                *value -= factor * pivot;
            }
            right[row] -= factor * right[column];
        }
    }
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|k| matrix[row][k] * right[k]).sum();
        right[row] = (right[row] - known) / matrix[row][row];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley (1960) as residuals: its minimum is 0 at (1, 1).
    fn valley(x: &[f64]) -> Vec<f64> {
        vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]
    }

    #[test]
    fn the_valley_is_followed_to_its_end() {
        let computed = minimise(&valley, &[-1.2, 1.0], &[[-5.0, 5.0]; 2], 100);
        assert!(computed.x.iter().all(|x| (x - 1.0).abs() < 1e-8), "{computed:?}");
        let short = minimise(&valley, &[-1.2, 1.0], &[[-5.0, 5.0]; 2], 3);
        assert!(short.sum_of_squares > 1e-3);
    }

    #[test]
    fn bounds_hold_and_a_held_variable_does_not_move() {
        let computed = minimise(&valley, &[-1.2, 1.0], &[[-5.0, 0.5], [-5.0, 5.0]], 100);
        assert!((computed.x[0] - 0.5).abs() < 1e-9 && (computed.x[1] - 0.25).abs() < 1e-6, "{computed:?}");
        let found = minimise(&valley, &[0.0, 0.3], &[[-5.0, 5.0], [0.3, 0.3]], 100);
        assert_eq!(found.x[1], 0.3);
    }

    #[test]
    fn a_variable_without_effect_and_what_is_not_a_number_do_no_harm() {
        let flat = minimise(&|x| vec![x[0] - 2.0], &[0.0, 7.0], &[[-5.0, 5.0], [0.0, 9.0]], 50);
        assert!((flat.x[0] - 2.0).abs() < 1e-9 && flat.x[1] == 7.0);
        let bad = minimise(&|_| vec![f64::NAN], &[0.0], &[[-1.0, 1.0]], 50);
        assert_eq!(bad.sum_of_squares, f64::INFINITY);
    }
}
