//! Closed-form solutions: transition curves and conducting networks.

use crate::thermal::network::{Network, NodeKind};

/// Temperature [K] after a number of steps from rest to a target: eqs. 1 to 4 of Vural et al. 2023.
pub(crate) fn curve(power: i32, t_max: f64, old: f64, target: f64, steps: f64) -> f64 {
    let left = (1.0 - (steps / t_max).min(1.0)).powi(power);
    old * left + target * (1.0 - left)
}

/// The solution of a conducting network under constant heat: a sum over the modes of its symmetric form sqrt(C) T. All
/// nodes must store heat.
pub(crate) struct Modes {
    roots: Vec<f64>,
    /// Rate [1/s] and vector of each mode.
    rates: Vec<f64>,
    vectors: Vec<Vec<f64>>,
    start: Vec<f64>,
    forced: Vec<f64>,
}

impl Modes {
    /// Solves the eigenvalue problem. `None` if a node stores no heat, radiates or is a boundary.
    pub(crate) fn of(network: &Network, heat: &[f64]) -> Option<Self> {
        let count = network.len();
        let plain = network.radiative.is_empty()
            && network.emissive_areas.iter().all(|area| *area == 0.0)
            && network.kinds.iter().all(|kind| *kind == NodeKind::Diffusive);
        if !plain {
            return None;
        }
        let roots: Vec<f64> = network.capacitances.iter().map(|capacitance| capacitance.sqrt()).collect();
        let mut matrix = vec![vec![0.0; count]; count];
        for conductor in &network.linear {
            let [a, b] = conductor.nodes.map(|node| node as usize);
            matrix[a][a] += conductor.conductance / network.capacitances[a];
            matrix[b][b] += conductor.conductance / network.capacitances[b];
            matrix[a][b] -= conductor.conductance / (roots[a] * roots[b]);
            matrix[b][a] -= conductor.conductance / (roots[a] * roots[b]);
        }
        let (rates, vectors) = eigen(matrix);
        let onto = |values: &dyn Fn(usize) -> f64| {
            vectors.iter().map(|vector| (0..count).map(|node| vector[node] * values(node)).sum()).collect()
        };
        let start = onto(&|node| roots[node] * network.temperatures[node]);
        let forced = onto(&|node| heat[node] / roots[node]);
        Some(Self { roots, rates, vectors, start, forced })
    }

    /// Temperatures [K] at a time [s].
    pub(crate) fn at(&self, time: f64) -> Vec<f64> {
        let mut sums = vec![0.0; self.roots.len()];
        for (mode, vector) in self.vectors.iter().enumerate() {
            let x = self.rates[mode] * time;
            // (1 - e^-x) / rate. For a mode that does not decay it equals the time.
            let grown = if x.abs() < 1e-9 { time } else { -(-x).exp_m1() / self.rates[mode] };
            let amplitude = self.start[mode] * (-x).exp() + self.forced[mode] * grown;
            for (sum, vector) in sums.iter_mut().zip(vector) {
                *sum += amplitude * vector;
            }
        }
        sums.iter().zip(&self.roots).map(|(sum, root)| sum / root).collect()
    }
}

/// Number of Jacobi sweeps. Ten are enough to reach rounding.
const SWEEPS: usize = 20;

/// Eigenvalues and eigenvectors of a symmetric matrix by Jacobi rotations (Golub & Van Loan, 8.5).
fn eigen(mut matrix: Vec<Vec<f64>>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let count = matrix.len();
    let mut vectors: Vec<Vec<f64>> =
        (0..count).map(|row| (0..count).map(|column| f64::from(u8::from(row == column))).collect()).collect();
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for p in 0..count {
            for q in p + 1..count {
                let off = matrix[p][q];
                if off.abs() <= 1e-18 * (matrix[p][p] * matrix[q][q]).abs().sqrt() || off == 0.0 {
                    continue;
                }
                rotated = true;
                let tau = (matrix[q][q] - matrix[p][p]) / (2.0 * off);
                let tangent = tau.signum() / (tau.abs() + tau.hypot(1.0));
                let cosine = 1.0 / tangent.hypot(1.0);
                let sine = tangent * cosine;
                for row in &mut matrix {
                    let (a, b) = (row[p], row[q]);
                    row[p] = cosine * a - sine * b;
                    row[q] = sine * a + cosine * b;
                }
                rotate(&mut matrix, [p, q], cosine, sine);
                // The rows of `vectors` are the eigenvectors.
                rotate(&mut vectors, [p, q], cosine, sine);
            }
        }
        if !rotated {
            break;
        }
    }
    ((0..count).map(|mode| matrix[mode][mode]).collect(), vectors)
}

/// Rotates two rows into each other. `p` must be below `q`.
fn rotate(rows: &mut [Vec<f64>], [p, q]: [usize; 2], cosine: f64, sine: f64) {
    let (above, below) = rows.split_at_mut(q);
    for (a, b) in above[p].iter_mut().zip(&mut below[0]) {
        (*a, *b) = (cosine * *a - sine * *b, sine * *a + cosine * *b);
    }
}

/// The zero of a falling function between two bounds, by bisection.
pub(crate) fn root_of_falling(function: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if function(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::network::LinearConductor;

    /// Two nodes of 100 and 300 J/K joined by 2 W/K. Their difference decays at 2 (1/100 + 1/300) 1/s.
    #[test]
    fn modes_of_two_nodes_are_those_of_their_closed_form() {
        let network = Network {
            kinds: vec![NodeKind::Diffusive; 2],
            capacitances: vec![100.0, 300.0],
            emissive_areas: vec![0.0; 2],
            temperatures: vec![250.0, 350.0],
            linear: vec![LinearConductor { nodes: [0, 1], conductance: 2.0 }],
            ..Network::default()
        };
        let modes = Modes::of(&network, &[8.0, 0.0]).unwrap();
        let rate = 2.0 * (1.0 / 100.0 + 1.0 / 300.0);
        // With 8 W on the first node the difference tends to (8/100) / rate, and the mean rises by 8 / 400 K/s.
        let steady = -(8.0 / 100.0) / rate;
        for time in [0.0_f64, 10.0, 500.0] {
            let gap = steady + (100.0 - steady) * (-rate * time).exp();
            let mean = 325.0 + 8.0 / 400.0 * time;
            let computed = modes.at(time);
            assert!((computed[0] - (mean - 0.75 * gap)).abs() < 1e-9, "{time}: {computed:?}");
            assert!((computed[1] - (mean + 0.25 * gap)).abs() < 1e-9, "{time}: {computed:?}");
        }
        assert!(Modes::of(&Network { emissive_areas: vec![0.1, 0.0], ..network }, &[0.0; 2]).is_none());
    }

    #[test]
    fn curves_are_the_papers() {
        assert!((curve(2, 100.0, 2.7, 267.0, 50.0) - 200.925).abs() < 1e-9);
        assert!((curve(1, 361.0, 2.7, 267.0, 1.0) - 3.432_133).abs() < 1e-6);
        assert_eq!(curve(2, 100.0, 2.7, 267.0, 1000.0), 267.0);
    }
}
