//! Temperature between two steps, for images at their own times.

use rayon::prelude::*;

/// Temperature at a share of the time from one step to the next [K].
pub(crate) fn between(earlier: f64, later: f64, share: f64) -> f64 {
    earlier * (1.0 - share) + later * share
}

/// Largest error of [`between`] over the nodes [K], from the temperatures at three steps in a row: a straight line between two values of a smooth function
/// is off by up to an eighth of its second difference.
pub(crate) fn between_error(three: [&[f32]; 3]) -> f64 {
    let [first, second, third] = three;
    let error = |node: usize| {
        let [a, b, c] = [first[node], second[node], third[node]].map(f64::from);
        (a - 2.0 * b + c).abs() / 8.0
    };
    (0..first.len().min(second.len()).min(third.len())).into_par_iter().map(error).reduce(|| 0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Between 0 and 1 the line through a parabola `c t^2` is off by `c / 4` in the middle. Its second difference is `2 c`.
    #[test]
    fn the_error_is_that_of_a_parabola() {
        let curve = |c: f64, t: f64| 300.0 + 5.0 * t + c * t * t;
        for c in [0.5, -2.0, 8.0] {
            let at = [0.0, 1.0, 2.0].map(|t| vec![curve(c, t) as f32]);
            let error = between_error([&at[0], &at[1], &at[2]]);
            let middle = between(curve(c, 0.0), curve(c, 1.0), 0.5) - curve(c, 0.5);
            assert!((error - middle.abs()).abs() < 1e-6 && (error - c.abs() / 4.0).abs() < 1e-6, "{c}: {error}");
            assert!((between_error([&at[0], &at[1], &[at[2][0] + 0.1]]) - error).abs() > 1e-3);
        }
    }

    #[test]
    fn the_ends_are_those_of_the_steps() {
        assert_eq!([0.0, 0.25, 1.0].map(|share| between(200.0, 300.0, share)), [200.0, 225.0, 300.0]);
    }
}
