//! How residuals count: in full, or less where they are large.

use crate::scene::Loss;

impl Loss {
    /// The loss of a squared residual `z`, and its derivative by `z`, which is the weight of the residual. Both count in standard deviations, and `scale` says where they begin to differ
    /// from a square (Triggs et al., "Bundle Adjustment", 2000, section 4.3; scipy.optimize.least_squares has the same names).
    pub(super) fn of(self, z: f64, scale: f64) -> [f64; 2] {
        let square = scale * scale;
        let u = z / square;
        match self {
            Self::Huber if u > 1.0 => [square * (2.0 * u.sqrt() - 1.0), 1.0 / u.sqrt()],
            Self::Square | Self::Huber => [z, 1.0],
            Self::SoftL1 => [2.0 * square * ((1.0 + u).sqrt() - 1.0), 1.0 / (1.0 + u).sqrt()],
            Self::Cauchy => [square * u.ln_1p(), 1.0 / (1.0 + u)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weight_is_the_derivative_and_small_residuals_count_in_full() {
        for loss in [Loss::Square, Loss::Huber, Loss::SoftL1, Loss::Cauchy] {
            for z in [0.01, 1.0, 8.0, 10.0, 400.0] {
                let [_, weight] = loss.of(z, 3.0);
                let step = 1e-4 * z;
                let slope = (loss.of(z + step, 3.0)[0] - loss.of(z - step, 3.0)[0]) / (2.0 * step);
                assert!((slope - weight).abs() < 1e-6, "{loss:?} {z}: {slope} {weight}");
            }
            assert!((loss.of(0.01, 3.0)[0] - 0.01).abs() < 1e-4);
            assert!(loss == Loss::Square || loss.of(400.0, 3.0)[1] < 0.2);
        }
    }
}
