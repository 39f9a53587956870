//! The periodic state of a network whose heat repeats, by accelerated orbits.
//!
//! If a state gains C (T1 - T0) over an orbit, plain repetition would continue for many time constants. The method moves it to the temperatures at which
//! the mean balance over the orbit loses as much more as was gained. In a linear network a mode that relaxes at rate r then keeps the share 1 - (1 -
//! e^-x)(1 + 1/x) of its error, with x = r P over a period P. This is x/2 for slow modes and at most 0.3 for any. A network with the many nodes of a mesh
//! is linearised instead of solved: [`SlowModes`].

use super::newton::Newton;
use super::reference::ReferenceStepper;
use super::{Network, NodeKind};

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PeriodicState {
    /// Temperatures [K] of every node at the times reported by `orbit`, in the periodic state.
    pub(crate) orbit: Vec<Vec<f64>>,
    pub(crate) orbits: u32,
    /// Correction of the start of the last orbit [K], which is its error.
    pub(crate) change: f64,
}

/// Most orbits. A strongly nonlinear network needs about ten.
pub(crate) const MOST_ORBITS: u32 = 60;

/// Finds the start [K] from which an orbit leads back to itself.
///
/// `orbit` computes an orbit from given temperatures, and reports temperatures at equal intervals, both ends included. `balance` solves the network
/// in f64 for the temperatures at which a heat balances. Returns the result when a start is known to `tolerance` [K]. Returns `None` after
/// [`MOST_ORBITS`], or where a balance was not found.
///
/// # Errors
/// Errors of `orbit`.
pub(crate) fn settle<E>(
    network: &Network,
    period: f64,
    tolerance: f64,
    balance: &mut ReferenceStepper,
    mut orbit: impl FnMut(&[f64]) -> Result<Vec<Vec<f64>>, E>,
) -> Result<Option<PeriodicState>, E> {
    let mut start = network.temperatures.clone();
    for orbits in 1..=MOST_ORBITS {
        let rows = orbit(&start)?;
        let Some((end, before)) = rows.split_last() else { return Ok(None) };
        let mean: Vec<f64> = (0..network.len())
            .map(|node| before.iter().map(|row| row[node]).sum::<f64>() / before.len() as f64)
            .collect();
        let mut heat = vec![0.0; network.len()];
        network.exchanged_heat(&mean, &mut heat);
        for (node, heat) in heat.iter_mut().enumerate() {
            *heat = network.capacitances[node] * (end[node] - start[node]) / period - *heat;
        }
        balance.set_heat(&heat, &vec![0.0; network.len()]);
        balance.set_temperatures(&mean);
        if !balance.steady(0.0) {
            // By rounding, a node that only cools may lack heat even against space. Such a node then aims at the temperature of space.
            heat.iter_mut().for_each(|heat| *heat = heat.max(0.0));
            balance.set_heat(&heat, &vec![0.0; network.len()]);
            balance.set_temperatures(&mean);
            if !balance.steady(0.0) {
                return Ok(None);
            }
        }
        let ahead = balance.temperatures();
        let next: Vec<f64> = (0..network.len()).map(|node| end[node] + ahead[node] - mean[node]).collect();
        let moves = (0..network.len()).filter(|node| network.capacitances[*node] > 0.0);
        if next.iter().any(|next| !next.is_finite()) {
            return Ok(None);
        }
        let change = moves.map(|node| (next[node] - start[node]).abs()).fold(0.0, f64::max);
        if change <= tolerance {
            return Ok(Some(PeriodicState { orbit: rows, orbits, change }));
        }
        // The correction of a nonlinear network must stay within the range of temperatures.
        start = next.iter().zip(end).map(|(next, end)| next.max(0.5 * end)).collect();
    }
    Ok(None)
}

/// Extrapolates a network from one orbit to its periodic state, linearised at the mean temperatures of the orbit.
///
/// A mode of rate r that gained d over a period P is d / (e^x - 1) short of its periodic state at the end of the orbit, with x = r P. The method moves it
/// by d / (x (1 + x/2)), which needs two linear solves. This leaves at most 0.09 of the error before the orbit, and x^2/6 for a slow mode.
///
/// Heat that nodes send to each other besides the conductors of the network is a [`Coupling`]. Each solve is then repeated with the heat that the
/// changes found so far send. The repetition converges, because no node sends more than it emits.
#[derive(Debug)]
pub(crate) struct SlowModes<'a> {
    network: &'a Network,
    period: f64,
    newton: Newton,
}

/// Changes of the heat that nodes receive from each other [W], from changes of their temperatures [K].
pub(crate) type Coupling<'a> = &'a dyn Fn(&[f64]) -> Vec<f64>;

const MOST_REPETITIONS: usize = 100;
/// A solve ends where a repetition changes no node by more than this share of the largest change.
const REPEATED: f64 = 0.01;

impl<'a> SlowModes<'a> {
    /// For a network whose heat repeats after `period` [s].
    pub(crate) fn new(network: &'a Network, period: f64) -> Self {
        let newton = Newton::new(network, |node| network.kinds[node] != NodeKind::Boundary);
        Self { network, period, newton }
    }

    /// Temperatures [K] nearer to the periodic state than `end`, from an orbit with this `start` and these means. `None` where a part of the network can
    /// not lose heat.
    pub(crate) fn ahead(
        &mut self,
        start: &[f64],
        end: &[f64],
        mean: &[f64],
        coupling: Option<Coupling<'_>>,
    ) -> Option<Vec<f64>> {
        let (network, period) = (self.network, self.period);
        let capacity = |node: usize| network.capacitances[node] / period;
        let mut change: Vec<f64> =
            (0..network.len()).map(|node| 2.0 * capacity(node) * (end[node] - start[node])).collect();
        if !self.newton.factor(network, mean, |node| 2.0 * capacity(node)) {
            return None;
        }
        self.solve(&mut change, coupling);
        change.iter_mut().enumerate().for_each(|(node, change)| *change *= capacity(node));
        if !self.newton.factor(network, mean, |_| 0.0) {
            return None;
        }
        self.solve(&mut change, coupling);
        let is_sound = |(end, change): (&f64, &f64)| *end >= 0.0 && (end + change).is_finite();
        if !end.iter().zip(&change).all(is_sound) {
            return None;
        }
        // The correction of a nonlinear network must stay within the range of temperatures.
        Some(end.iter().zip(&change).map(|(end, change)| (end + change).clamp(0.5 * end, 2.0 * end)).collect())
    }

    /// Replaces heat [W] by the changes of temperature [K] that carry it away. The heat that these changes send through `coupling` counts.
    fn solve(&mut self, heat: &mut [f64], coupling: Option<Coupling<'_>>) {
        let given = heat.to_vec();
        self.newton.solve(heat);
        let Some(coupling) = coupling else { return };
        for _ in 0..MOST_REPETITIONS {
            let mut next: Vec<f64> = given.iter().zip(coupling(heat)).map(|(given, more)| given + more).collect();
            self.newton.solve(&mut next);
            let largest = next.iter().fold(0.0f64, |most, change| most.max(change.abs()));
            let moved = next.iter().zip(&*heat).map(|(next, now)| (next - now).abs()).fold(0.0, f64::max);
            heat.copy_from_slice(&next);
            if moved <= REPEATED * largest {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::super::{LinearConductor, NodeKind};
    use super::*;

    /// A node of 1 J/K with a conductor to a boundary at 300 K.
    fn network(conductance: f64) -> Network {
        Network {
            space_temperature: 2.7,
            kinds: vec![NodeKind::Diffusive, NodeKind::Boundary],
            capacitances: vec![1.0, 0.0],
            emissive_areas: vec![0.0; 2],
            temperatures: vec![200.0, 300.0],
            linear: vec![LinearConductor { nodes: [0, 1], conductance }],
            radiative: Vec::new(),
        }
    }

    /// Settles it exactly over a period of 1 s, with 4 W in the first half.
    fn settled(rate: f64, tolerance: f64) -> Option<PeriodicState> {
        let network = network(rate);
        let mut balance = ReferenceStepper::new(network.clone(), &[]);
        let orbit = |start: &[f64]| {
            let mut rows = vec![vec![start[0], 300.0]];
            for part in 0..20 {
                let aim = 300.0 + if part < 10 { 4.0 / rate } else { 0.0 };
                let before = rows[part][0];
                rows.push(vec![aim + (before - aim) * (-rate / 20.0).exp(), 300.0]);
            }
            Ok::<_, Infallible>(rows)
        };
        settle(&network, 1.0, tolerance, &mut balance, orbit).unwrap()
    }

    #[test]
    fn slow_and_fast_nodes_settle_within_the_bound_of_the_module() {
        for rate in [1e-3, 0.03, 0.5, 1.8, 5.0, 50.0] {
            let settled = settled(rate, 1e-6).unwrap();
            // The periodic start: it gains in the first half and relaxes in the second.
            let half = (-0.5 * rate).exp();
            let exact = 300.0 + 4.0 / rate * (1.0 - half) * half / (1.0 - half * half);
            let start = settled.orbit[0][0];
            assert!((start - exact).abs() < 2e-6, "rate {rate}: {start} against {exact}");
            // Every orbit leaves at most 0.3 of the error. The first error is thousands of kelvins.
            let most = (1e4f64 / 1e-6).log(1.0 / 0.3).ceil() as u32 + 1;
            assert!(settled.orbits <= most, "rate {rate}: {} orbits", settled.orbits);
            assert!((settled.orbit[20][0] - start).abs() < 2e-6);
        }
        // Plain repetition would need 20,000 orbits for the slowest mode.
        assert!(settled(1e-3, 1e-6).unwrap().orbits <= 6);
        assert!((settled(1.0, 1.0).unwrap().orbit[0][0] - settled(1.0, 1e-9).unwrap().orbit[0][0]).abs() > 1e-6);
    }

    #[test]
    fn what_cannot_lose_its_heat_has_no_periodic_state() {
        let network = network(0.0);
        let mut balance = ReferenceStepper::new(network.clone(), &[]);
        let orbit = |start: &[f64]| Ok::<_, Infallible>(vec![start.to_vec(), vec![start[0] + 1.0, 300.0]]);
        assert_eq!(settle(&network, 1.0, 1e-3, &mut balance, orbit), Ok(None));
    }

    #[test]
    fn an_orbit_without_temperatures_has_no_periodic_state() {
        let network = network(1.0);
        let mut modes = SlowModes::new(&network, 1.0);
        let mut ahead = |end: f64| modes.ahead(&[300.0, 300.0], &[end, 300.0], &[300.5, 300.0], None);
        assert!(ahead(301.0).is_some());
        assert_eq!([f64::NAN, f64::INFINITY, -1.0].map(&mut ahead), [None, None, None]);
        let mut balance = ReferenceStepper::new(network.clone(), &[]);
        let orbit = |start: &[f64]| Ok::<_, Infallible>(vec![start.to_vec(), vec![f64::NAN, 300.0]]);
        assert_eq!(settle(&network, 1.0, 1e-3, &mut balance, orbit), Ok(None));
    }

    #[test]
    fn modes_of_any_rate_are_moved_nearly_to_their_periodic_state() {
        for rate in [1e-4_f64, 0.01, 0.3, 1.0, 2.0, 3.0, 10.0, 1e3] {
            let network = network(rate);
            // Starts 10 K above the periodic state under constant heat for 310 K. The mean is exact.
            let (start, periodic) = (320.0, 310.0);
            let end = periodic + (start - periodic) * (-rate).exp();
            let mean = periodic + (start - periodic) * (1.0 - (-rate).exp()) / rate;
            let next =
                SlowModes::new(&network, 1.0).ahead(&[start, 300.0], &[end, 300.0], &[mean, 300.0], None).unwrap();
            let left = ((next[0] - periodic) / (start - periodic)).abs();
            assert!(left < 0.09_f64.min(rate * rate / 5.0), "rate {rate}: {left}");
            assert_eq!(next[1], 300.0);
            let plain = ((end - periodic) / (start - periodic)).abs();
            assert!(plain > left || rate > 2.0, "rate {rate}: no orbit after orbit: {plain}");
        }
        assert_eq!(SlowModes::new(&network(0.0), 1.0).ahead(&[1.0, 300.0], &[2.0, 300.0], &[1.5, 300.0], None), None);
    }

    #[test]
    fn heat_that_nodes_send_to_each_other_is_part_of_slow_modes() {
        // Two equal nodes, each with 0.1 W/K to a boundary, send each other 1 W/K. Their difference relaxes at 2.1 /s, their mean at 0.1 /s. Without the coupling
        // both would be taken for modes of 1.1 /s.
        let [alone, shared] = [0.1, 1.0];
        let network = Network {
            space_temperature: 2.7,
            kinds: vec![NodeKind::Diffusive, NodeKind::Diffusive, NodeKind::Boundary],
            capacitances: vec![1.0, 1.0, 0.0],
            emissive_areas: vec![0.0; 3],
            temperatures: vec![300.0; 3],
            // What a node sends leaves it by a conductor to the boundary.
            linear: [0, 1].map(|node| LinearConductor { nodes: [node, 2], conductance: alone + shared }).to_vec(),
            radiative: Vec::new(),
        };
        let coupling = |change: &[f64]| vec![shared * change[1], shared * change[0], 0.0];
        let modes = |mean: f64, difference: f64| vec![300.0 + mean + difference, 300.0 + mean - difference, 300.0];
        let rates = [alone, alone + 2.0 * shared];
        let [ends, means] = [rates.map(|rate: f64| (-rate).exp()), rates.map(|rate: f64| (1.0 - (-rate).exp()) / rate)];
        let orbit = [modes(4.0, 3.0), modes(4.0 * ends[0], 3.0 * ends[1]), modes(4.0 * means[0], 3.0 * means[1])];
        let left = |coupling: Option<Coupling<'_>>| {
            let next = SlowModes::new(&network, 1.0).ahead(&orbit[0], &orbit[1], &orbit[2], coupling).unwrap();
            next.iter().map(|next| (next - 300.0).abs()).fold(0.0, f64::max)
        };
        assert!(left(Some(&coupling)) < 0.09 * 4.0 + 0.03, "{}", left(Some(&coupling)));
        assert!(left(None) > 2.0, "{}", left(None));
    }
}
