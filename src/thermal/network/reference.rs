//! Steps a network in f64 by every method. The caller chooses sub-steps and methods.

use super::newton::Newton;
use super::stepper::{Attempt, StepMethod, WorkCounts};
use super::system::{Heat, System, SystemState, heat, in_range};
use super::{Network, NodeKind, rkl2, tr_bdf2};

/// Pseudo-times [s] of implicit steps towards a steady state, where Newton's method does not converge at once.
const PSEUDO_TIMES: [f64; 12] = [1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e8, 1e12];

/// A network in f64.
#[derive(Debug, Clone)]
pub struct ReferenceStepper {
    system: System,
    sensors: Vec<usize>,
    kept: SystemState,
    tried: SystemState,
}

impl ReferenceStepper {
    /// A network at its temperatures, without heat. `sensors` are the nodes of [`Attempt::sensed`].
    pub fn new(network: Network, sensors: &[u32]) -> Self {
        let nothing = vec![0.0; network.len()];
        let kept =
            SystemState { temperatures: network.temperatures.clone(), rates: nothing.clone(), rates_known: false };
        let arithmetic = Newton::new(&network, |node| network.kinds[node] == NodeKind::Arithmetic);
        let heat = Heat { power: nothing.clone(), slope: nothing };
        let system = System { network, heat, arithmetic, all: None, counts: WorkCounts::default() };
        Self { system, sensors: sensors.iter().map(|sensor| *sensor as usize).collect(), tried: kept.clone(), kept }
    }

    /// Takes up work counts of an earlier part of the run.
    pub(crate) fn set_counts(&mut self, counts: WorkCounts) {
        self.system.counts = counts;
    }

    /// Takes one sub-step from `tried`. Returns the estimate of its error [K], infinite where it fails.
    fn sub_step(&mut self, method: StepMethod, t: f64, step: f64) -> f64 {
        let state = &mut self.tried;
        if !state.rates_known {
            self.system.rate(t, &state.temperatures, &mut state.rates);
            state.rates_known = true;
        }
        self.system.counts.sub_steps += 1;
        let error = match method {
            StepMethod::Euler => euler(&mut self.system, t, step, state),
            StepMethod::Rkl2 { stages } => rkl2::step(&mut self.system, t, step, stages, state),
            StepMethod::TrBdf2 => tr_bdf2::step(&mut self.system, t, step, state),
        };
        error.filter(|error| error.is_finite() && in_range(&state.temperatures)).unwrap_or(f64::INFINITY)
    }
}

/// Forward Euler, without a carried residual, because f64 rounding is negligible. The error is h/2 dF.
fn euler(system: &mut System, t: f64, step: f64, state: &mut SystemState) -> Option<f64> {
    for (temperature, rate) in state.temperatures.iter_mut().zip(&state.rates) {
        *temperature += step * rate;
    }
    if !in_range(&state.temperatures) || !system.balance(t + step, &mut state.temperatures) {
        return None;
    }
    let before = state.rates.clone();
    system.rate(t + step, &state.temperatures, &mut state.rates);
    Some(before.iter().zip(&state.rates).map(|(a, b)| (0.5 * step * (b - a)).abs()).fold(0.0, f64::max))
}

impl ReferenceStepper {
    /// Sets the heat of the nodes to `power + slope * t` [W], with t [s] since this call. Sub-steps end where the heat is not linear.
    pub fn set_heat(&mut self, power: &[f64], slope: &[f64]) {
        self.system.heat = Heat { power: power.to_vec(), slope: slope.to_vec() };
        self.kept.rates_known = false;
    }

    /// Balances the arithmetic nodes in place with the heat at `t` [s] since `set_heat`. Returns whether they converged.
    pub fn balance(&mut self, t: f64) -> bool {
        self.kept.rates_known = false;
        let mut temperatures = self.kept.temperatures.clone();
        let is_balanced = self.system.balance(t, &mut temperatures);
        if is_balanced {
            self.kept.temperatures = temperatures;
        }
        is_balanced
    }

    /// Tries `count` sub-steps of `step` [s] each from the kept state, with its arithmetic nodes balanced. The kept state is at `t` [s] since `set_heat`.
    pub fn attempt(&mut self, method: StepMethod, t: f64, step: f64, count: u32) -> Attempt {
        self.tried.clone_from(&self.kept);
        let mut attempt = Attempt::default();
        for sub_step in 0..count {
            let error = self.sub_step(method, t + f64::from(sub_step) * step, step);
            attempt.error = attempt.error.max(error);
            attempt.sensed.extend(self.sensors.iter().map(|sensor| self.tried.temperatures[*sensor]));
            if attempt.error.is_infinite() {
                break;
            }
        }
        attempt
    }

    /// Keeps the state of the last try.
    pub fn keep(&mut self) {
        std::mem::swap(&mut self.kept, &mut self.tried);
    }

    /// The kept temperatures [K].
    pub fn temperatures(&self) -> Vec<f64> {
        self.kept.temperatures.clone()
    }

    /// Replaces the kept temperatures [K].
    pub fn set_temperatures(&mut self, temperatures: &[f64]) {
        self.kept.temperatures = temperatures.to_vec();
        self.kept.rates_known = false;
    }

    /// Solves in place for the steady state under the heat at `t` [s]: every node but boundaries balances. Returns whether it converged.
    pub(crate) fn steady(&mut self, t: f64) -> bool {
        self.kept.rates_known = false;
        let mut all = self.system.take_all();
        let (network, sources) = (&self.system.network, &self.system.heat);
        let balance = |now: &[f64], out: &mut [f64]| heat(network, sources, t, now, out);
        let mut temperatures = self.kept.temperatures.clone();
        let mut is_balanced = all.find(network, &mut temperatures, |_| 0.0, balance);
        if !is_balanced {
            // A distant start follows the path of a network with equal capacitances in ever longer implicit steps.
            temperatures.clone_from(&self.kept.temperatures);
            for span in PSEUDO_TIMES {
                let before = temperatures.clone();
                let step = |now: &[f64], out: &mut [f64]| {
                    balance(now, out);
                    for ((out, before), now) in out.iter_mut().zip(&before).zip(now) {
                        *out += (before - now) / span;
                    }
                };
                if !all.find(network, &mut temperatures, |_| 1.0 / span, step) {
                    temperatures = before;
                }
            }
            is_balanced = all.find(network, &mut temperatures, |_| 0.0, balance);
        }
        self.system.put_all(all);
        if is_balanced && in_range(&temperatures) {
            self.kept.temperatures = temperatures;
            return true;
        }
        false
    }

    /// Work so far.
    pub fn counts(&self) -> WorkCounts {
        self.system.counts
    }
}
