//! Sums of differences, and the place of the largest.

/// From the difference between steps and half steps to the error of steps: exact for an error in proportion to the step.
pub(super) const ERROR_OF_DIFFERENCE: f64 = 2.0;

/// Differences so far [K].
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Differences {
    pub(crate) count: u64,
    weights: f64,
    sum_of_squares: f64,
    pub(crate) largest: f64,
    /// Device node, step and time [s] of the largest.
    pub(crate) worst: (usize, u32, f64),
}

impl Differences {
    /// Adds a difference with its weight, at a device node, a step and a time [s].
    pub(crate) fn add(&mut self, difference: f64, weight: f64, place: (usize, u32, f64)) {
        self.count += 1;
        self.weights += weight;
        self.sum_of_squares += weight * difference * difference;
        // A NaN must count as the largest difference.
        if difference > self.largest || difference.is_nan() {
            (self.largest, self.worst) = (difference, place);
        }
    }

    /// Both sums together.
    pub(crate) fn and(self, other: Self) -> Self {
        let worst = if other.largest > self.largest || other.largest.is_nan() { other } else { self };
        Self {
            count: self.count + other.count,
            weights: self.weights + other.weights,
            sum_of_squares: self.sum_of_squares + other.sum_of_squares,
            ..worst
        }
    }

    /// Root mean square of the differences, by weight.
    pub(crate) fn rms(&self) -> f64 {
        if self.weights > 0.0 { (self.sum_of_squares / self.weights).sqrt() } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pixel sees area, so a node of 99 m2 counts as 99 nodes of 1 m2.
    #[test]
    fn the_mean_square_is_of_areas_and_the_largest_is_of_any_node() {
        let (mut few, mut many) = (Differences::default(), Differences::default());
        few.add(2.0, 99.0, (1, 0, 5.0));
        few.add(8.0, 1.0, (2, 0, 6.0));
        (0..99).for_each(|_| many.add(2.0, 1.0, (1, 0, 5.0)));
        many.add(8.0, 1.0, (2, 0, 6.0));
        assert!((few.rms() - many.rms()).abs() < 1e-12 && few.rms() < 2.2, "{} {}", few.rms(), many.rms());
        assert_eq!((few.largest, few.worst), (8.0, (2, 0, 6.0)));
        let mut other = Differences::default();
        other.add(f64::NAN, 1.0, (3, 1, 7.0));
        assert!(few.and(other).largest.is_nan() && few.and(Differences::default()).largest == 8.0);
        assert_eq!(Differences::default().rms(), 0.0);
    }
}
