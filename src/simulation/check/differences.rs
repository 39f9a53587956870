//! Sums of differences, and the place of the largest.

/// Differences so far [K].
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Differences {
    pub(crate) count: u64,
    sum_of_squares: f64,
    pub(crate) largest: f64,
    /// Device node, step and time [s] of the largest.
    pub(crate) worst: (usize, u32, f64),
}

impl Differences {
    /// Adds a difference at a device node, a step and a time [s].
    pub(crate) fn add(&mut self, difference: f64, place: (usize, u32, f64)) {
        self.count += 1;
        self.sum_of_squares += difference * difference;
        // A NaN must count as the largest difference.
        if difference > self.largest || difference.is_nan() {
            (self.largest, self.worst) = (difference, place);
        }
    }

    /// Root mean square of the differences.
    pub(crate) fn rms(&self) -> f64 {
        (self.sum_of_squares / self.count.max(1) as f64).sqrt()
    }
}
