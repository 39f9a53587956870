//! A sparse matrix with a symmetric pattern, factored without pivoting in an order of minimum degree.
//!
//! The matrices of a network are M-matrices with diagonally dominant columns. Gaussian elimination then needs no pivoting in any symmetric order (Higham,
//! Accuracy and Stability of Numerical Algorithms, 2nd ed., 9.5).

use std::collections::BTreeSet;

use crate::stop::Watch;

#[derive(Debug, Clone)]
pub(super) struct SparseMatrix {
    /// Row of the caller at each position of the order.
    order: Vec<u32>,
    place: Vec<u32>,
    /// Start of each row in `columns` and `values`. Rows and columns are positions.
    starts: Vec<usize>,
    columns: Vec<u32>,
    /// Index of the diagonal of each row.
    diagonal: Vec<usize>,
    values: Vec<f64>,
    factors: Vec<f64>,
    work: Vec<f64>,
}

impl SparseMatrix {
    /// A zero matrix of `size` rows, with entries on the diagonal and for both orders of each pair.
    pub(super) fn new(size: usize, pairs: impl Iterator<Item = [usize; 2]>) -> Self {
        let mut neighbours = vec![BTreeSet::new(); size];
        for [a, b] in pairs.filter(|[a, b]| a != b) {
            neighbours[a].insert(b as u32);
            neighbours[b].insert(a as u32);
        }
        let (order, rows) = eliminate(neighbours);
        let mut place = vec![0; size];
        for (at, row) in order.iter().enumerate() {
            place[*row as usize] = at as u32;
        }
        // Later entries of a row are right of its diagonal, and in the column below it.
        let mut lists: Vec<Vec<u32>> = (0..size).map(|at| vec![at as u32]).collect();
        for (at, later) in rows.iter().enumerate() {
            for row in later {
                let row = place[*row as usize];
                lists[at].push(row);
                lists[row as usize].push(at as u32);
            }
        }
        let (mut starts, mut columns, mut diagonal) = (vec![0], Vec::new(), Vec::new());
        for (at, list) in lists.iter_mut().enumerate() {
            list.sort_unstable();
            diagonal.push(columns.len() + list.partition_point(|column| (*column as usize) < at));
            columns.extend_from_slice(list);
            starts.push(columns.len());
        }
        let (values, work) = (vec![0.0; columns.len()], vec![0.0; size]);
        Self { order, place, starts, columns, diagonal, factors: values.clone(), values, work }
    }

    pub(super) fn clear(&mut self) {
        self.values.fill(0.0);
    }

    pub(super) fn add_diagonal(&mut self, row: usize, value: f64) {
        self.values[self.diagonal[self.place[row] as usize]] += value;
    }

    /// Adds to the entry of a pair of [`SparseMatrix::new`].
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        let (row, column) = (self.place[row] as usize, self.place[column]);
        let start = self.starts[row];
        if let Ok(at) = self.columns[start..self.starts[row + 1]].binary_search(&column) {
            self.values[start + at] += value;
        }
    }

    /// Factors the matrix. Returns whether every pivot is a positive number.
    pub(super) fn factor(&mut self) -> bool {
        self.factors.copy_from_slice(&self.values);
        let watch = Watch::begin();
        for row in 0..self.order.len() {
            watch.look();
            let (start, end, diagonal) = (self.starts[row], self.starts[row + 1], self.diagonal[row]);
            for at in start..end {
                self.work[self.columns[at] as usize] = self.factors[at];
            }
            for at in start..diagonal {
                let earlier = self.columns[at] as usize;
                let above = self.diagonal[earlier];
                let multiple = self.work[earlier] / self.factors[above];
                self.work[earlier] = multiple;
                for right in above + 1..self.starts[earlier + 1] {
                    self.work[self.columns[right] as usize] -= multiple * self.factors[right];
                }
            }
            for at in start..end {
                self.factors[at] = self.work[self.columns[at] as usize];
            }
            let pivot = self.factors[diagonal];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return false;
            }
        }
        true
    }

    /// Solves with the last factors, in place.
    pub(super) fn solve(&mut self, right: &mut [f64]) {
        for row in 0..self.order.len() {
            let sum: f64 = (self.starts[row]..self.diagonal[row])
                .map(|at| self.factors[at] * self.work[self.columns[at] as usize])
                .sum();
            self.work[row] = right[self.order[row] as usize] - sum;
        }
        for row in (0..self.order.len()).rev() {
            let diagonal = self.diagonal[row];
            let sum: f64 = (diagonal + 1..self.starts[row + 1])
                .map(|at| self.factors[at] * self.work[self.columns[at] as usize])
                .sum();
            self.work[row] = (self.work[row] - sum) / self.factors[diagonal];
        }
        for (work, row) in self.work.iter().zip(&self.order) {
            right[*row as usize] = *work;
        }
    }
}

/// The order of minimum degree, and the later neighbours of each row in it.
fn eliminate(mut neighbours: Vec<BTreeSet<u32>>) -> (Vec<u32>, Vec<Vec<u32>>) {
    let mut queue: BTreeSet<(usize, u32)> =
        neighbours.iter().enumerate().map(|(row, met)| (met.len(), row as u32)).collect();
    let (mut order, mut rows) = (Vec::new(), Vec::new());
    let watch = Watch::begin();
    while let Some((_, row)) = queue.pop_first() {
        watch.look();
        let met: Vec<u32> = std::mem::take(&mut neighbours[row as usize]).into_iter().collect();
        for a in &met {
            let others = &mut neighbours[*a as usize];
            queue.remove(&(others.len(), *a));
            others.remove(&row);
            others.extend(met.iter().filter(|b| *b != a));
            queue.insert((others.len(), *a));
        }
        order.push(row);
        rows.push(met);
    }
    (order, rows)
}

#[cfg(test)]
mod tests {
    use super::SparseMatrix;

    /// A ring with a chord and a lone row. The product of the matrix with a known vector is solved.
    #[test]
    fn a_known_vector_is_found_again() {
        let pairs = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 0], [1, 3]];
        let mut matrix = SparseMatrix::new(6, pairs.into_iter());
        let known = [3.0, -1.0, 4.0, 1.0, -5.0, 9.0];
        for scale in [1.0, 2.0] {
            matrix.clear();
            let mut right = [0.0; 6];
            for (row, value) in known.iter().enumerate() {
                let diagonal = 5.0 * scale + row as f64;
                matrix.add_diagonal(row, diagonal);
                right[row] += diagonal * value;
            }
            for [a, b] in pairs {
                matrix.add(a, b, -scale);
                matrix.add(b, a, -0.5 * scale);
                right[a] -= scale * known[b];
                right[b] -= 0.5 * scale * known[a];
            }
            assert!(matrix.factor());
            matrix.solve(&mut right);
            for (computed, known) in right.iter().zip(known) {
                assert!((computed - known).abs() < 1e-13, "{computed} {known}");
            }
        }
    }

    #[test]
    fn a_singular_matrix_is_seen() {
        let mut matrix = SparseMatrix::new(2, [[0, 1]].into_iter());
        for row in 0..2 {
            matrix.add_diagonal(row, 1.0);
            matrix.add(row, 1 - row, -1.0);
        }
        assert!(!matrix.factor());
    }
}
