//! Symmetric scaling: one factor for each row gives the rows of a symmetric matrix the right sums; and the linear systems of such matrices.
//!
//! The factors d solve d_i (sum over j of S_ij c_j d_j + s_i) = w_i. Newton's method on ln d reaches rounding in some forty products with S. Steps by the root of what is missing, which always
//! converge, take hundreds where patches see little but each other. They begin, and stand in where Newton's method does not come nearer.

use rayon::prelude::*;

use super::sparse::Sparse;

/// Share of an error that a step of Newton's method may leave. A step that leaves more is taken back, and roots go on.
const GAIN: f64 = 0.5;
/// Roots before Newton's method begins, and after a step that was taken back.
const ROOTS: usize = 4;
/// Most steps that are taken back.
const TAKEN_BACK: usize = 3;
/// Error of the linear system of a step, over its right side.
const STEP_ERROR: f64 = 1e-3;
/// Most products with S in a step.
const STEP_PRODUCTS: usize = 60;
/// Largest change of ln d in a step.
const LARGEST: f64 = 1.0;

/// Rows to scale: S, the weights c of its columns, the rest s of each row, and the wanted sums w.
pub(super) struct Rows<'a> {
    pub(super) shared: &'a Sparse,
    pub(super) weights: &'a [f64],
    pub(super) rest: &'a [f64],
    pub(super) wanted: &'a [f64],
}

/// S times a vector.
pub(super) fn product(shared: &Sparse, vector: &[f64]) -> Vec<f64> {
    let of_row = |row: usize| shared.row(row).iter().map(|(j, area)| area * vector[*j as usize]).sum();
    (0..shared.len()).into_par_iter().map(of_row).collect()
}

/// Solves M x = b for a symmetric M that is positive semidefinite, by conjugate gradients over a diagonal near its own. Unknowns whose diagonal is 0 stay 0. Ends at
/// an error of the share `least` of b.
pub(crate) fn conjugate_gradients(
    diagonal: &[f64],
    times: impl Fn(&[f64]) -> Vec<f64>,
    b: &[f64],
    least: f64,
    most: usize,
) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let over = |r: &[f64]| -> Vec<f64> {
        r.iter().zip(diagonal).map(|(r, diagonal)| if *diagonal > 0.0 { r / diagonal } else { 0.0 }).collect()
    };
    let (mut x, mut r) = (vec![0.0; b.len()], b.to_vec());
    let mut z = over(&r);
    let mut way = z.clone();
    let mut error = dot(&r, &z);
    let end = error * least * least;
    for _ in 0..most {
        if error <= end {
            break;
        }
        let image = times(&way);
        let curve = dot(&way, &image);
        if curve <= 0.0 {
            break;
        }
        let length = error / curve;
        x.iter_mut().zip(&way).for_each(|(x, way)| *x += length * way);
        r.iter_mut().zip(&image).for_each(|(r, image)| *r -= length * image);
        z = over(&r);
        let next = dot(&r, &z);
        way.iter_mut().zip(&z).for_each(|(way, z)| *way = z + next / error * *way);
        error = next;
    }
    x
}

/// Whether a factor can give a row the sum that it wants.
fn counts(sum: f64, wanted: f64) -> bool {
    sum > 0.0 && wanted > 0.0
}

impl Rows<'_> {
    /// The factors, to an error of the sums over what is wanted, or after some rounds. Rows without a sum, or that want none, keep the factor 1.
    pub(super) fn factors(&self, least: f64, rounds: usize) -> Vec<f64> {
        let mut factor = vec![1.0; self.wanted.len()];
        // The factors before a step of Newton's method, and their error.
        let mut before: Option<(Vec<f64>, f64)> = None;
        let (mut roots, mut taken_back) = (ROOTS, 0);
        for _ in 0..rounds {
            let sums = self.sums(&factor);
            let off =
                |(sum, wanted): (&f64, &f64)| if counts(*sum, *wanted) { (sum / wanted - 1.0).abs() } else { 0.0 };
            let worst = sums.iter().zip(self.wanted).map(off).fold(0.0, f64::max);
            if worst <= least {
                break;
            }
            if let Some((last, error)) = before.take()
                && (!worst.is_finite() || worst > GAIN * error)
            {
                (factor, roots, taken_back) = (last, ROOTS, taken_back + 1);
                continue;
            }
            if roots == 0 && taken_back < TAKEN_BACK {
                before = Some((factor.clone(), worst));
                self.step(&mut factor, &sums);
            } else {
                roots = roots.saturating_sub(1);
                for (i, sum) in sums.iter().enumerate().filter(|(i, sum)| counts(**sum, self.wanted[*i])) {
                    factor[i] *= (self.wanted[i] / sum).sqrt();
                }
            }
        }
        factor
    }

    fn sums(&self, factor: &[f64]) -> Vec<f64> {
        let weighted: Vec<f64> = factor.iter().zip(self.weights).map(|(factor, weight)| factor * weight).collect();
        let products = product(self.shared, &weighted);
        (0..factor.len()).map(|i| factor[i] * (products[i] + self.rest[i])).collect()
    }

    /// A step of Newton's method. The factors of columns that do not count follow from their own rows.
    fn step(&self, factor: &mut [f64], sums: &[f64]) {
        let each = |of: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..sums.len()).map(of).collect() };
        let diagonal = each(&|i| self.weights[i] * sums[i]);
        let weighted = each(&|i| self.weights[i] * factor[i]);
        let missing = each(&|i| self.weights[i] * (self.wanted[i] - sums[i]));
        let times = |way: &[f64]| {
            let turned: Vec<f64> = way.iter().zip(&weighted).map(|(way, weight)| way * weight).collect();
            let products = product(self.shared, &turned);
            (0..way.len()).map(|i| diagonal[i] * way[i] + weighted[i] * products[i]).collect()
        };
        let change = conjugate_gradients(&diagonal, times, &missing, STEP_ERROR, STEP_PRODUCTS);
        for (i, sum) in sums.iter().enumerate().filter(|(i, sum)| counts(**sum, self.wanted[*i])) {
            factor[i] *=
                if self.weights[i] > 0.0 { change[i].clamp(-LARGEST, LARGEST).exp() } else { self.wanted[i] / sum };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A symmetric matrix whose patches see mostly the other half, as two plates do, and the right sums of scaled rows.
    fn plates(count: usize, rest: f64) -> (Sparse, Vec<f64>) {
        let value = |i: usize, j: usize| {
            let facing = (i < count / 2) != (j < count / 2);
            (1.0 + ((i * j + i + j) % 7) as f64) * if facing { 1.0 } else { 0.01 }
        };
        let rows = (0..count).map(|i| (0..count).map(|j| (j as u32, value(i, j))).collect()).collect();
        let shared = Sparse::from_rows(rows);
        let right = |i: usize| 1.0 + 0.3 * (i as f64).sin();
        let all: Vec<f64> = (0..count).map(right).collect();
        let sums = product(&shared, &all);
        (shared, (0..count).map(|i| right(i) * (sums[i] + rest)).collect())
    }

    #[test]
    fn rows_get_their_sums_in_few_rounds() {
        let (shared, wanted) = plates(60, 0.4);
        let (weights, rest) = (vec![1.0; 60], vec![0.4; 60]);
        let rows = Rows { shared: &shared, weights: &weights, rest: &rest, wanted: &wanted };
        let error = |rounds: usize| {
            let factor = rows.factors(1e-13, rounds);
            (0..60).map(|i| (factor[i] - 1.0 - 0.3 * (i as f64).sin()).abs()).fold(0.0, f64::max)
        };
        let [few, enough] = [4, 12].map(error);
        println!("{few:e} {enough:e}");
        assert!(enough < 1e-10 && few > 1e-4, "{few:e} {enough:e}");
    }

    #[test]
    fn sums_that_no_factors_give_end_in_finite_factors() {
        // Two patches that see nothing but each other, of different areas.
        let shared = Sparse::from_rows(vec![vec![(1, 1.0)], vec![(0, 1.0)]]);
        let rows = Rows { shared: &shared, weights: &[1.0; 2], rest: &[0.0; 2], wanted: &[1.0, 2.0] };
        assert!(rows.factors(1e-13, 200).iter().all(|factor| factor.is_finite() && *factor > 0.0));
    }

    #[test]
    fn columns_that_do_not_count_follow_from_their_rows() {
        let shared = Sparse::from_rows(vec![vec![(0, 2.0), (1, 1.0)], vec![(0, 1.0), (1, 5.0)]]);
        let rows = Rows { shared: &shared, weights: &[1.0, 0.0], rest: &[0.0; 2], wanted: &[8.0, 3.0] };
        let factor = rows.factors(1e-12, 20);
        assert!((factor[0] - 2.0).abs() < 1e-9 && (factor[1] - 1.5).abs() < 1e-9, "{factor:?}");
    }
}
