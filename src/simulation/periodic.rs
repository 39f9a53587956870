//! Warm-up to the periodic state: orbits are stepped until one of them no longer changes the temperatures.
//!
//! Slow nodes need many orbits. After each orbit a network is therefore moved towards the periodic state of its slow modes
//! (`thermal::network::periodic::SlowModes`). Anderson's method (J. ACM 12, 1965) then extrapolates: it combines the last orbits so that their changes
//! cancel best. The structures below plates are moved one by one (`structures`). Orbits have coarse steps until one changes little or the change no longer falls. Then they have the steps of the run.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::engine::{Engine, EngineError};
use super::forward::forward;
use super::orbit_end::{BaseOrbit, OrbitEnd, PassRun, show_network};
use super::orbits::{History, Orbits, Periodic};
use super::parts::Passing;
use super::prepare::Prepared;
use super::structures::Structures;
use super::warm_up::WarmUp;
use crate::thermal::network::one_pass::HalvingCourse;
use crate::thermal::network::periodic::{Coupling, SlowModes};
use crate::thermal::network::radiative_slope;
use crate::trace::{span, span_with};

/// Steps of the run in a coarse step.
const COARSE_STEPS: f64 = 6.0;
/// Steps at the end of a coarse orbit that are not coarse, so that fast nodes end it as in a fine orbit.
const LAST_STEPS: f64 = 30.0;
/// Coarse orbits end where an orbit changes no node by more [K]. Coarse steps miss the state of fine ones by some kelvins, so more coarse orbits gain nothing.
const NEAR: f64 = 10.0;
/// Coarse orbits end where the change of an orbit exceeds this share of the change before.
const STALLED: f64 = 0.5;
/// Moments of an orbit from which the mean is taken. A network is linearised there, so a few suffice, and the device is not asked after every step.
const MOMENTS: f64 = 12.0;
/// Most nodes of a network whose slow modes are solved. The matrix factors of a mesh grow faster than its nodes.
const MOST_SOLVED: usize = 200_000;

impl<E: From<EngineError>> WarmUp<'_, E> {
    /// Steps orbits that end at time 0, until the largest change over an orbit is at most `tolerance` [K] or the scene's warm-up orbits are used up. The
    /// warm-up goes on from `earlier`, where there is one. Its state is kept between two orbits. With `beside` an orbit is to change the temperatures as much
    /// as an orbit of that scene does, and ends where it is as far from that scene as its values make it. Where the orbit of that scene is its run, so is each
    /// orbit here, and the last one has its results.
    pub(super) fn pass_orbits(
        &mut self,
        tolerance: f64,
        earlier: Option<&Orbits>,
        mut beside: Option<(&BaseOrbit, PassRun<'_, E>)>,
    ) -> Result<Option<Periodic>, E> {
        let (time, period) = (&self.prepared.scene.time, self.prepared.scene.orbit.period());
        let most = time.warm_up_orbits.ceil() as u32;
        let each = (period / time.warm_up_step).ceil() as u32;
        let network = self.prepared.network.as_ref().map(|scene| scene.network());
        let solved = network.filter(|network| network.len() <= MOST_SOLVED);
        let mut slow = solved.map(|network| SlowModes::new(network, period));
        let mut orbits = earlier.cloned().unwrap_or_else(|| Orbits::new(tolerance, network.is_some()));
        (0..orbits.done.orbits).for_each(|_| (self.progress)());
        // Least change of a fine orbit before the last one.
        let mut least = f64::INFINITY;
        while orbits.done.orbits < most && !orbits.done.is_met() {
            let steps = orbits.done.orbits.saturating_mul(each);
            let name = format!("warm-up: orbit {} of at most {most}", orbits.done.orbits + 1);
            let _orbit = span_with(name, || last_change(&orbits.done));
            let stopped = self.stop.load(Ordering::Relaxed);
            {
                let _saves = span("saving the state");
                self.keep.take(steps, Some(&orbits), self.engine, self.check.as_deref_mut())?;
                if stopped || self.keep.wants(steps) {
                    self.keep.save()?;
                }
            }
            if stopped {
                return Ok(None);
            }
            // Two fine orbits are needed, so that the change over the second can be measured.
            orbits.coarse &= orbits.done.orbits + 2 < most;
            self.engine.set_coarse(orbits.coarse);
            let (before, mean) = self.pass_orbit(orbits.coarse, beside.as_mut())?;
            if self.stop.load(Ordering::Relaxed) {
                // The orbit may not be whole, so the run goes on from its start.
                self.keep.save()?;
                self.engine.set_coarse(false);
                return Ok(None);
            }
            let mut after = OrbitEnd::new(self.engine)?;
            after.check(self.prepared)?;
            if let Some((base, _)) = &beside {
                orbits.done.tolerance = base.tolerance(&after, self.prepared).max(tolerance);
                after = base.without_its_change(&after);
            }
            orbits.done.orbits += 1;
            orbits.done.coarse += u32::from(orbits.coarse);
            orbits.done.change = after.change(&before, self.prepared);
            let change = orbits.done.change;
            let stalls = beside.is_some() && change > STALLED * least;
            if !orbits.done.is_met() && orbits.done.orbits < most && !stalls {
                self.move_structures(&mut orbits.structures, &before, &after)?;
                self.move_network(Some(&mut orbits.history), slow.as_mut(), [&before, &after], &mean)?;
            } else if let Some((base, _)) = &beside {
                self.move_network(None, slow.as_mut(), [&before, &after], &mean)?;
                if base.run_mean.is_none() {
                    base.add_its_change(self.engine)?;
                }
                (self.progress)();
                break;
            }
            least = if orbits.coarse { f64::INFINITY } else { least.min(orbits.last) };
            if orbits.coarse && (change <= NEAR.max(tolerance) || change > STALLED * orbits.last) {
                // A fine orbit maps start to end temperatures in another way than a coarse orbit, so the history begins anew.
                (orbits.coarse, orbits.history, orbits.structures) = Default::default();
            }
            orbits.last = change;
            (self.progress)();
        }
        self.engine.set_coarse(false);
        Ok(Some(orbits.done))
    }

    /// Passes an orbit, or the run in its place. Returns what was before it, and the mean temperatures of the network's nodes [K].
    fn pass_orbit(
        &mut self,
        coarse: bool,
        beside: Option<&mut (&BaseOrbit, PassRun<'_, E>)>,
    ) -> Result<(OrbitEnd, Vec<f64>), E> {
        if let Some((BaseOrbit { halvings, .. }, _)) = &beside {
            self.engine.take_halving_course(HalvingCourse::Followed(Arc::clone(halvings), 0));
        }
        if let Some((BaseOrbit { run_mean: Some(mean), .. }, pass)) = beside {
            show_network(self.prepared, self.engine)?;
            let before = OrbitEnd::new(self.engine)?;
            pass(self.engine)?;
            return Ok((before, mean.clone()));
        }
        let before = OrbitEnd::new(self.engine)?;
        Ok((before, self.orbit(coarse)?))
    }

    /// Moves a network towards its periodic state, after an orbit with these mean temperatures [K]. Earlier orbits help where there is a history.
    fn move_network(
        &mut self,
        history: Option<&mut History>,
        slow: Option<&mut SlowModes>,
        [before, after]: [&OrbitEnd; 2],
        mean: &[f64],
    ) -> Result<(), EngineError> {
        let (Some(from), Some(to)) = (&before.network, &after.network) else { return Ok(()) };
        let _moves = span("moving the network to its periodic state");
        let sent = |change: &[f64]| sent(self.prepared, self.engine, mean, change);
        let coupling: Option<Coupling<'_>> = self.prepared.exchange.is_some().then_some(&sent);
        let ahead = slow.and_then(|slow| slow.ahead(from, to, mean, coupling));
        let ahead = ahead.unwrap_or_else(|| to.clone());
        let guess = history.and_then(|history| history.extrapolate(from, &ahead)).unwrap_or(ahead);
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
    /// mean temperatures of the network's nodes [K], from some moments of the orbit.
    pub(super) fn orbit(&mut self, coarse: bool) -> Result<Vec<f64>, EngineError> {
        let (step, period) = (self.prepared.scene.time.warm_up_step, self.prepared.scene.orbit.period());
        let unit = self.prepared.scene.time.step;
        let mut last = self.engine.network_temperatures()?.unwrap_or_default();
        let mut mean = vec![0.0; last.len()];
        // The steps are counted from the start of the orbit, so that every orbit has the same steps.
        let (mut done, whole) = (0.0, period / step);
        let passing: Vec<Passing> = std::iter::from_fn(|| {
            let ahead: f64 = if coarse && whole - done >= LAST_STEPS + COARSE_STEPS { COARSE_STEPS } else { 1.0 };
            let start = done * step - period;
            let length = (ahead * step).min(-start);
            let goes_on = done < whole - 1e-9;
            done += ahead;
            goes_on.then_some(Passing { start, end: start + length, steps: length / unit })
        })
        .collect();
        let moments = if last.is_empty() { 1.0 } else { MOMENTS };
        let moment = |passing: &Passing| ((passing.start / period + 1.0) * moments) as u32;
        for together in passing.chunk_by(|a, b| moment(a) == moment(b)) {
            let check = self.check.as_deref_mut();
            if !forward(self.prepared, self.engine, check, together.iter().copied(), self.stop, &mut || ())? {
                break;
            }
            let next = self.engine.network_temperatures()?.unwrap_or_default();
            let length: f64 = together.iter().map(|passing| passing.end - passing.start).sum();
            for ((mean, last), next) in mean.iter_mut().zip(&last).zip(&next) {
                *mean += 0.5 * length / period * (last + next);
            }
            last = next;
        }
        Ok(mean)
    }
}

fn last_change(Periodic { orbits, change, .. }: &Periodic) -> String {
    if *orbits == 0 { String::new() } else { format!("(the last one changed a node by up to {change:.1e} K)") }
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
