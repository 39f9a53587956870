//! Warm-up to the periodic state: orbits are stepped until one of them changes nothing any more.
//!
//! Slow nodes take many orbits. The networks' temperatures are therefore extrapolated over the map of an orbit by Anderson's
//! method (J. ACM 12, 1965): the combination of the last orbits whose changes cancel best.

use std::sync::atomic::{AtomicBool, Ordering};

use super::check::Check;
use super::engine::{Engine, Order, Tick};
use super::prepare::Prepared;
use crate::gpu::error::GpuError;

/// Orbits that an extrapolation looks back.
const DEPTH: usize = 3;

/// How a periodic warm-up went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Periodic {
    /// Orbits stepped.
    pub orbits: u32,
    /// Largest change of a node over the last of them [K].
    pub change: f64,
    /// What was asked for [K].
    pub tolerance: f64,
}

impl Periodic {
    /// Whether the tolerance was met.
    pub fn is_met(&self) -> bool {
        self.change <= self.tolerance
    }
}

/// Steps orbits that end at time 0 until the largest change over one of them is at most `tolerance` [K], or the scene's
/// warm-up orbits are used up.
pub(super) fn warm_up(
    prepared: &Prepared,
    engine: &mut Engine,
    mut check: Option<&mut Check>,
    tolerance: f64,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
) -> Result<Option<Periodic>, GpuError> {
    let most = prepared.scene.time.warm_up_orbits.ceil() as u32;
    let mut done = Periodic { orbits: 0, change: f64::INFINITY, tolerance };
    let mut history = History::default();
    while done.orbits < most && !done.is_met() && !stop.load(Ordering::Relaxed) {
        let network = engine.network_temperatures()?;
        let before = all(engine)?;
        orbit(prepared, engine, check.as_deref_mut())?;
        let after = all(engine)?;
        done.orbits += 1;
        done.change = before.iter().zip(&after).map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max);
        if let (Some(from), Some(to)) = (network, engine.network_temperatures()?)
            && done.change > tolerance
            && let Some(guess) = history.extrapolate(&from, &to)
        {
            engine.set_network_temperatures(&guess)?;
            if let Some(check) = check.as_deref_mut() {
                let moved: Vec<f64> = guess.iter().zip(&to).map(|(guess, to)| guess - to).collect();
                check.move_network(&moved);
            }
        }
        progress();
    }
    Ok(Some(done))
}

/// Temperatures of all nodes [K].
fn all(engine: &mut Engine) -> Result<Vec<f32>, GpuError> {
    engine.submit(None, Order { pose: None, temperatures: true })?;
    Ok(engine.deliver()?.temperatures.unwrap_or_default())
}

/// One whole period up to time 0, its last tick shorter where the period is no whole number of steps.
fn orbit(prepared: &Prepared, engine: &mut Engine, mut check: Option<&mut Check>) -> Result<(), GpuError> {
    let (step, period) = (prepared.scene.time.step, prepared.scene.orbit.period());
    let ticks = (period / step - 1e-9).ceil() as u64;
    for tick in 0..ticks {
        let start = tick as f64 * step - period;
        let length = step.min(-start);
        let load = prepared.loads.tick_load(start, start + length);
        engine.submit(Some(Tick { load: &load, steps: length / step, start, length }), Order::default())?;
        engine.deliver()?;
        if let Some(check) = check.as_deref_mut() {
            check.step(&load, length / step, start, length);
        }
    }
    Ok(())
}

/// The last orbits: where each ended, and how it changed the temperatures.
#[derive(Debug, Default)]
struct History {
    ends: Vec<Vec<f64>>,
    changes: Vec<Vec<f64>>,
}

impl History {
    /// Temperatures nearer to the periodic state than the end `to` of the orbit from `from`; `None` where there is nothing
    /// to go by, or what comes out is no temperature.
    fn extrapolate(&mut self, from: &[f64], to: &[f64]) -> Option<Vec<f64>> {
        let change: Vec<f64> = to.iter().zip(from).map(|(to, from)| to - from).collect();
        let known = self.ends.len();
        let differences: Vec<Vec<f64>> = self.changes.iter().map(|old| minus(&change, old)).collect();
        let weights = least_squares(&differences, &change);
        let mut guess = to.to_vec();
        if let Some(weights) = weights.filter(|_| known > 0) {
            for (weight, end) in weights.iter().zip(&self.ends) {
                for ((guess, to), end) in guess.iter_mut().zip(to).zip(end) {
                    *guess -= weight * (to - end);
                }
            }
        }
        self.ends.push(to.to_vec());
        self.changes.push(change);
        if self.ends.len() > DEPTH {
            self.ends.remove(0);
            self.changes.remove(0);
        }
        let sane = guess.iter().zip(to).all(|(guess, to)| *guess > 0.5 * to && *guess < 2.0 * to);
        (known > 0 && sane).then_some(guess)
    }
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Weights of `columns` whose sum comes nearest to `target`, by the normal equations with a trace of regularisation.
fn least_squares(columns: &[Vec<f64>], target: &[f64]) -> Option<Vec<f64>> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let n = columns.len();
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let mut row: Vec<f64> = (0..n).map(|j| dot(&columns[i], &columns[j])).collect();
            row[i] *= 1.0 + 1e-10;
            row.push(dot(&columns[i], target));
            row
        })
        .collect();
    for pivot in 0..n {
        let best = (pivot..n).max_by(|a, b| rows[*a][pivot].abs().total_cmp(&rows[*b][pivot].abs()))?;
        rows.swap(pivot, best);
        if rows[pivot][pivot].abs() < 1e-30 {
            return None;
        }
        for other in (0..n).filter(|other| *other != pivot) {
            let factor = rows[other][pivot] / rows[pivot][pivot];
            let row = rows[pivot].clone();
            rows[other].iter_mut().zip(&row).for_each(|(value, pivot)| *value -= factor * pivot);
        }
    }
    Some((0..n).map(|i| rows[i][n] / rows[i][i]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_maps_of_few_rates_are_solved_in_a_few_orbits() {
        // Two families of nodes that keep 0.9 and 0.5 of their distance to the periodic state over an orbit.
        let periodic: Vec<f64> = (0..20).map(|i| 250.0 + f64::from(i)).collect();
        let orbit = |t: &[f64]| -> Vec<f64> {
            let kept = |i: usize| if i < 12 { 0.9 } else { 0.5 };
            (0..20).map(|i| periodic[i] + kept(i) * (t[i] - periodic[i])).collect()
        };
        let mut history = History::default();
        let mut now = vec![300.0; 20];
        let mut orbits = 0;
        while (0..20).any(|i| (now[i] - periodic[i]).abs() > 1e-3) {
            let end = orbit(&now);
            now = history.extrapolate(&now, &end).unwrap_or(end);
            orbits += 1;
            assert!(orbits < 10);
        }
        let mut plain = vec![300.0; 20];
        for _ in 0..orbits {
            plain = orbit(&plain);
        }
        assert!((plain[0] - periodic[0]).abs() > 10.0, "without extrapolation it would be far away");
    }
}
