//! Newton's method on the heat balances of a network: of the arithmetic nodes, or of all nodes but boundaries.

use super::sparse::SparseMatrix;
use super::{Network, radiative_slope};

/// Greatest number of iterations. A start at 1000 times the answer takes 30. Towards 0 K, where the slope vanishes, an iteration gains only a quarter.
const MOST_ITERATIONS: u32 = 300;
/// Change of temperature [K] at which the iteration ends.
const CONVERGED: f64 = 1e-10;
/// Relative part of that change, for temperatures whose rounding is coarser.
const CONVERGED_RELATIVE: f64 = 1e-13;
/// Growth of a temperature in an iteration is limited to this [K] plus its double. A temperature falls at most to half.
const LARGEST_RISE: f64 = 10.0;

/// Temperature below which its slope is used for all [K]. At 0 K the slope of radiation is 0, so no start could leave 0 K.
const COLDEST_SLOPE: f64 = 0.01;
/// Number of iterations after which a colder node that still falls is set to 0 K. At 0.01 K a black square metre radiates only 6e-16 W, and with a constant
/// slope the rest of the way would not end.
const FALLING: u32 = 40;

fn slope(temperature: f64) -> f64 {
    radiative_slope(temperature.max(COLDEST_SLOPE))
}

/// The nodes whose temperatures are unknown, and the matrix of their balances.
#[derive(Debug, Clone)]
pub(super) struct Newton {
    nodes: Vec<usize>,
    /// Row of each node of the network. `None` where its temperature is known.
    row_of: Vec<Option<usize>>,
    matrix: SparseMatrix,
    right: Vec<f64>,
    pub(super) iterations: u64,
}

impl Newton {
    /// Balances of the nodes for which `sought` is true.
    pub(super) fn new(network: &Network, sought: impl Fn(usize) -> bool) -> Self {
        let nodes: Vec<usize> = (0..network.len()).filter(|node| sought(*node)).collect();
        let mut row_of = vec![None; network.len()];
        for (row, node) in nodes.iter().enumerate() {
            row_of[*node] = Some(row);
        }
        let linear = network.linear.iter().map(|conductor| conductor.nodes);
        let radiative = network.radiative.iter().map(|conductor| conductor.nodes);
        let pairs = linear.chain(radiative).filter_map(|[a, b]| Some([row_of[a as usize]?, row_of[b as usize]?]));
        let matrix = SparseMatrix::new(nodes.len(), pairs.collect::<Vec<_>>().into_iter());
        let right = vec![0.0; nodes.len()];
        Self { nodes, row_of, matrix, right, iterations: 0 }
    }

    /// Whether no temperature is unknown.
    pub(super) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Factors the negative slopes of the exchanged heat [W/K], with `capacity` [W/K] added to the diagonal of each node.
    pub(super) fn factor(&mut self, network: &Network, temperatures: &[f64], capacity: impl Fn(usize) -> f64) -> bool {
        self.matrix.clear();
        for (row, node) in self.nodes.iter().enumerate() {
            let lost = network.emissive_areas[*node] * slope(temperatures[*node]);
            self.matrix.add_diagonal(row, lost + capacity(*node));
        }
        for conductor in &network.linear {
            self.add(conductor.nodes, [conductor.conductance; 2]);
        }
        for conductor in &network.radiative {
            let slopes = conductor.nodes.map(|node| slope(temperatures[node as usize]));
            self.add(conductor.nodes, slopes.map(|slope| conductor.exchange_area * slope));
        }
        self.matrix.factor()
    }

    /// Adds a conductor whose heat changes by `slopes` [W/K] with the temperatures of its two ends.
    fn add(&mut self, nodes: [u32; 2], slopes: [f64; 2]) {
        let rows = nodes.map(|node| self.row_of[node as usize]);
        for (end, row) in rows.iter().enumerate() {
            let Some(row) = row else { continue };
            self.matrix.add_diagonal(*row, slopes[end]);
            if let Some(other) = rows[1 - end] {
                self.matrix.add(*row, other, -slopes[1 - end]);
            }
        }
    }

    /// Solves with the last factors. The `heat` [W] of every node is replaced by a change of temperature [K], which is 0 for known nodes.
    pub(super) fn solve(&mut self, heat: &mut [f64]) {
        for (right, node) in self.right.iter_mut().zip(&self.nodes) {
            *right = heat[*node];
        }
        self.matrix.solve(&mut self.right);
        heat.fill(0.0);
        for (right, node) in self.right.iter().zip(&self.nodes) {
            heat[*node] = *right;
        }
    }

    /// Finds the temperatures at which `residual` [W] vanishes at every unknown node, starting at `temperatures`. `residual` falls with a node's own
    /// temperature by the slopes of the exchanged heat and by `capacity` [W/K]. Returns whether the result is finite and nowhere below 0 K. Otherwise
    /// `temperatures` is invalid.
    pub(super) fn find(
        &mut self,
        network: &Network,
        temperatures: &mut [f64],
        capacity: impl Fn(usize) -> f64,
        mut residual: impl FnMut(&[f64], &mut [f64]),
    ) -> bool {
        if self.is_empty() {
            return true;
        }
        let mut change = vec![0.0; network.len()];
        let mut fresh = false;
        let mut last = f64::INFINITY;
        for iteration in 0..MOST_ITERATIONS {
            self.iterations += 1;
            if !fresh && !self.factor(network, temperatures, &capacity) {
                return false;
            }
            residual(temperatures, &mut change);
            self.solve(&mut change);
            let (mut largest, mut limited) = (0.0_f64, false);
            let mut converged = true;
            for node in &self.nodes {
                let old = temperatures[*node];
                if iteration >= FALLING && old > 0.0 && old < COLDEST_SLOPE && change[*node] < 0.0 {
                    temperatures[*node] = 0.0;
                    converged = false;
                    continue;
                }
                let new = (old + change[*node]).clamp(0.5 * old, 2.0 * old + LARGEST_RISE);
                if !new.is_finite() {
                    return false;
                }
                limited |= new != old + change[*node];
                largest = largest.max((new - old).abs());
                converged &= (new - old).abs() <= CONVERGED + CONVERGED_RELATIVE * old;
                temperatures[*node] = new;
            }
            if converged && !limited {
                return true;
            }
            // Old factors are used while each iteration gains a digit and a half.
            fresh = !limited && largest < 0.03 * last;
            last = largest;
        }
        false
    }
}
