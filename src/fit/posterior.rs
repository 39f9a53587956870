//! How well a fit knows its parameters: covariance, correlation, and the combinations that the data alone fix or leave open.

use nalgebra::DMatrix;

use super::least_squares::BestFit;
use super::prior::Unknown;

/// Ratio of the least to the largest singular value below which a direction counts as open: differences of runs are no more exact.
const SINGULAR: f64 = 1e-4;
/// Standard deviation of a logarithm beyond which nothing is known.
const UNKNOWN: f64 = 3.0;

/// A direction in the space of the logarithms, of length 1, and its standard deviation.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DataDirection {
    pub(crate) vector: Vec<f64>,
    /// From the data alone.
    pub(crate) data: f64,
    /// From the priors alone.
    pub(crate) prior: f64,
}

/// Whether the data tell more of a combination of logarithms than the priors do, and enough.
pub(crate) fn is_fixed(combination: &[f64], directions: &[DataDirection], unknowns: &[Unknown]) -> bool {
    let data = |direction: &DataDirection| {
        let along: f64 = combination.iter().zip(&direction.vector).map(|(a, b)| a * b).sum();
        // Rounding leaves a little of directions across it, which may be infinitely open.
        if along.abs() > 1e-6 { (along * direction.data).powi(2) } else { 0.0 }
    };
    let prior =
        combination.iter().zip(unknowns).filter(|(a, _)| **a != 0.0).map(|(a, of)| a * a / of.weight()).sum::<f64>();
    directions.iter().map(data).sum::<f64>() < prior.min(UNKNOWN * UNKNOWN)
}

impl DataDirection {
    /// Whether the data tell more than the priors do, and enough.
    pub(crate) fn is_fixed(&self) -> bool {
        self.data < self.prior.min(UNKNOWN)
    }
}

/// What a fit knows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Posterior {
    /// Covariance of the logarithms.
    pub(crate) covariance: DMatrix<f64>,
    /// Ratio of the largest to the least singular value of the weighted derivatives of the data. Infinite where a parameter does nothing.
    pub(crate) condition: f64,
    /// The best fixed direction first.
    pub(crate) directions: Vec<DataDirection>,
    /// Share of the information on each parameter that comes from the data, given the others: 1 minus the ratio of its variance to its prior variance.
    pub(crate) data_shares: Vec<f64>,
}

impl Posterior {
    /// The posterior at the minimum. `Err` has all directions, and first one that neither data nor priors fix.
    ///
    /// # Errors
    /// A singular fit.
    pub(crate) fn new(best: &BestFit, unknowns: &[Unknown]) -> Result<Self, Vec<DataDirection>> {
        let count = unknowns.len();
        // Rows of zeros make the matrix tall enough for its triangular factor to be square.
        let rows = best.jacobian.nrows().max(count);
        let weighted = DMatrix::from_fn(rows, count, |row, column| match best.weights.get(row) {
            Some(weight) => best.jacobian[(row, column)] * weight.sqrt(),
            None => 0.0,
        });
        let triangle = weighted.qr().r();
        let data = triangle.clone().svd(false, true);
        let turned = data.v_t.unwrap_or_else(|| DMatrix::identity(count, count));
        let largest = data.singular_values.max();
        let prior_weights: Vec<f64> = unknowns.iter().map(Unknown::weight).collect();
        let mut directions: Vec<DataDirection> = (0..count)
            .map(|row| {
                let vector: Vec<f64> = turned.row(row).iter().copied().collect();
                let stated: f64 = vector.iter().zip(&prior_weights).map(|(v, weight)| v * v * weight).sum();
                let singular = data.singular_values[row];
                let data = if singular > SINGULAR * largest { 1.0 / singular } else { f64::INFINITY };
                DataDirection { vector, data, prior: stated.sqrt().recip() }
            })
            .collect();
        directions.sort_by(|a, b| a.data.total_cmp(&b.data));
        let open = |direction: &DataDirection| direction.data.min(direction.prior) > UNKNOWN;
        if let Some(open) = directions.iter().position(open) {
            directions.swap(0, open);
            return Err(directions);
        }
        let stacked = DMatrix::from_fn(2 * count, count, |row, column| match row.checked_sub(count) {
            None => triangle[(row, column)],
            Some(own) if own == column => prior_weights[own].sqrt(),
            Some(_) => 0.0,
        });
        let all = stacked.svd(false, true);
        let turned_all = all.v_t.unwrap_or_else(|| DMatrix::identity(count, count));
        let scaled = DMatrix::from_fn(count, count, |row, column| turned_all[(row, column)] / all.singular_values[row]);
        let covariance = scaled.transpose() * scaled;
        let shares = |i: usize| 1.0 - covariance[(i, i)] * prior_weights[i];
        Ok(Self {
            data_shares: (0..count).map(shares).collect(),
            condition: largest / data.singular_values.min(),
            covariance,
            directions,
        })
    }

    /// Standard deviation of the logarithm of a parameter.
    pub(crate) fn sigma(&self, i: usize) -> f64 {
        self.covariance[(i, i)].sqrt()
    }

    pub(crate) fn correlation(&self, i: usize, j: usize) -> f64 {
        self.covariance[(i, j)] / (self.sigma(i) * self.sigma(j))
    }

    /// Standard deviation of a combination of logarithms.
    pub(crate) fn sigma_of(&self, combination: &[f64]) -> f64 {
        let product = |(i, a): (usize, &f64)| {
            combination.iter().enumerate().map(|(j, b)| a * b * self.covariance[(i, j)]).sum::<f64>()
        };
        combination.iter().enumerate().map(product).sum::<f64>().max(0.0).sqrt()
    }
}
