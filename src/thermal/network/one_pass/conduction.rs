//! The matrices by which a block of nodes conducts over a step, without the exchange of nodes that are far from each other.

use super::exponential::exponentials;

/// Weights up to which two nodes exchange nothing. Heat that goes further than a few nodes in a step is far below the rounding of the device.
const NOTHING: f64 = 1e-7;

/// The values that define the matrices of blocks that are copies of each other.
#[derive(Debug)]
pub(super) struct BlockKind {
    /// Capacitance of each node over their mean.
    pub(crate) shares: Vec<f64>,
    /// Conductors: two places in the block, and the conductance over the mean capacitance [1/s].
    pub(crate) rates: Vec<([u32; 2], f64)>,
}

/// The weights of a row, from the first that is not 0 to the last.
#[derive(Debug, Clone, PartialEq, Default)]
struct WeightRow {
    first: usize,
    weights: Vec<[f64; 2]>,
}

/// The matrices of blocks that are copies of each other. Both are symmetric, times a node's capacitance over the block's mean. A row of a matrix with
/// the differences of other nodes to its node gives the change of that node. The diagonal is 0.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Conduction(Vec<WeightRow>);

impl Conduction {
    pub(super) fn new(BlockKind { shares, rates }: &BlockKind, step: f64) -> Self {
        let size = shares.len();
        // With temperatures times the root of the capacitance, the matrix of the rates is symmetric.
        let roots: Vec<f64> = shares.iter().map(|share| share.sqrt()).collect();
        let mut matrix = vec![0.0; size * size];
        for ([a, b], rate) in rates {
            let [a, b] = [*a, *b].map(|at| at as usize);
            let moved = step * rate;
            matrix[a * size + a] += moved / shares[a];
            matrix[b * size + b] += moved / shares[b];
            matrix[a * size + b] -= moved / (roots[a] * roots[b]);
            matrix[b * size + a] -= moved / (roots[a] * roots[b]);
        }
        let [drive, start] = exponentials(&matrix, size);
        let weights = |row: usize, column: usize| {
            let scale = roots[row] * roots[column];
            let weights = [drive[row * size + column] * scale, start[row * size + column] * scale];
            let is_something = row != column && weights.iter().any(|weight| weight.abs() > NOTHING);
            if is_something { weights } else { [0.0; 2] }
        };
        let row = |row: usize| {
            let mut kept = (0..size).filter(|column| weights(row, *column) != [0.0; 2]);
            let Some(first) = kept.next() else { return WeightRow::default() };
            let last = kept.next_back().unwrap_or(first);
            WeightRow { first, weights: (first..=last).map(|column| weights(row, column)).collect() }
        };
        Self((0..size).map(row).collect())
    }

    pub(crate) fn size(&self) -> usize {
        self.0.len()
    }

    /// Number of weights of each matrix.
    pub(crate) fn weights(&self) -> usize {
        self.0.iter().map(|row| row.weights.len()).sum()
    }

    /// First column of a row with a weight, and the one after the last.
    pub(crate) fn columns(&self, row: usize) -> [usize; 2] {
        let WeightRow { first, weights } = &self.0[row];
        [*first, first + weights.len()]
    }

    /// Weights of two differences between another node and this one: of the heat received in the step, and of the temperature at the start.
    pub(crate) fn at(&self, row: usize, column: usize) -> [f64; 2] {
        let WeightRow { first, weights } = &self.0[row];
        column.checked_sub(*first).and_then(|at| weights.get(at)).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of equal nodes with moderate conductors: far weights fall off, near ones are those of the whole matrices.
    #[test]
    fn far_nodes_exchange_nothing_and_heat_is_conserved() {
        let size = 60;
        let rates = (1..size as u32).map(|node| ([node - 1, node], 0.7)).collect();
        let kind = BlockKind { shares: vec![1.0; size], rates };
        let computed = Conduction::new(&kind, 1.0);
        let mut matrix = vec![0.0; size * size];
        for ([a, b], rate) in &kind.rates {
            let [a, b] = [*a, *b].map(|at| at as usize);
            for (row, column, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
                matrix[row * size + column] += sign * rate;
            }
        }
        let whole = exponentials(&matrix, size);
        for (row, column) in (0..size).flat_map(|row| (0..size).map(move |column| (row, column))) {
            let at = row * size + column;
            let expected = if row == column { [0.0; 2] } else { [whole[0][at], whole[1][at]] };
            let weights = computed.at(row, column);
            assert!((0..2).all(|k| (weights[k] - expected[k]).abs() <= NOTHING), "{row} {column}");
            assert_eq!(weights, computed.at(column, row), "what leaves a node enters the other");
        }
        assert!(computed.weights() < size * size / 2, "{} weights", computed.weights());
        assert_eq!(computed.columns(0)[0], 1);
    }
}
