//! Warm-up to the periodic state: orbits are stepped until one of them no longer changes the temperatures.
//!
//! Slow nodes need many orbits. After each orbit a network is therefore moved towards the periodic state of its slow modes
//! (`thermal::network::periodic::SlowModes`). Anderson's method (J. ACM 12, 1965) then extrapolates: it combines the last orbits so that their changes
//! cancel best. The structures below plates are moved one by one (`structures`). Orbits have coarse steps until one meets the tolerance or the change no longer falls. Then they have the steps of the run.

use std::sync::atomic::Ordering;

use super::engine::{Engine, EngineError, Order};
use super::forward::{Passing, forward};
use super::prepare::Prepared;
use super::structures::Structures;
use super::warm_up::WarmUp;
use crate::thermal::network::periodic::{Coupling, SlowModes};
use crate::thermal::network::radiative_slope;

/// Orbits that an extrapolation uses.
const DEPTH: usize = 3;
/// Steps of the run in a coarse step.
const COARSE_STEPS: f64 = 6.0;
/// Steps at the end of a coarse orbit that are not coarse, so that fast nodes end it as in a fine orbit.
const LAST_STEPS: f64 = 30.0;
/// Coarse orbits end where the change of an orbit exceeds this share of the change before.
const STALLED: f64 = 0.5;
/// Most nodes of a network whose slow modes are solved. The matrix factors of a mesh grow faster than its nodes.
const MOST_SOLVED: usize = 200_000;

/// Result of a periodic warm-up.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Periodic {
    /// Number of orbits.
    pub orbits: u32,
    /// Number of coarse orbits, which come first.
    pub(crate) coarse: u32,
    /// Largest change of a node over the last orbit [K].
    pub(crate) change: f64,
    /// Tolerance [K].
    pub(crate) tolerance: f64,
}

impl Periodic {
    /// Whether a fine orbit met the tolerance.
    pub fn is_met(&self) -> bool {
        self.change <= self.tolerance && self.coarse < self.orbits
    }

    /// The warm-up in words.
    pub fn summary(&self) -> String {
        let coarse = match self.coarse {
            0 => String::new(),
            coarse => format!(" ({coarse} of them coarse)"),
        };
        format!("{} orbits{coarse}; the last one changed a node by up to {:.1e} K", self.orbits, self.change)
    }

    /// A warning for the user if the warm-up missed its tolerance. `of` names the run.
    pub(crate) fn warning(&self, of: &str) -> Option<String> {
        (!self.is_met()).then(|| {
            format!(
                "The warm-up{of} did not become periodic within {} K: {}. State a larger warm_up_orbits or warm_up_tolerance.",
                self.tolerance,
                self.summary()
            )
        })
    }
}

/// The orbits of a periodic warm-up so far. A saved state keeps them.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Orbits {
    done: Periodic,
    history: History,
    structures: Structures,
    coarse: bool,
    /// Change of the last orbit [K].
    last: f64,
}

impl Orbits {
    fn new(tolerance: f64, coarse: bool) -> Self {
        let done = Periodic { orbits: 0, coarse: 0, change: f64::INFINITY, tolerance };
        Self { done, history: History::default(), structures: Structures::default(), coarse, last: f64::INFINITY }
    }
}

/// Temperatures between two orbits [K].
struct OrbitEnd {
    network: Option<Vec<f64>>,
    structures: Vec<f64>,
    drawn: Vec<f32>,
}

impl OrbitEnd {
    fn new(engine: &mut dyn Engine) -> Result<Self, EngineError> {
        let (network, structures) = (engine.network_temperatures()?, engine.structures()?);
        engine.submit(None, Order { temperatures: true, ..Order::default() })?;
        Ok(Self { network, structures, drawn: engine.deliver()?.temperatures.unwrap_or_default() })
    }

    /// Largest change of a node since an orbit ago [K]. The drawn temperatures of a network that was moved change only at the next step, so its own
    /// temperatures are compared.
    fn change(&self, before: &Self, prepared: &Prepared) -> f64 {
        let drawn = |slot: &usize| prepared.network.as_ref().is_none_or(|network| !network.has(*slot));
        let others = prepared.nodes.real().map(|(slot, _)| slot).filter(drawn);
        let others = others.map(|slot| f64::from((before.drawn[slot] - self.drawn[slot]).abs()));
        let network = before.network.iter().flatten().zip(self.network.iter().flatten());
        let exact = network.chain(before.structures.iter().zip(&self.structures));
        others.chain(exact.map(|(from, to)| (from - to).abs())).fold(0.0, f64::max)
    }
}

impl<E: From<EngineError>> WarmUp<'_, E> {
    /// Steps orbits that end at time 0, until the largest change over an orbit is at most `tolerance` [K] or the scene's warm-up orbits are used up. The
    /// warm-up goes on from `earlier`, where there is one. Its state is kept between two orbits.
    pub(super) fn pass_orbits(&mut self, tolerance: f64, earlier: Option<&Orbits>) -> Result<Option<Periodic>, E> {
        let (time, period) = (&self.prepared.scene.time, self.prepared.scene.orbit.period());
        let most = time.warm_up_orbits.ceil() as u32;
        let each = (period / time.warm_up_step).ceil() as u32;
        let network = self.prepared.network.as_ref().map(|scene| scene.network());
        let solved = network.filter(|network| network.len() <= MOST_SOLVED);
        let mut slow = solved.map(|network| SlowModes::new(network, period));
        let mut orbits = earlier.cloned().unwrap_or_else(|| Orbits::new(tolerance, network.is_some()));
        (0..orbits.done.orbits).for_each(|_| (self.progress)());
        while orbits.done.orbits < most && !orbits.done.is_met() {
            let steps = orbits.done.orbits.saturating_mul(each);
            self.keep.take(steps, Some(&orbits), self.engine, self.check.as_deref_mut())?;
            let stopped = self.stop.load(Ordering::Relaxed);
            if stopped || self.keep.wants(steps) {
                self.keep.save()?;
            }
            if stopped {
                return Ok(None);
            }
            // Two fine orbits are needed, so that the change over the second can be measured.
            orbits.coarse &= orbits.done.orbits + 2 < most;
            self.engine.set_coarse(orbits.coarse);
            let before = OrbitEnd::new(self.engine)?;
            let mean = self.orbit(orbits.coarse)?;
            if self.stop.load(Ordering::Relaxed) {
                // The orbit may not be whole, so the run goes on from its start.
                self.keep.save()?;
                self.engine.set_coarse(false);
                return Ok(None);
            }
            let after = OrbitEnd::new(self.engine)?;
            orbits.done.orbits += 1;
            orbits.done.coarse += u32::from(orbits.coarse);
            orbits.done.change = after.change(&before, self.prepared);
            if !orbits.done.is_met() && orbits.done.orbits < most {
                self.move_structures(&mut orbits.structures, &before, &after)?;
                self.move_network(&mut orbits.history, slow.as_mut(), [&before, &after], &mean)?;
            }
            let change = orbits.done.change;
            if orbits.coarse && (change <= tolerance || change > STALLED * orbits.last) {
                // A fine orbit maps start to end temperatures in another way than a coarse orbit, so the history begins anew.
                (orbits.coarse, orbits.history, orbits.structures) = Default::default();
            }
            orbits.last = change;
            (self.progress)();
        }
        self.engine.set_coarse(false);
        Ok(Some(orbits.done))
    }

    /// Moves a network towards its periodic state, after an orbit with these mean temperatures [K].
    fn move_network(
        &mut self,
        history: &mut History,
        slow: Option<&mut SlowModes>,
        [before, after]: [&OrbitEnd; 2],
        mean: &[f64],
    ) -> Result<(), EngineError> {
        let (Some(from), Some(to)) = (&before.network, &after.network) else { return Ok(()) };
        let sent = |change: &[f64]| sent(self.prepared, self.engine, mean, change);
        let coupling: Option<Coupling<'_>> = self.prepared.exchange.is_some().then_some(&sent);
        let ahead = slow.and_then(|slow| slow.ahead(from, to, mean, coupling));
        let ahead = ahead.unwrap_or_else(|| to.clone());
        let guess = history.extrapolate(from, &ahead).unwrap_or(ahead);
        self.engine.set_network_temperatures(&guess)?;
        if let Some(check) = self.check.as_deref_mut() {
            let moved: Vec<f64> = guess.iter().zip(to).map(|(guess, to)| guess - to).collect();
            check.move_network(&moved);
        }
        Ok(())
    }

    /// Moves the structures below plates towards their periodic state, after an orbit.
    fn move_structures(
        &mut self,
        structures: &mut Structures,
        before: &OrbitEnd,
        after: &OrbitEnd,
    ) -> Result<(), EngineError> {
        let to = &after.structures;
        let ahead = structures.ahead(&before.structures, to).filter(|ahead| !ahead.is_empty());
        let Some(ahead) = ahead else { return Ok(()) };
        self.engine.set_structures(&ahead)?;
        if let Some(check) = self.check.as_deref_mut() {
            let moved: Vec<f64> = ahead.iter().zip(to).map(|(ahead, to)| ahead - to).collect();
            check.move_structures(&moved);
        }
        Ok(())
    }

    /// Steps one period up to time 0, in coarse steps until near its end. The last step is shorter where the period is not a whole number of steps. Returns the
    /// mean temperatures of the network's nodes [K].
    fn orbit(&mut self, coarse: bool) -> Result<Vec<f64>, EngineError> {
        let (step, period) = (self.prepared.scene.time.warm_up_step, self.prepared.scene.orbit.period());
        let unit = self.prepared.scene.time.step;
        let mut last = self.engine.network_temperatures()?.unwrap_or_default();
        let mut mean = vec![0.0; last.len()];
        // The steps are counted from the start of the orbit, so that every orbit has the same steps.
        let (mut done, whole) = (0.0, period / step);
        let passing = std::iter::from_fn(|| {
            let ahead: f64 = if coarse && whole - done >= LAST_STEPS + COARSE_STEPS { COARSE_STEPS } else { 1.0 };
            let start = done * step - period;
            let length = (ahead * step).min(-start);
            let goes_on = done < whole - 1e-9;
            done += ahead;
            goes_on.then_some(Passing { start, end: start + length, steps: length / unit })
        });
        if last.is_empty() {
            forward(self.prepared, self.engine, self.check.as_deref_mut(), passing, self.stop, &mut || ())?;
            return Ok(mean);
        }
        for one in passing {
            let length = one.end - one.start;
            if !forward(self.prepared, self.engine, self.check.as_deref_mut(), [one], self.stop, &mut || ())? {
                break;
            }
            let next = self.engine.network_temperatures()?.unwrap_or_default();
            for ((mean, last), next) in mean.iter_mut().zip(&last).zip(&next) {
                *mean += 0.5 * length / period * (last + next);
            }
            last = next;
        }
        Ok(mean)
    }
}

/// Heat that nodes of a network receive from each other [W] where their temperatures [K] change by `change`.
fn sent(prepared: &Prepared, engine: &dyn Engine, temperatures: &[f64], change: &[f64]) -> Vec<f64> {
    let Some(network) = &prepared.network else { return Vec::new() };
    let mut sends = vec![0.0; prepared.nodes.vertex_of_node.len()];
    let slopes: Vec<f64> =
        temperatures.iter().zip(change).map(|(kelvin, change)| radiative_slope(*kelvin) * change).collect();
    network.scatter(&slopes, |slot, slope| sends[slot] = slope);
    let received = engine.exchanged_infrared(&sends);
    network.heat(|slot| received.get(slot).copied().unwrap_or_default())
}

/// The last orbits: the temperatures at the end of each, and their changes.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
struct History {
    ends: Vec<Vec<f64>>,
    changes: Vec<Vec<f64>>,
}

impl History {
    /// Temperatures nearer to the periodic state than the end `to` of the orbit from `from`. `None` where there is no earlier orbit, or the result is not a
    /// valid temperature.
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

/// Weights of `columns` whose sum is nearest to `target`, by the normal equations with slight regularisation.
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
        // Two families of nodes keep 0.9 and 0.5 of their distance to the periodic state over an orbit.
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
