//! Newton's method on the balances of some nodes of a network: the arithmetic ones, or all that are no boundary.

use super::sparse::SparseMatrix;
use super::{Network, radiative_slope};

/// Iterations after which a balance counts as not found. A start at 1000 times the answer takes 30; a balance at 0 K,
/// where the slope vanishes, is approached by a quarter each.
const MOST_ITERATIONS: u32 = 300;
/// Change of a temperature [K] below which an iteration was the last.
const CONVERGED: f64 = 1e-10;
/// Relative part of it, for temperatures whose own rounding is coarser.
const CONVERGED_RELATIVE: f64 = 1e-13;
/// A temperature grows at most by this [K] and its own double in an iteration, and falls at most to half.
const LARGEST_RISE: f64 = 10.0;

/// Temperature [K] below which its slope stands for all: at 0 K radiation has none, and no start could leave it.
const COLDEST_SLOPE: f64 = 0.01;
/// Iterations after which a node that is colder than that and still falls is taken to 0 K, where no heat balances it: at
/// 0.01 K a black square metre radiates 6e-16 W, and under one slope for all the rest of the way would not end.
const FALLING: u32 = 40;

fn slope(temperature: f64) -> f64 {
    radiative_slope(temperature.max(COLDEST_SLOPE))
}

/// The nodes whose temperatures are sought, and the matrix of their balances.
#[derive(Debug, Clone)]
pub(super) struct Newton {
    nodes: Vec<usize>,
    /// Row of each node of the network; `None` where its temperature is given.
    row_of: Vec<Option<usize>>,
    matrix: SparseMatrix,
    right: Vec<f64>,
    /// Iterations so far.
    pub(super) iterations: u64,
}

impl Newton {
    /// Balances of the nodes that `sought` picks.
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

    /// Whether nothing is sought.
    pub(super) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Factors minus the slopes of the exchanged heat [W/K], with `capacity` [W/K] added to the diagonal of a node.
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

    /// A conductor whose heat changes by `slopes` [W/K] with the temperature of its one end and of its other.
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

    /// Solves with the last factors: `heat` [W] of every node of the network becomes a change of temperature [K];
    /// that of a node that is not sought is 0.
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

    /// Seeks the temperatures at which `residual` [W] vanishes at every sought node; the start is `temperatures`.
    /// `residual` falls with a node's own temperature by the slopes of the exchanged heat and by `capacity` [W/K].
    /// Returns whether they were found, all finite and none below 0 K; `temperatures` is spoilt where not.
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
            // Old factors serve as long as each iteration gains a digit and a half.
            fresh = !limited && largest < 0.03 * last;
            last = largest;
        }
        false
    }
}
