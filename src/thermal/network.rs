//! A lumped-parameter thermal network: nodes, linear and radiative conductors, and their energy balance in f64.
//!
//! C dT/dt = Q + sum GL (Tj - Ti) + sum GR sigma (Tj^4 - Ti^4) - eA sigma (T^4 - T_space^4), docs/numerics.md 3. Diffusive nodes store heat. Arithmetic
//! nodes (C = 0) balance at every moment. Boundary nodes keep their temperature.

pub(crate) mod connection;
pub(crate) mod control;
pub(crate) mod islands;
mod newton;
pub(crate) mod one_pass;
pub(crate) mod periodic;
pub(crate) mod reference;
pub(crate) mod rkl2;
pub(crate) mod schedule;
mod sparse;
pub(crate) mod steady;
pub(crate) mod stepper;
mod switches;
mod system;
pub(crate) mod tr_bdf2;

use super::STEFAN_BOLTZMANN;

/// Kind of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeKind {
    /// A diffusive node: it stores heat.
    Diffusive,
    /// An arithmetic node: it stores no heat and balances at every moment.
    Arithmetic,
    /// A boundary node: it keeps its temperature.
    Boundary,
}

impl NodeKind {
    /// Name in a network file.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Diffusive => "diffusive",
            Self::Arithmetic => "arithmetic",
            Self::Boundary => "boundary",
        }
    }
}

/// A linear conductor: its heat is proportional to the difference of the temperatures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearConductor {
    /// Numbers of the two nodes.
    pub nodes: [u32; 2],
    /// Linear conductance GL [W/K].
    pub conductance: f64,
}

/// A radiative conductor: its heat is proportional to the difference of the fourth powers of the temperatures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadiativeConductor {
    /// Numbers of the two nodes.
    pub nodes: [u32; 2],
    /// Radiative conductance GR [m2], without the Stefan-Boltzmann constant.
    pub exchange_area: f64,
}

/// A thermal network: one entry for each node in every array, and the conductors.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Network {
    /// Radiative temperature of space [K].
    pub space_temperature: f64,
    /// Kind of each node.
    pub kinds: Vec<NodeKind>,
    /// Capacitance C [J/K]. 0 unless diffusive.
    pub capacitances: Vec<f64>,
    /// Emissivity x area that sees space [m2].
    pub emissive_areas: Vec<f64>,
    /// Temperatures at the start [K]. For an arithmetic node this is where the search for its balance begins.
    pub temperatures: Vec<f64>,
    /// Linear conductors.
    pub linear: Vec<LinearConductor>,
    /// Radiative conductors.
    pub radiative: Vec<RadiativeConductor>,
}

impl Network {
    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// Whether there are no nodes.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// Heat from space and from neighbours into every node [W], written to `out`.
    pub fn exchanged_heat(&self, temperatures: &[f64], out: &mut [f64]) {
        for ((out, area), temperature) in out.iter_mut().zip(&self.emissive_areas).zip(temperatures) {
            *out = area * radiated(self.space_temperature, *temperature);
        }
        self.add_conducted_heat(temperatures, out);
    }

    /// Adds the heat of all conductors into every node [W] to `out`.
    pub(crate) fn add_conducted_heat(&self, temperatures: &[f64], out: &mut [f64]) {
        for conductor in &self.linear {
            let [a, b] = conductor.nodes.map(|node| node as usize);
            let heat = conductor.conductance * (temperatures[b] - temperatures[a]);
            out[a] += heat;
            out[b] -= heat;
        }
        for conductor in &self.radiative {
            let [a, b] = conductor.nodes.map(|node| node as usize);
            let heat = conductor.exchange_area * radiated(temperatures[b], temperatures[a]);
            out[a] += heat;
            out[b] -= heat;
        }
    }

    /// An upper bound of the relaxation rate of all diffusive nodes [1/s]: the largest 2 (sum GL + 4 sigma T^3 (sum GR + eA)) / C (docs/numerics.md 3). T
    /// is the hotter end of each exchange.
    pub(crate) fn fastest_rate(&self, temperatures: &[f64]) -> f64 {
        self.rates(temperatures).into_iter().fold(0.0, f64::max)
    }

    /// Such a bound for each node [1/s]. 0 for nodes that are not diffusive.
    fn rates(&self, temperatures: &[f64]) -> Vec<f64> {
        let mut sums: Vec<f64> = self
            .emissive_areas
            .iter()
            .zip(temperatures)
            .map(|(area, temperature)| area * radiative_slope(*temperature))
            .collect();
        for conductor in &self.linear {
            for node in conductor.nodes {
                sums[node as usize] += conductor.conductance;
            }
        }
        for conductor in &self.radiative {
            let [a, b] = conductor.nodes.map(|node| node as usize);
            let slope = conductor.exchange_area * radiative_slope(temperatures[a].max(temperatures[b]));
            sums[a] += slope;
            sums[b] += slope;
        }
        for ((sum, capacitance), kind) in sums.iter_mut().zip(&self.capacitances).zip(&self.kinds) {
            *sum = if *kind == NodeKind::Diffusive { 2.0 * *sum / capacitance } else { 0.0 };
        }
        sums
    }
}

/// sigma (Ta^4 - Tb^4) [W/m2], as a product that does not cancel where the temperatures are close.
pub(crate) fn radiated(a: f64, b: f64) -> f64 {
    STEFAN_BOLTZMANN * (a - b) * (a + b) * (a * a + b * b)
}

/// d(sigma T^4)/dT [W m-2 K-1].
pub(crate) fn radiative_slope(temperature: f64) -> f64 {
    4.0 * STEFAN_BOLTZMANN * temperature * temperature * temperature
}
