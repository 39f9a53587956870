//! The periodic state of a network whose heat repeats: orbits until the last changes nothing, accelerated.
//!
//! A state that gains C (T1 - T0) over an orbit would go on for many time constants; the temperatures at which the
//! balance loses as much more as was gained, in the mean of the orbit, are where it goes. For a linear network a mode
//! that relaxes at rate r over a period P then keeps 1 - (1 - e^-x)(1 + 1/x), x = r P, of its error: x/2 of slow ones,
//! 0.3 at most of any.

use super::Network;
use super::stepper::Stepper;

/// What [`settle`] found.
#[derive(Debug, Clone, PartialEq)]
pub struct Settled {
    /// Temperatures [K] of every node at the times that `orbit` reports, of an orbit in the periodic state.
    pub orbit: Vec<Vec<f64>>,
    /// Orbits that were computed.
    pub orbits: u32,
    /// How far the start of the last of them was moved, or would have been [K]: its error.
    pub change: f64,
}

/// Most orbits that are computed; a network far from linear takes about ten.
pub const MOST_ORBITS: u32 = 60;

/// Finds the start [K] from which an orbit leads back to itself.
///
/// `orbit` computes one from the temperatures given and reports them at times spread evenly over it, both ends
/// included; `balance` is the network in f64, for the temperatures at which a heat balances. Returns what was found when
/// a start is known to `tolerance` [K], `None` where it is not after [`MOST_ORBITS`] or where a balance was not found.
///
/// # Errors
/// Those of `orbit` and `balance`.
pub fn settle<S, E>(
    network: &Network,
    period: f64,
    tolerance: f64,
    balance: &mut S,
    mut orbit: impl FnMut(&[f64]) -> Result<Vec<Vec<f64>>, E>,
) -> Result<Option<Settled>, E>
where
    S: Stepper,
    E: From<S::Error>,
{
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
        balance.set_heat(&heat, &vec![0.0; network.len()])?;
        balance.set_temperatures(&mean)?;
        if !balance.steady(0.0)? {
            // Rounding may leave a node that only cools a little less heat than space sends back: it aims at space.
            heat.iter_mut().for_each(|heat| *heat = heat.max(0.0));
            balance.set_heat(&heat, &vec![0.0; network.len()])?;
            balance.set_temperatures(&mean)?;
            if !balance.steady(0.0)? {
                return Ok(None);
            }
        }
        let ahead = balance.temperatures()?;
        let next: Vec<f64> = (0..network.len()).map(|node| end[node] + ahead[node] - mean[node]).collect();
        let moves = (0..network.len()).filter(|node| network.capacitances[*node] > 0.0);
        let change = moves.map(|node| (next[node] - start[node]).abs()).fold(0.0, f64::max);
        if change <= tolerance {
            return Ok(Some(Settled { orbit: rows, orbits, change }));
        }
        if !change.is_finite() {
            return Ok(None);
        }
        // A step far beyond what is linear must not leave the range of temperatures.
        start = next.iter().zip(end).map(|(next, end)| next.max(0.5 * end)).collect();
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::super::reference::ReferenceStepper;
    use super::super::{LinearConductor, NodeKind};
    use super::*;

    /// A node of 1 J/K that conducts to a boundary at 300 K.
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

    /// Settles it over a period of 1 s with heat that is 4 W in the first half, exactly.
    fn settled(rate: f64, tolerance: f64) -> Option<Settled> {
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
            // The start that the orbit leads back to: gained in the first half, relaxed in the second.
            let half = (-0.5 * rate).exp();
            let exact = 300.0 + 4.0 / rate * (1.0 - half) * half / (1.0 - half * half);
            let start = settled.orbit[0][0];
            assert!((start - exact).abs() < 2e-6, "rate {rate}: {start} against {exact}");
            // At most 0.3 of the error is left by every orbit; the first is thousands of kelvins off.
            let most = (1e4f64 / 1e-6).log(1.0 / 0.3).ceil() as u32 + 1;
            assert!(settled.orbits <= most, "rate {rate}: {} orbits", settled.orbits);
            assert!((settled.orbit[20][0] - start).abs() < 2e-6);
        }
        // Orbit after orbit, the slowest would take 20,000.
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
}
