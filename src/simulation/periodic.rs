//! Warm-up to the periodic state: orbits are stepped until one of them no longer changes the temperatures.
//!
//! Slow nodes need many orbits. After each orbit a network is therefore moved towards the periodic state of its slow modes
//! (`thermal::network::periodic::SlowModes`). Anderson's method (J. ACM 12, 1965) then extrapolates: it combines the last orbits so that their changes
//! cancel best. The structures below plates are moved one by one (`structures`). Orbits have coarse steps until one meets the tolerance or the change no longer falls. Then they have the steps of the run.

use std::sync::atomic::{AtomicBool, Ordering};

use super::check::Check;
use super::engine::{Engine, EngineError, Order};
use super::forward::{Passing, forward};
use super::keep::Keep;
use super::prepare::Prepared;
use super::structures::Structures;
use crate::saved::{Saved, SavedError};
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
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// How far a periodic warm-up is, between two orbits.
#[derive(Debug)]
pub(super) struct WarmUpState {
    done: Periodic,
    history: History,
    structures: Structures,
    coarse: bool,
    /// Change of the last orbit [K].
    last: f64,
}

impl WarmUpState {
    fn new(tolerance: f64, coarse: bool) -> Self {
        let done = Periodic { orbits: 0, coarse: 0, change: f64::INFINITY, tolerance };
        Self { done, history: History::default(), structures: Structures::default(), coarse, last: f64::INFINITY }
    }

    /// Restores the state of `save`.
    ///
    /// # Errors
    /// A list that is absent or of another length.
    pub(crate) fn of(saved: &Saved) -> Result<Self, SavedError> {
        let [orbits, coarse, known] = saved.array::<u32, 3>("orbits")?;
        let [change, tolerance, last] = saved.array("changes")?;
        let lists =
            |name: &str| (0..known).map(|number| saved.list(&format!("{name}.{number}"))).collect::<Result<_, _>>();
        let history = History { ends: lists("end")?, changes: lists("change")? };
        let done = Periodic { orbits, coarse, change, tolerance };
        let structures = Structures::of(saved)?;
        Ok(Self { done, history, structures, coarse: saved.flags("coarse")?.first() == Some(&true), last })
    }

    fn save(&self) -> Saved {
        let mut saved = Saved::default();
        saved.put("orbits", &[self.done.orbits, self.done.coarse, self.history.ends.len() as u32]);
        saved.put("changes", &[self.done.change, self.done.tolerance, self.last]);
        saved.put_flags("coarse", &[self.coarse]);
        self.structures.save(&mut saved);
        for (number, (end, change)) in self.history.ends.iter().zip(&self.history.changes).enumerate() {
            saved.put(format!("end.{number}"), end);
            saved.put(format!("change.{number}"), change);
        }
        saved
    }
}

/// Steps orbits that end at time 0, until the largest change over an orbit is at most `tolerance` [K] or the scene's warm-up orbits are used up. The
/// warm-up goes on from `earlier`, where there is one. `keep` takes the state between two orbits.
#[expect(clippy::too_many_arguments, reason = "the state of a run is in as many places")]
pub(super) fn warm_up<E: From<EngineError>>(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    mut check: Option<&mut Check>,
    tolerance: f64,
    earlier: Option<WarmUpState>,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
    keep: &mut dyn Keep<E>,
) -> Result<Option<Periodic>, E> {
    let most = prepared.scene.time.warm_up_orbits.ceil() as u32;
    let each = (prepared.scene.orbit.period() / prepared.scene.time.warm_up_step).ceil() as u32;
    let network = prepared.network.as_ref().map(|scene| scene.network());
    let mut slow = network
        .filter(|network| network.len() <= MOST_SOLVED)
        .map(|network| SlowModes::new(network, prepared.scene.orbit.period()));
    let WarmUpState { mut done, mut history, mut structures, mut coarse, mut last } =
        earlier.unwrap_or_else(|| WarmUpState::new(tolerance, network.is_some()));
    (0..done.orbits).for_each(|_| progress());
    while done.orbits < most && !done.is_met() {
        let steps = done.orbits.saturating_mul(each);
        let way = WarmUpState { done, history, structures, coarse, last };
        keep.take(steps, way.save(), engine, check.as_deref_mut())?;
        WarmUpState { history, structures, .. } = way;
        let stopped = stop.load(Ordering::Relaxed);
        if stopped || keep.wants(steps) {
            keep.save()?;
        }
        if stopped {
            return Ok(None);
        }
        // Two fine orbits are needed, so that the change over the second can be measured.
        coarse &= done.orbits + 2 < most;
        engine.set_coarse(coarse);
        let (from, below_from) = (engine.network_temperatures()?, engine.structures()?);
        let before = all(engine)?;
        let mean = orbit(prepared, engine, check.as_deref_mut(), coarse, stop)?;
        if stop.load(Ordering::Relaxed) {
            // The orbit may not be whole, so the run goes on from its start.
            keep.save()?;
            engine.set_coarse(false);
            return Ok(None);
        }
        let (to, after) = (engine.network_temperatures()?, all(engine)?);
        done.orbits += 1;
        done.coarse += u32::from(coarse);
        // The drawn temperatures of a network that was moved change only at the next step, so its own temperatures are compared.
        let drawn = |slot: &usize| prepared.network.as_ref().is_none_or(|network| !network.has(*slot));
        let others = prepared.nodes.real().map(|(slot, _)| slot).filter(drawn);
        let others = others.map(|slot| f64::from((before[slot] - after[slot]).abs()));
        let own = from.iter().flatten().zip(to.iter().flatten()).map(|(from, to)| (from - to).abs());
        let below_to = engine.structures()?;
        let below = below_from.iter().zip(&below_to).map(|(from, to)| (from - to).abs());
        done.change = others.chain(own).chain(below).fold(0.0, f64::max);
        if !done.is_met() && done.orbits < most {
            move_structures(
                &mut structures,
                [below_from.as_slice(), below_to.as_slice()],
                engine,
                check.as_deref_mut(),
            )?;
        }
        if let (Some(from), Some(to)) = (from, to)
            && !done.is_met()
            && done.orbits < most
        {
            let sent = |change: &[f64]| sent(prepared, engine, &mean, change);
            let coupling: Option<Coupling<'_>> = prepared.exchange.is_some().then_some(&sent);
            let ahead = slow.as_mut().and_then(|slow| slow.ahead(&from, &to, &mean, coupling));
            let ahead = ahead.unwrap_or_else(|| to.clone());
            let guess = history.extrapolate(&from, &ahead).unwrap_or(ahead);
            engine.set_network_temperatures(&guess)?;
            if let Some(check) = check.as_deref_mut() {
                let moved: Vec<f64> = guess.iter().zip(&to).map(|(guess, to)| guess - to).collect();
                check.move_network(&moved);
            }
        }
        if coarse && (done.change <= tolerance || done.change > STALLED * last) {
            // A fine orbit maps start to end temperatures in another way than a coarse orbit, so the history begins anew.
            (coarse, history, structures) = (false, History::default(), Structures::default());
        }
        last = done.change;
        progress();
    }
    engine.set_coarse(false);
    Ok(Some(done))
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

/// Moves the structures below plates towards their periodic state, after an orbit between two temperatures of each [K].
fn move_structures(
    structures: &mut Structures,
    [from, to]: [&[f64]; 2],
    engine: &mut dyn Engine,
    check: Option<&mut Check>,
) -> Result<(), EngineError> {
    let Some(ahead) = structures.ahead(from, to).filter(|ahead| !ahead.is_empty()) else { return Ok(()) };
    engine.set_structures(&ahead)?;
    if let Some(check) = check {
        let moved: Vec<f64> = ahead.iter().zip(to).map(|(ahead, to)| ahead - to).collect();
        check.move_structures(&moved);
    }
    Ok(())
}

fn all(engine: &mut dyn Engine) -> Result<Vec<f32>, EngineError> {
    engine.submit(None, Order { temperatures: true, ..Order::default() })?;
    Ok(engine.deliver()?.temperatures.unwrap_or_default())
}

/// Steps one period up to time 0, in coarse steps until near its end. The last step is shorter where the period is not a whole number of steps. Returns the
/// mean temperatures of the network's nodes [K].
fn orbit(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    mut check: Option<&mut Check>,
    coarse: bool,
    stop: &AtomicBool,
) -> Result<Vec<f64>, EngineError> {
    let (step, period) = (prepared.scene.time.warm_up_step, prepared.scene.orbit.period());
    let unit = prepared.scene.time.step;
    let mut last = engine.network_temperatures()?.unwrap_or_default();
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
        forward(prepared, engine, check, passing, stop, &mut || ())?;
        return Ok(mean);
    }
    for one in passing {
        let length = one.end - one.start;
        if !forward(prepared, engine, check.as_deref_mut(), [one], stop, &mut || ())? {
            break;
        }
        let next = engine.network_temperatures()?.unwrap_or_default();
        for ((mean, last), next) in mean.iter_mut().zip(&last).zip(&next) {
            *mean += 0.5 * length / period * (last + next);
        }
        last = next;
    }
    Ok(mean)
}

/// The last orbits: the temperatures at the end of each, and their changes.
#[derive(Debug, Default)]
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
