//! The heat balances of a network in f64, shared by all methods of integration.

use super::newton::Newton;
use super::stepper::WorkCounts;
use super::{Network, NodeKind};

/// Power and slope of the heat of every node.
#[derive(Debug, Clone, Default)]
pub(super) struct Heat {
    pub(super) power: Vec<f64>,
    pub(super) slope: Vec<f64>,
}

/// The constant data of a sub-step.
#[derive(Debug, Clone)]
pub(super) struct System {
    pub(super) network: Network,
    pub(super) heat: Heat,
    pub(super) arithmetic: Newton,
    /// Balances of all nodes but boundaries. `None` until a method needs them, because their matrix is large.
    pub(super) all: Option<Newton>,
    pub(super) counts: WorkCounts,
}

impl System {
    /// Heat into every node [W]: its own at `t` plus its exchange.
    pub(super) fn heat(&mut self, t: f64, temperatures: &[f64], out: &mut [f64]) {
        self.counts.stages += 1;
        heat(&self.network, &self.heat, t, temperatures, out);
    }

    /// dT/dt of diffusive nodes [K/s]. 0 for other nodes.
    pub(super) fn rate(&mut self, t: f64, temperatures: &[f64], out: &mut [f64]) {
        self.heat(t, temperatures, out);
        let nodes = self.network.kinds.iter().zip(&self.network.capacitances);
        for (rate, (kind, capacitance)) in out.iter_mut().zip(nodes) {
            *rate = if *kind == NodeKind::Diffusive { *rate / capacitance } else { 0.0 };
        }
    }

    /// Balances all arithmetic nodes at `t` together. Returns whether they converged.
    pub(super) fn balance(&mut self, t: f64, temperatures: &mut [f64]) -> bool {
        if self.arithmetic.is_empty() {
            return true;
        }
        let (network, sources) = (&self.network, &self.heat);
        let is_balanced =
            self.arithmetic.find(network, temperatures, |_| 0.0, |now, out| heat(network, sources, t, now, out));
        self.counts.iterations += std::mem::take(&mut self.arithmetic.iterations);
        is_balanced
    }

    /// Finds the temperatures at which C (T - T0) = span (W(T) + heat at `t`) for diffusive nodes, with `base` [W] = C T0 / span, and at which arithmetic
    /// nodes balance.
    pub(super) fn implicit(&mut self, t: f64, span: f64, base: &[f64], temperatures: &mut [f64]) -> bool {
        let mut all = self.take_all();
        let (network, sources) = (&self.network, &self.heat);
        let is_balanced = all.find(
            network,
            temperatures,
            |node| network.capacitances[node] / span,
            |now, out| {
                heat(network, sources, t, now, out);
                for (node, out) in out.iter_mut().enumerate() {
                    if network.kinds[node] == NodeKind::Diffusive {
                        *out += network.capacitances[node] / span * (base[node] - now[node]);
                    }
                }
            },
        );
        self.put_all(all);
        is_balanced
    }

    /// Takes the balances of all nodes but boundaries, and creates them at first use. `put_all` returns them.
    pub(super) fn take_all(&mut self) -> Newton {
        let network = &self.network;
        self.all.take().unwrap_or_else(|| Newton::new(network, |node| network.kinds[node] != NodeKind::Boundary))
    }

    pub(super) fn put_all(&mut self, mut all: Newton) {
        self.counts.iterations += std::mem::take(&mut all.iterations);
        self.all = Some(all);
    }
}

pub(super) fn heat(network: &Network, sources: &Heat, t: f64, temperatures: &[f64], out: &mut [f64]) {
    network.exchanged_heat(temperatures, out);
    for ((out, power), slope) in out.iter_mut().zip(&sources.power).zip(&sources.slope) {
        *out += power + slope * t;
    }
}

/// Temperatures, with their rates where known.
#[derive(Debug, Clone, Default)]
pub(super) struct SystemState {
    pub(super) temperatures: Vec<f64>,
    /// dT/dt at `temperatures` [K/s].
    pub(super) rates: Vec<f64>,
    pub(super) rates_known: bool,
}

pub(super) fn in_range(temperatures: &[f64]) -> bool {
    // All are looked at, which takes less time than to stop at the first.
    temperatures.iter().fold(true, |all, temperature| all & (*temperature >= 0.0) & (*temperature < f64::INFINITY))
}
