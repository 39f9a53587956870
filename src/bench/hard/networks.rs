//! Hard cases of networks: extreme capacitances and conductances, thermostats, and cold.

use super::case::{apart, worst_of};
use crate::thermal::network::{LinearConductor, Network, NodeKind};

pub(crate) mod cold;
pub(crate) mod conducting;
pub(crate) mod massless;
pub(crate) mod thermostats;

/// Error limit of the default integrator [K], and its source.
const DEFAULT: (f64, &str) = (20e-3, "docs/numerics.md 6, default");
/// Length of a frame in the paper's orbit [s].
const FRAME: f64 = 16.7;

#[derive(Default)]
struct Built(Network);

impl Built {
    fn node(&mut self, kind: NodeKind, capacitance: f64, area: f64, temperature: f64) -> u32 {
        self.0.kinds.push(kind);
        self.0.capacitances.push(capacitance);
        self.0.emissive_areas.push(area);
        self.0.temperatures.push(temperature);
        self.0.len() as u32 - 1
    }

    fn store(&mut self, capacitance: f64, temperature: f64) -> u32 {
        self.node(NodeKind::Diffusive, capacitance, 0.0, temperature)
    }

    fn join(&mut self, a: u32, b: u32, conductance: f64) {
        self.0.linear.push(LinearConductor { nodes: [a, b], conductance });
    }
}

/// Largest difference of two lists of rows.
fn rows_apart(computed: &[Vec<f64>], expected: &[Vec<f64>]) -> f64 {
    if computed.len() != expected.len() {
        return f64::INFINITY;
    }
    computed.iter().zip(expected).fold(0.0, |worst, (a, b)| worst_of(worst, apart(a, b)))
}
