//! Polynomial interpolation of values and derivatives by Newton's divided differences and Horner's rule.

use std::ops::{Add, Div, Mul, Sub};

/// A vector space whose elements can be interpolated.
pub(crate) trait Vector:
    Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self> + Div<f64, Output = Self>
{
}

impl<V> Vector for V where
    V: Copy + Default + Add<Output = V> + Sub<Output = V> + Mul<f64, Output = V> + Div<f64, Output = V>
{
}

pub(crate) const HIGHEST_DEGREE: usize = 31;

/// Conditions of the highest degree, where the values and slopes of whole samples are used.
const MOST_NODES: usize = HIGHEST_DEGREE + 2;

/// The degree that is used for a stated degree. Values and slopes of whole samples give an odd degree, and at least two samples are needed.
pub(crate) fn hermite_degree(stated: usize) -> usize {
    (stated | 1).max(3)
}

/// Value and slope at `time` of the polynomial through `samples`. A sample is its time with its value, slope and second derivative. The polynomial meets
/// the first `each` of these three. The samples are in order of time and give at most two conditions more than [`HIGHEST_DEGREE`].
pub(crate) fn polynomial<V: Vector>(samples: &[(f64, [V; 3])], each: usize, time: f64) -> (V, V) {
    let middle = samples[samples.len() / 2].0;
    // Times over the length of the window keep the differences within the range of the values.
    let scale = (samples[samples.len() - 1].0 - samples[0].0).max(1.0);
    let mut nodes = [0.0; MOST_NODES];
    let mut differences = [V::default(); MOST_NODES];
    // Derivatives over their factorials, by order.
    let mut slopes = [[V::default(); 3]; MOST_NODES];
    let mut count = 0;
    for (at, [value, slope, bend]) in samples {
        for _ in 0..each {
            nodes[count] = (at - middle) / scale;
            differences[count] = *value;
            slopes[count] = [V::default(), *slope * scale, *bend * (0.5 * scale * scale)];
            count += 1;
        }
    }
    for order in 1..count {
        for index in (order..count).rev() {
            let span = nodes[index] - nodes[index - order];
            differences[index] =
                if span == 0.0 { slopes[index][order] } else { (differences[index] - differences[index - 1]) / span };
        }
    }
    let at = (time - middle) / scale;
    let (mut value, mut slope) = (differences[count - 1], V::default());
    for index in (0..count - 1).rev() {
        slope = slope * (at - nodes[index]) + value;
        value = value * (at - nodes[index]) + differences[index];
    }
    (value, slope / scale)
}

/// The `points` samples around a time, out of `count`. `next` is the first sample after that time.
pub(crate) fn window(count: usize, next: usize, points: usize) -> std::ops::Range<usize> {
    let points = points.min(count);
    let first = next.saturating_sub(points.div_ceil(2)).min(count - points);
    first..first + points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// t^5 - 2 t with its slope and its second derivative.
    fn quintic(time: f64) -> [f64; 3] {
        [time.powi(5) - 2.0 * time, 5.0 * time.powi(4) - 2.0, 20.0 * time.powi(3)]
    }

    #[test]
    fn a_polynomial_of_its_degree_is_met_and_one_above_is_not() {
        for (each, points) in [(1, 6), (2, 3), (3, 2)] {
            let through = |points: usize| -> Vec<(f64, [f64; 3])> {
                (0..points).map(|index| (1.5 * index as f64, quintic(1.5 * index as f64))).collect()
            };
            let (value, slope) = polynomial(&through(points), each, 0.7);
            let [exact, exact_slope, _] = quintic(0.7);
            assert!((value - exact).abs() < 1e-11 && (slope - exact_slope).abs() < 1e-10, "{each}: {value}, {slope}");
            let (value, _) = polynomial(&through(points - 1), each, 0.7);
            assert!((value - exact).abs() > 1e-2, "{each}: fewer samples must show");
        }
    }

    #[test]
    fn windows_lie_around_the_time_and_within_the_samples() {
        assert_eq!(window(10, 5, 4), 3..7);
        assert_eq!(window(10, 1, 4), 0..4);
        assert_eq!(window(10, 10, 4), 6..10);
        assert_eq!(window(3, 2, 8), 0..3);
    }
}
