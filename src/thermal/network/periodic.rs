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
            return Ok(None);
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
